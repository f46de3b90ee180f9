//! Following a branch through the states that were asked for.

use super::clock::thread_seconds;
use super::start;
use super::state::{self, Halt, Work};
use crate::bvp::{Discretization, Problem};
use crate::model::{Model, Steps};
use crate::physics::material::Energy;
use crate::solution::Solution;
use crate::system::{Closing, Probe, System};
use std::ops::ControlFlow;
use std::sync::Arc;

/// A request for the states in which a quantity has a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Name of the quantity.
    pub name: String,
    /// Value.
    pub value: f64,
}

/// Why a state is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// Asked for by value.
    At,
    /// A step of the branch.
    Step,
    /// A limit point.
    Fold,
    /// An event.
    Event,
    /// The initial state.
    Start,
    /// The end of the branch.
    End,
}

/// A reported state.
#[derive(Clone, Debug)]
pub struct Point {
    /// Why.
    pub reason: Reason,
    /// The request that it answers.
    pub at: Option<Request>,
    /// The state.
    pub solution: Solution,
    /// Work since the state before.
    pub work: Work,
}

/// Something that happens on a branch.
#[derive(Clone, Debug)]
pub struct Event {
    /// `fold`, `end`, ..
    pub kind: &'static str,
    /// The quantity or name.
    pub of: String,
    /// The state.
    pub solution: Solution,
}

/// Whether all was found that was asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Status {
    /// All of it.
    Complete,
    /// Not all: why, and what to do.
    Incomplete(String),
}

/// The answer to a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The states.
    pub points: Vec<Point>,
    /// The events.
    pub events: Vec<Event>,
    /// Whether that is all.
    pub status: Status,
}

/// The smallest step, relative to the span of the branch, before the control is believed to turn back.
const LEAST_STEP: f64 = 1e-3;
/// The smallest step of arclength, relative to the first one, before the branch is given up.
const LEAST_ARC: f64 = 1e-4;
/// Steps of arclength in which the control must pass a value or turn.
const ARC_STEPS: usize = 200;
/// A value that misses an end of the branch by less, relative, is that end.
const SAME: f64 = 1e-10;

/// Runs a model: the branch of its file, or the requested states only. `progress` is told how many states of how many are done, and
/// may stop the run; what was found is returned.
pub fn run(model: &Model, requests: &[Request], progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> Outcome {
    let control = model
        .quantities
        .iter()
        .position(|q| q.name == model.branch.control)
        .expect("the control is a quantity of the model");
    let mut tracer = Tracer {
        model,
        system: model.system.clone(),
        control,
        history: vec![],
        outcome: Outcome { points: vec![], events: vec![], status: Status::Complete },
        work: Work::default(),
        begun: thread_seconds(),
    };
    let result = if requests.is_empty() { tracer.branch(progress) } else { tracer.requests(requests, progress) };
    if let Err(message) = result {
        tracer.outcome.status = Status::Incomplete(message);
    }
    tracer.outcome
}

struct Tracer<'m> {
    model: &'m Model,
    system: System,
    control: usize,
    /// The last two states, newest last.
    history: Vec<Solution>,
    outcome: Outcome,
    /// Work since the last reported state.
    work: Work,
    begun: f64,
}

/// How a walk ends before its goal.
enum Stop {
    /// The branch could not be followed.
    Halt(Halt),
    /// The control turns back; the state there has been reported.
    Turned,
    /// A stop of the file was met; the state there has been reported.
    Met,
}

impl Tracer<'_> {
    fn last(&self) -> &Solution {
        self.history.last().expect("a first state")
    }

    fn value(&self, s: &Solution) -> f64 {
        s.quantity(self.control).expect("the control is a number").value
    }

    /// d control / d closing condition.
    fn rate(&self, s: &Solution) -> f64 {
        s.quantity(self.control).map_or(1.0, |q| q.slope)
    }

    fn push(&mut self, solution: Solution) {
        if self.history.len() > 1 {
            self.history.remove(0);
        }
        self.history.push(solution);
    }

    fn report(&mut self, reason: Reason, at: Option<Request>, solution: Solution) {
        let now = thread_seconds();
        self.work.cpu_seconds = now - self.begun;
        self.begun = now;
        self.note_accuracy(&solution);
        self.outcome.points.push(Point { reason, at, solution, work: std::mem::take(&mut self.work) });
    }

    /// A reported state that is less accurate than asked makes the outcome incomplete; it is reported with its errors all the same.
    fn note_accuracy(&mut self, solution: &Solution) {
        let (worst, which) = solution.worst_error(self.model.accuracy);
        if worst > 1.0 && self.outcome.status == Status::Complete {
            let m = solution.quantity(which).expect("the worst quantity is a number");
            self.outcome.status = Status::Incomplete(format!(
                "at {} = {} the accuracy asked for was not reached: `{}` is known to {:.1e} relative; rounding alone allows no more",
                self.model.branch.control,
                self.value(solution),
                self.model.quantities[which].name,
                m.error / m.value.abs()
            ));
        }
    }

    /// The first state, ready to be continued in the control.
    fn begin(&mut self) -> Result<(), String> {
        let first =
            start::first(self.model, &mut self.work).map_err(|halt| format!("no first state was found: {halt}"))?;
        // It was closed by something else than the control.
        let c = self.value(&first);
        self.history.push(first);
        let again = self.at(c).map_err(|halt| format!("no first state was found: {halt}"))?;
        self.history = vec![again];
        Ok(())
    }

    /// The branch of the file.
    fn branch(&mut self, progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> Result<(), String> {
        let initial = start::initial(self.model);
        let c0 = self.value(&initial);
        let targets = self.model.branch.steps.targets(c0);
        let loaded = self.model.bodies.is_empty();
        let mut met = 0;
        if loaded && !matches!(self.model.branch.steps, Steps::Spaced { from: Some(_), .. }) {
            self.report(Reason::Start, None, initial.clone());
        }
        self.begin()?;
        let mut from = None;
        for (i, &c) in targets.iter().enumerate() {
            if progress(met, targets.len()).is_break() {
                return Err("interrupted".into());
            }
            met += 1;
            if loaded && same(c, c0) {
                self.report(Reason::Step, None, initial.clone());
                continue;
            }
            let watch = from.is_some() || loaded;
            match self.go(c, watch) {
                Ok(()) => {
                    let solution = self.last().clone();
                    self.report(if i + 1 == targets.len() { Reason::End } else { Reason::Step }, None, solution);
                    from = Some(c);
                }
                Err(Stop::Met) => return Ok(()),
                Err(Stop::Halt(halt)) => return Err(self.lost(&halt)),
                Err(Stop::Turned) => {
                    // Back through the values that were passed before the turn.
                    let turned = self.value(self.last());
                    let back: Vec<f64> =
                        targets[..i].iter().rev().copied().filter(|t| !same(*t, turned) || *t != turned).collect();
                    for c in back {
                        if progress(met.min(targets.len()), targets.len()).is_break() {
                            return Err("interrupted".into());
                        }
                        match self.go(c, true) {
                            Ok(()) => {
                                let solution = self.last().clone();
                                self.report(Reason::Step, None, solution);
                            }
                            Err(Stop::Met) => return Ok(()),
                            Err(Stop::Turned) => break,
                            Err(Stop::Halt(halt)) => return Err(self.lost(&halt)),
                        }
                    }
                    let control = &self.model.branch.control;
                    return Err(format!(
                        "the control turns back at {control} = {turned}: {} = {c} is not reached",
                        control
                    ));
                }
            }
        }
        Ok(())
    }

    fn lost(&self, halt: &Halt) -> String {
        let c = self.value(self.last());
        let mut message =
            format!("the branch could not be followed beyond {} = {c}: {halt}", self.model.branch.control);
        let violations = &self.last().certificate.violations;
        if !violations.is_empty() {
            message += &format!("; the last state is inadmissible: {}", violations.join(", "));
        } else if self.model.system.law.locking().is_some() {
            message += "; a material that locks allows no state beyond some load";
        }
        message
    }

    /// Requested states.
    fn requests(
        &mut self,
        requests: &[Request],
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<(), String> {
        let initial = start::initial(self.model);
        let c0 = self.value(&initial);
        let loaded = self.model.bodies.is_empty();
        self.begin()?;
        let first = self.last().clone();
        let mut missing = vec![];
        let mut answers: Vec<Vec<Point>> = requests.iter().map(|_| vec![]).collect();

        // Values of the control are stepped to directly, in the order in which the branch meets them.
        let direction = self.model.branch.steps.targets(c0).last().map_or(1.0, |last| (last - c0).signum());
        let mut direct: Vec<usize> =
            (0..requests.len()).filter(|&i| requests[i].name == self.model.branch.control).collect();
        direct.sort_by(|&a, &b| (direction * requests[a].value).total_cmp(&(direction * requests[b].value)));
        let start = self.value(&first);
        let (before, after): (Vec<usize>, Vec<usize>) =
            direct.into_iter().partition(|&i| direction * requests[i].value < direction * start);
        for list in [before.into_iter().rev().collect::<Vec<_>>(), after] {
            self.history = vec![first.clone()];
            for i in list {
                if progress(answers.iter().filter(|a| !a.is_empty()).count(), requests.len()).is_break() {
                    return Err("interrupted".into());
                }
                if loaded && same(requests[i].value, c0) {
                    self.report(Reason::At, Some(requests[i].clone()), initial.clone());
                    answers[i].extend(self.outcome.points.pop());
                    continue;
                }
                match self.go(requests[i].value, false) {
                    Ok(()) => {
                        let solution = self.last().clone();
                        self.report(Reason::At, Some(requests[i].clone()), solution);
                        answers[i].extend(self.outcome.points.pop());
                    }
                    Err(Stop::Halt(halt)) => {
                        missing.push(self.lost(&halt));
                        self.history = vec![first.clone()];
                    }
                    Err(Stop::Turned | Stop::Met) => {
                        let (control, c) = (&self.model.branch.control, self.value(self.last()));
                        missing.push(format!(
                            "{control} = {} is never met: the control turns back at {c}",
                            requests[i].value
                        ));
                        self.history = vec![first.clone()];
                    }
                }
            }
        }

        // Values of other quantities are crossed on the way along the branch of the file.
        let others: Vec<usize> =
            (0..requests.len()).filter(|&i| requests[i].name != self.model.branch.control).collect();
        if !others.is_empty() {
            let mut ranges: Vec<(f64, f64)> = others.iter().map(|_| (f64::INFINITY, f64::NEG_INFINITY)).collect();
            self.history = vec![first];
            let targets = self.model.branch.steps.targets(c0);
            let mut end = None;
            if loaded && !matches!(self.model.branch.steps, Steps::Spaced { from: Some(_), .. }) {
                self.meet(requests, &others, &mut ranges, &mut answers, None, &initial);
            }
            let mut begun = false;
            for &c in &targets {
                if progress(answers.iter().filter(|a| !a.is_empty()).count(), requests.len()).is_break() {
                    return Err("interrupted".into());
                }
                let before = begun.then(|| self.last().clone());
                match self.go(c, false) {
                    Ok(()) => {
                        let now = self.last().clone();
                        self.meet(requests, &others, &mut ranges, &mut answers, before.as_ref(), &now);
                        begun = true;
                    }
                    Err(Stop::Halt(halt)) => {
                        end = Some(self.lost(&halt));
                        break;
                    }
                    Err(_) => {
                        let now = self.last().clone();
                        self.meet(requests, &others, &mut ranges, &mut answers, before.as_ref(), &now);
                        break;
                    }
                }
            }
            for (k, &i) in others.iter().enumerate() {
                if answers[i].is_empty() {
                    let (r, (low, high)) = (&requests[i], ranges[k]);
                    missing.push(format!(
                        "{} = {} is never met: on this branch it runs from {low} to {high}",
                        r.name, r.value
                    ));
                    missing.extend(end.clone());
                }
            }
        }
        self.outcome.points = answers.into_iter().flatten().collect();
        if missing.is_empty() {
            return Ok(());
        }
        missing.dedup();
        Err(missing.join("; "))
    }

    /// Answers the requests that are met between two states of the branch, `b` included.
    fn meet(
        &mut self,
        requests: &[Request],
        which: &[usize],
        ranges: &mut [(f64, f64)],
        answers: &mut [Vec<Point>],
        a: Option<&Solution>,
        b: &Solution,
    ) {
        for (k, &i) in which.iter().enumerate() {
            let request = &requests[i];
            let Some(q) = self.model.quantities.iter().position(|q| q.name == request.name) else { continue };
            let Some(vb) = b.quantity(q) else { continue };
            let range = &mut ranges[k];
            *range = (range.0.min(vb.value), range.1.max(vb.value));
            let hit = |v: f64| same(v, request.value) || v == request.value;
            if a.is_none() && hit(vb.value) {
                self.report(Reason::At, Some(request.clone()), b.clone());
                answers[i].extend(self.outcome.points.pop());
                continue;
            }
            let Some(a) = a else { continue };
            let Some(va) = a.quantity(q) else { continue };
            // The quantity may turn in between: then each side of its extremum is searched.
            let mut parts = vec![(a.clone(), b.clone())];
            let slope = |s: &Solution, m: f64| m / self.rate(s);
            if slope(a, va.slope) * slope(b, vb.slope) < 0.0
                && let Some(top) = self.extremum(q, a, b)
            {
                parts = vec![(a.clone(), top.clone()), (top, b.clone())];
            }
            for (a, b) in parts {
                let (Some(va), Some(vb)) = (a.quantity(q), b.quantity(q)) else { continue };
                let (da, db) = (va.value - request.value, vb.value - request.value);
                if hit(va.value) {
                    continue; // answered as the end of the part before
                }
                let found = if hit(vb.value) {
                    Some(b.clone())
                } else if da * db < 0.0 {
                    self.crossing(q, request.value, &a, &b)
                } else {
                    None
                };
                if let Some(solution) = found {
                    self.report(Reason::At, Some(request.clone()), solution);
                    answers[i].extend(self.outcome.points.pop());
                }
            }
        }
    }

    /// The state between two states in which quantity `q` has a value.
    fn crossing(&mut self, q: usize, value: f64, a: &Solution, b: &Solution) -> Option<Solution> {
        let formula = &self.model.quantities[q].formula;
        let near = self.between(a, b, |s| s.quantity(q).map(|m| m.value - value), 1e-4)?;
        if formula.probes().all(Probe::is_local) {
            // Close the problem with the quantity itself: exact in one solution.
            let kept =
                std::mem::replace(&mut self.system.closing, Closing::Value { of: formula.clone(), target: value });
            let (mut disc, mut z) = (near.disc.clone(), near.state.clone());
            let exact = state::solve(self.model, &self.system, &mut disc, &mut z, &mut self.work);
            self.system.closing = kept;
            if let Ok(exact) = exact {
                return Some(exact);
            }
        }
        self.between(a, b, |s| s.quantity(q).map(|m| m.value - value), 1e-15)
    }

    /// The state between two states in which quantity `q` is stationary along the branch.
    fn extremum(&mut self, q: usize, a: &Solution, b: &Solution) -> Option<Solution> {
        let control = self.control;
        self.between(a, b, |s| Some(s.quantity(q)?.slope / s.quantity(control)?.slope), 1e-12)
    }

    /// Root of `g` on the branch between two states where it has opposite signs: regula falsi with halved weights (Illinois)
    /// in the control, to a relative width of `width`.
    fn between(
        &mut self,
        a: &Solution,
        b: &Solution,
        g: impl Fn(&Solution) -> Option<f64>,
        width: f64,
    ) -> Option<Solution> {
        let (mut ca, mut cb) = (self.value(a), self.value(b));
        let (mut ga, mut gb) = (g(a)?, g(b)?);
        let scale = (cb - ca).abs();
        let kept = self.history.clone();
        self.history = vec![a.clone(), b.clone()];
        let mut best: Option<(f64, Solution)> = None;
        let mut side = 0;
        for _ in 0..60 {
            let mut c = (ca * gb - cb * ga) / (gb - ga);
            if !(c - ca).is_finite() || (c - ca) * (c - cb) >= 0.0 {
                c = 0.5 * (ca + cb);
            }
            let Ok(s) = self.at(c) else { break };
            let Some(gc) = g(&s) else { break };
            self.history = vec![b.clone(), s.clone()];
            if best.as_ref().is_none_or(|(v, _)| gc.abs() <= *v) {
                best = Some((gc.abs(), s));
            }
            if gc == 0.0 || (cb - ca).abs() <= width * scale.max(c.abs()) {
                break;
            }
            let move_a = (gc > 0.0) == (ga > 0.0);
            let step = if move_a { (c - ca).abs() } else { (c - cb).abs() };
            if move_a {
                (ca, ga) = (c, gc);
                if side == 1 {
                    gb *= 0.5;
                }
                side = 1;
            } else {
                (cb, gb) = (c, gc);
                if side == -1 {
                    ga *= 0.5;
                }
                side = -1;
            }
            if step <= width * scale.max(c.abs()) {
                break;
            }
        }
        self.history = kept;
        best.map(|b| b.1)
    }

    /// The state predicted at a value of the control, on the newest mesh: the cubic through two states with their tangents, or the
    /// tangent of one.
    fn predict(&self, c: f64) -> (Arc<Discretization>, Vec<f64>) {
        let s1 = self.last();
        let disc = s1.disc.clone();
        let c1 = self.value(s1);
        let d = c - c1;
        let (k1, t1) = (self.rate(s1), &s1.tangent);
        let usable = self.history.len() > 1 && {
            let c0 = self.value(&self.history[0]);
            c1 != c0 && d.abs() <= 3.0 * (c1 - c0).abs() && (c1 - c0) * d > -(c1 - c0).powi(2)
        };
        if !usable {
            let z = s1.state.iter().zip(t1).map(|(z, t)| z + d * t / k1).collect();
            return (disc, z);
        }
        let s0 = &self.history[0];
        let carry = |v: &[f64]| if s0.disc.meshes == disc.meshes { v.to_vec() } else { s0.disc.transfer(v, &disc) };
        let (z0, t0, k0) = (carry(&s0.state), carry(&s0.tangent), self.rate(s0));
        let h = c1 - self.value(s0);
        let t = d / h; // from the newest state
        // Hermite basis on [c0, c1] at 1 + t, differences taken from the newest state.
        let (h00, h10, h11) = ((3.0 + 2.0 * t) * t * t, (1.0 + t) * t * t, (1.0 + t) * (1.0 + t) * t);
        let z = (0..disc.unknowns())
            .map(|i| s1.state[i] + h00 * (z0[i] - s1.state[i]) + h * (h10 * t0[i] / k0 + h11 * t1[i] / k1))
            .collect();
        (disc, z)
    }

    /// Solves at a value of the control.
    fn at(&mut self, c: f64) -> Result<Solution, Halt> {
        let (mut disc, mut z) = self.predict(c);
        let of = &self.model.quantities[self.control].formula;
        self.system.closing = Closing::Value { of: of.clone(), target: c };
        state::solve(self.model, &self.system, &mut disc, &mut z, &mut self.work)
    }

    /// Accepts a state of the branch. With `watch`, limit points and stops passed since the state before are reported first.
    fn accept(&mut self, solution: Solution, watch: bool) -> Result<(), Stop> {
        if watch {
            let a = self.last().clone();
            let found = self.events(&a, &solution)?;
            for (kind, of, state) in found {
                let reason = if kind == "fold" { Reason::Fold } else { Reason::Event };
                self.outcome.events.push(Event { kind, of, solution: state.clone() });
                self.report(reason, None, state);
                if kind == "end" {
                    return Err(Stop::Met);
                }
            }
        }
        self.push(solution);
        Ok(())
    }

    /// Limit points and stops between two states, in the order of the control.
    fn events(&mut self, a: &Solution, b: &Solution) -> Result<Vec<(&'static str, String, Solution)>, Stop> {
        let mut found = vec![];
        let (ca, cb) = (self.value(a), self.value(b));
        for name in self.model.branch.limit_points.clone() {
            let Some(q) = self.model.quantities.iter().position(|q| q.name == name) else { continue };
            if q == self.control {
                continue; // met as a turn of the control itself
            }
            let slope = |s: &Solution| s.quantity(q).map(|m| m.slope / self.rate(s));
            if let (Some(sa), Some(sb)) = (slope(a), slope(b))
                && sa * sb < 0.0
                && let Some(s) = self.extremum(q, a, b)
            {
                found.push(("fold", name, s));
            }
        }
        for (name, formula) in &self.model.branch.stops {
            let g = |s: &Solution| {
                let index = s.disc.slot_index();
                Some(formula.value(&self.model.system, &|slot| s.state[index[slot]]))
            };
            if let (Some(ga), Some(gb)) = (g(a), g(b))
                && ga * gb < 0.0
            {
                let model = self.model;
                let g = move |s: &Solution| {
                    let index = s.disc.slot_index();
                    Some(formula.value(&model.system, &|slot| s.state[index[slot]]))
                };
                if let Some(s) = self.between(a, b, g, 1e-15) {
                    found.push(("end", name.clone(), s));
                }
            }
        }
        found.sort_by(|x, y| ((self.value(&x.2) - ca) / (cb - ca)).total_cmp(&((self.value(&y.2) - ca) / (cb - ca))));
        Ok(found)
    }

    /// Follows the branch from the last state to a value of the control, in as many steps as it takes.
    fn go(&mut self, c: f64, watch: bool) -> Result<(), Stop> {
        let span = (c - self.value(self.last())).abs();
        let mut step = c - self.value(self.last());
        loop {
            let here = self.value(self.last());
            let left = c - here;
            if left == 0.0 || span == 0.0 {
                return Ok(());
            }
            let target = if step.abs() >= 0.999 * left.abs() { c } else { here + step };
            match self.at(target) {
                Ok(solution) => {
                    self.accept(solution, watch)?;
                    if target == c {
                        return Ok(());
                    }
                    step *= 2.0;
                }
                Err(halt) => {
                    step = 0.3 * (target - here);
                    if step.abs() < LEAST_STEP * span {
                        self.around(c, watch, halt)?;
                        step = c - self.value(self.last());
                    }
                }
            }
        }
    }

    /// Follows the branch by arclength, where steps in the control fail, until the control is nearer to `c` than before by a good part
    /// or turns back.
    fn around(&mut self, c: f64, watch: bool, halt: Halt) -> Result<(), Stop> {
        let begun = self.value(self.last());
        let toward = (c - begun).signum();
        // Unit tangent in the globals, relative to their magnitude, pointing towards c.
        let unit = |s: &Solution, sign: f64| -> (Vec<f64>, f64) {
            let p = s.disc.p();
            let weights: Vec<f64> =
                s.state[p..].iter().enumerate().map(|(g, v)| self.model.system.global_scale(g, *v).powi(-2)).collect();
            let t = &s.tangent[p..];
            let length = t.iter().zip(&weights).map(|(t, w)| t * t * w).sum::<f64>().sqrt();
            (t.iter().zip(&weights).map(|(t, w)| sign * t * w / length).collect(), sign / length)
        };
        let p = |s: &Solution| s.disc.p();
        let globals = |s: &Solution| s.state[p(s)..].to_vec();
        let layout = self.model.system.layout().clone();
        let slots: Vec<usize> = (0..layout.globals).map(|g| layout.global(g)).collect();
        let sign = toward * self.rate(self.last()).signum();
        let (mut direction, mut scale) = unit(self.last(), sign);
        let mut ds = 1e-2;
        let least = LEAST_ARC * ds;
        for _ in 0..ARC_STEPS {
            let s = self.last().clone();
            let base: f64 = globals(&s).iter().zip(&direction).map(|(z, d)| z * d).sum();
            let mut disc = s.disc.clone();
            let mut z: Vec<f64> = s.state.iter().zip(&s.tangent).map(|(z, t)| z + ds * scale * t).collect();
            self.system.closing =
                Closing::Arc { slots: slots.clone(), direction: direction.clone(), target: base + ds };
            match state::solve(self.model, &self.system, &mut disc, &mut z, &mut self.work) {
                Ok(next) => {
                    // The tangent of `next` is per unit of arclength along `direction`, so it points onwards.
                    if self.rate(&next) * toward <= 0.0 {
                        let turn = self.turn(&s, &next, &slots, &direction, base, ds)?;
                        self.outcome.events.push(Event {
                            kind: "fold",
                            of: self.model.branch.control.clone(),
                            solution: turn.clone(),
                        });
                        self.report(Reason::Fold, None, turn);
                        self.history = vec![next];
                        return Err(Stop::Turned);
                    }
                    let passed = (self.value(&next) - c) * toward >= 0.0;
                    if passed {
                        return Ok(());
                    }
                    self.accept(next, watch)?;
                    (direction, scale) = unit(self.last(), 1.0);
                    ds *= 1.5;
                    if (self.value(self.last()) - begun).abs() > 0.1 * (c - begun).abs() {
                        return Ok(());
                    }
                }
                Err(failed) => {
                    ds *= 0.3;
                    if ds < least {
                        return Err(Stop::Halt(if matches!(failed, Halt::Newton { .. }) { halt } else { failed }));
                    }
                }
            }
        }
        Err(Stop::Halt(halt))
    }

    /// The state between two states of arclength in which the control is stationary.
    fn turn(
        &mut self,
        a: &Solution,
        b: &Solution,
        slots: &[usize],
        direction: &[f64],
        base: f64,
        ds: f64,
    ) -> Result<Solution, Stop> {
        let (mut xa, mut xb) = (0.0, ds);
        let (first, _) = (self.rate(a), ());
        // The rate of `a` is per unit of its own closing; only its sign is used.
        let (mut ga, mut gb) = (first.abs(), -self.rate(b).abs());
        let mut best = b.clone();
        ga = ga.min(gb.abs());
        for _ in 0..60 {
            let mut x = (xa * gb - xb * ga) / (gb - ga);
            if !x.is_finite() || (x - xa) * (x - xb) >= 0.0 {
                x = 0.5 * (xa + xb);
            }
            let (mut disc, mut z) = (best.disc.clone(), best.state.clone());
            self.system.closing =
                Closing::Arc { slots: slots.to_vec(), direction: direction.to_vec(), target: base + x };
            let s = state::solve(self.model, &self.system, &mut disc, &mut z, &mut self.work).map_err(Stop::Halt)?;
            let toward = (self.value(b) - self.value(a)).signum();
            let _ = toward;
            let g = self.rate(&s) * self.rate(b).signum() * -1.0;
            best = s;
            if g.abs() <= 1e-13 * gb.abs().max(ga) || (xb - xa).abs() <= 1e-12 * ds {
                break;
            }
            if g > 0.0 {
                (xa, ga) = (x, g);
                gb *= if xb == ds { 1.0 } else { 0.5 };
            } else {
                (xb, gb) = (x, g);
                ga *= if xa == 0.0 { 1.0 } else { 0.5 };
            }
        }
        Ok(best)
    }
}

/// True if two values agree to within what counts as the same.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}
