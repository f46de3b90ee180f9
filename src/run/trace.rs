//! Following a branch through the states that were asked for.

use super::clock::thread_seconds;
use super::start;
use super::state::{self, Halt, Work};
use crate::bvp::{Discretization, Problem, uniform};
use crate::model::{Change, Model, Steps, When};
use crate::physics::material::Energy;
use crate::solution::{Solution, profile};
use crate::system::{Closing, Formula, Place, Probe, System};
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
    /// The problem in the stage of this state.
    pub model: Arc<Model>,
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
    /// The stage before it.
    pub stage_before: String,
    /// The stage after it.
    pub stage_after: String,
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
/// A root is one where the function is this much smaller than where it was bracketed.
const ROOT: f64 = 1e-3;
/// Turns of the control on one branch.
const MOST_TURNS: usize = 20;
/// What is said of a run that was stopped.
const INTERRUPTED: &str = "interrupted";
/// A state that misses its prediction by more, relative, and by half of the way that was made, is taken for one of another branch.
const JUMP: f64 = 0.3;
/// What is watched for an event, relative to its next value, is zero below this in the state in which a stage begins.
const FRESH: f64 = 1e-6;
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
        model: Arc::new(model.clone()),
        system: model.system.clone(),
        control,
        history: vec![],
        entered: false,
        outcome: Outcome { points: vec![], events: vec![], status: Status::Complete },
        work: Work::default(),
        begun: thread_seconds(),
        asked: None,
        typical: vec![0.0; model.quantities.len()],
    };
    let result = if requests.is_empty() { tracer.branch(progress) } else { tracer.requests(requests, progress) };
    if let Err(message) = result {
        tracer.outcome.status = Status::Incomplete(message);
    }
    tracer.outcome
}

struct Tracer {
    /// The problem in the present stage.
    model: Arc<Model>,
    /// Its equations, with the closing condition of the moment.
    system: System,
    control: usize,
    /// The last two states, newest last.
    history: Vec<Solution>,
    /// True if the first state of the history is one in which the stage changed.
    entered: bool,
    outcome: Outcome,
    /// Work since the last reported state.
    work: Work,
    begun: f64,
    /// What is asked for between the states of the branch, with what was found.
    asked: Option<Asked>,
    /// The largest magnitude of each quantity among the reported states, against which one that vanishes is measured.
    typical: Vec<f64>,
}

/// Requests for values of quantities other than the control, and the answers.
#[derive(Default)]
struct Asked {
    /// The requests.
    requests: Vec<Request>,
    /// The least and largest value met, for each.
    ranges: Vec<(f64, f64)>,
    /// The states found, for each.
    answers: Vec<Vec<Point>>,
}

/// How a walk ends before its goal.
enum Stop {
    /// The branch could not be followed.
    Halt(Halt),
    /// The control turns back; the state there has been reported.
    Turned,
    /// A stop of the file was met; the state there has been reported.
    Met,
    /// A state of another branch was found.
    Astray,
    /// The stage after a change of this element could not be understood.
    Lost(String),
}

impl Tracer {
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
            self.entered = false;
        }
        self.history.push(solution);
    }

    fn report(&mut self, reason: Reason, at: Option<Request>, solution: Solution) {
        let now = thread_seconds();
        self.work.cpu_seconds = now - self.begun;
        self.begun = now;
        for (t, q) in self.typical.iter_mut().zip(&solution.quantities) {
            *t = t.max(q.map_or(0.0, |q| q.value.abs()));
        }
        self.note_accuracy(&solution);
        let (model, work) = (self.model.clone(), std::mem::take(&mut self.work));
        self.outcome.points.push(Point { reason, at, solution, model, work });
    }

    /// A reported state that is less accurate than asked makes the outcome incomplete; it is reported with its errors all the same.
    fn note_accuracy(&mut self, solution: &Solution) {
        let (worst, which) = solution.worst_error(self.model.accuracy, &self.typical);
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
            start::first(&self.model, &mut self.work).map_err(|halt| format!("no first state was found: {halt}"))?;
        // It was closed by something else than the control.
        let c = self.value(&first);
        self.history.push(first);
        let again = self.at(c).map_err(|halt| format!("no first state was found: {halt}"))?;
        self.history = vec![again];
        Ok(())
    }

    /// The branch of the file.
    fn branch(&mut self, progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> Result<(), String> {
        let initial = start::initial(&self.model);
        let c0 = self.value(&initial);
        let targets = self.model.branch.steps.targets(c0);
        let loaded = self.model.bodies.is_empty();
        if loaded && !self.model.branch.steps.has_first() {
            self.report(Reason::Start, None, initial.clone());
        }
        self.begin()?;
        if loaded && same(targets[0], c0) {
            self.report(Reason::Step, None, initial);
        } else {
            // To the first value: the first state may lie on either side of it, and is not part of the branch asked for.
            match self.go(targets[0], loaded) {
                Ok(()) => self.report_last(targets.len() == 1),
                Err(Stop::Met) => return Ok(()),
                Err(stop) => return Err(self.stopped(&stop)),
            }
        }
        if matches!(self.model.branch.steps, Steps::Listed(_)) {
            // As listed, there and back.
            for (i, &c) in targets.iter().enumerate().skip(1) {
                if progress(i, targets.len()).is_break() {
                    return Err(INTERRUPTED.into());
                }
                match self.go(c, true) {
                    Ok(()) => self.report_last(i + 1 == targets.len()),
                    Err(Stop::Met) => return Ok(()),
                    Err(stop) => return Err(self.stopped(&stop)),
                }
            }
            return Ok(());
        }
        match self.walk(&targets, true, progress) {
            Ok(true) => Ok(()),
            // Where no last value was asked for, all has been found.
            Ok(false) if matches!(self.model.branch.steps, Steps::Open { .. }) => Ok(()),
            Ok(false) => {
                let (control, goal) = (&self.model.branch.control, targets[targets.len() - 1]);
                Err(format!(
                    "{control} = {goal} is not reached: the control turns back, and the branch leaves its range"
                ))
            }
            Err(message) => Err(message),
        }
    }

    fn report_last(&mut self, end: bool) {
        let solution = self.last().clone();
        self.report(if end { Reason::End } else { Reason::Step }, None, solution);
    }

    /// Walks from value to value of the control, in the direction of the list; where the control turns, on through the values on the
    /// other side. True when the last value or a stop of the file is reached, false when the branch leaves the list at its
    /// beginning.
    fn walk(
        &mut self,
        targets: &[f64],
        report: bool,
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<bool, String> {
        let goal = targets[targets.len() - 1];
        let forward = (goal - targets[0]).signum();
        let (mut direction, mut turns, mut done) = (forward, 0, 0);
        loop {
            if progress(done.min(targets.len()), targets.len()).is_break() {
                return Err(INTERRUPTED.into());
            }
            done += 1;
            let here = self.value(self.last());
            if same(here, goal) && direction == forward {
                return Ok(true);
            }
            let beyond = |t: &&f64| (**t - here) * direction > 0.0 && !same(**t, here);
            let Some(&c) = targets.iter().filter(beyond).min_by(|a, b| (*a - here).abs().total_cmp(&(*b - here).abs()))
            else {
                return Ok(false);
            };
            match self.go(c, report) {
                Ok(()) => {
                    if report {
                        self.report_last(c == goal);
                    }
                }
                Err(Stop::Met) => return Ok(true),
                Err(Stop::Turned) if turns < MOST_TURNS => {
                    turns += 1;
                    direction = -direction;
                }
                Err(stop) => return Err(self.stopped(&stop)),
            }
        }
    }

    /// Goes back to the first state, in its stage.
    fn return_to(&mut self, first: &Solution, model: &Arc<Model>) {
        self.model = model.clone();
        self.system = model.system.clone();
        self.history = vec![first.clone()];
        self.entered = false;
    }

    /// Why a walk ended.
    fn stopped(&self, stop: &Stop) -> String {
        let (control, c) = (&self.model.branch.control, self.value(self.last()));
        match stop {
            Stop::Halt(halt) => self.lost(halt),
            Stop::Turned => format!("the control {control} turns back at {c}"),
            Stop::Met => format!("the branch ends at {control} = {c}"),
            Stop::Astray => format!(
                "the branch could not be followed beyond {control} = {c}: the next states found belong to another"
            ),
            Stop::Lost(of) => format!("the branch cannot go on at {control} = {c}, where `{of}` appears or vanishes"),
        }
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
        let initial = start::initial(&self.model);
        let c0 = self.value(&initial);
        let loaded = self.model.bodies.is_empty();
        self.begin()?;
        let (first, begun) = (self.last().clone(), self.model.clone());
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
            self.return_to(&first, &begun);
            for i in list {
                if progress(answers.iter().filter(|a| !a.is_empty()).count(), requests.len()).is_break() {
                    return Err(INTERRUPTED.into());
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
                    Err(stop) => {
                        let (control, value) = (&self.model.branch.control, requests[i].value);
                        missing.push(format!("{control} = {value} is not reached: {}", self.stopped(&stop)));
                        self.return_to(&first, &begun);
                    }
                }
            }
        }

        // Values of other quantities are crossed on the way along the branch of the file.
        let others: Vec<usize> =
            (0..requests.len()).filter(|&i| requests[i].name != self.model.branch.control).collect();
        if !others.is_empty() {
            self.return_to(&first, &begun);
            let targets = self.model.branch.steps.targets(c0);
            let mut end = None;
            let asked = Asked {
                requests: others.iter().map(|&i| requests[i].clone()).collect(),
                ranges: vec![(f64::INFINITY, f64::NEG_INFINITY); others.len()],
                answers: others.iter().map(|_| vec![]).collect(),
            };
            // The branch of the file starts at its first value, or at the initial state.
            let from_start = loaded && (!self.model.branch.steps.has_first() || same(targets[0], c0));
            if from_start {
                self.asked = Some(asked);
                self.meet(None, &initial);
                self.meet(Some(&initial), &first);
            } else {
                let reached = self.go(targets[0], false);
                self.asked = Some(asked);
                match reached {
                    Ok(()) => {
                        let now = self.last().clone();
                        self.meet(None, &now);
                    }
                    Err(stop) => end = Some(self.stopped(&stop)),
                }
            }
            if end.is_none()
                && let Err(message) = self.walk(&targets, false, progress)
            {
                if message == INTERRUPTED {
                    return Err(message);
                }
                end = Some(message);
            }
            let asked = self.asked.take().unwrap_or_default();
            for ((&i, found), (low, high)) in others.iter().zip(asked.answers).zip(asked.ranges) {
                if found.is_empty() {
                    let r = &requests[i];
                    missing.push(format!(
                        "{} = {} is never met: on this branch it runs from {low} to {high}",
                        r.name, r.value
                    ));
                    missing.extend(end.clone().filter(|e| !e.is_empty()));
                }
                answers[i] = found;
            }
        }
        self.outcome.points = answers.into_iter().flatten().collect();
        if missing.is_empty() {
            return Ok(());
        }
        missing.dedup();
        Err(missing.join("; "))
    }

    /// Answers the requests that are met between two states of one stage of the branch, `b` included.
    fn meet(&mut self, a: Option<&Solution>, b: &Solution) {
        let Some(mut asked) = self.asked.take() else { return };
        for k in 0..asked.requests.len() {
            let request = asked.requests[k].clone();
            let Some(q) = self.model.quantities.iter().position(|q| q.name == request.name) else { continue };
            let Some(vb) = b.quantity(q) else { continue };
            let range = &mut asked.ranges[k];
            *range = (range.0.min(vb.value), range.1.max(vb.value));
            let hit = |v: f64| same(v, request.value) || v == request.value;
            let mut found = vec![];
            match a.and_then(|a| Some((a, a.quantity(q)?))) {
                None if hit(vb.value) => found.push(b.clone()),
                None => {}
                Some((a, va)) => {
                    // The quantity may turn in between: then each side of its extremum is searched.
                    let mut parts = vec![(a.clone(), b.clone())];
                    if (va.slope / self.rate(a)) * (vb.slope / self.rate(b)) < 0.0
                        && let Some(top) = self.extremum(q, a, b)
                    {
                        parts = vec![(a.clone(), top.clone()), (top, b.clone())];
                    }
                    for (a, b) in parts {
                        let (Some(va), Some(vb)) = (a.quantity(q), b.quantity(q)) else { continue };
                        if hit(va.value) {
                            continue; // answered as the end of the part before
                        }
                        if hit(vb.value) {
                            found.push(b.clone());
                        } else if (va.value - request.value) * (vb.value - request.value) < 0.0 {
                            found.extend(self.crossing(q, request.value, &a, &b));
                        }
                    }
                }
            }
            for solution in found {
                self.report(Reason::At, Some(request.clone()), solution);
                asked.answers[k].extend(self.outcome.points.pop());
            }
        }
        self.asked = Some(asked);
    }

    /// The state between two states in which quantity `q` has a value.
    fn crossing(&mut self, q: usize, value: f64, a: &Solution, b: &Solution) -> Option<Solution> {
        let formula = &self.model.clone().quantities[q].formula;
        let near = self.between(a, b, |s| s.quantity(q).map(|m| m.value - value), 1e-4)?;
        if formula.probes().all(Probe::is_local) {
            // Close the problem with the quantity itself: exact in one solution.
            let kept =
                std::mem::replace(&mut self.system.closing, Closing::Value { of: formula.clone(), target: value });
            let (mut disc, mut z) = (near.disc.clone(), near.state.clone());
            let exact = state::solve(&self.model, &self.system, &mut disc, &mut z, &self.typical, &mut self.work);
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
        let (scale, g0) = ((cb - ca).abs(), ga.abs().max(gb.abs()));
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
        // A sign may also change where the branch was left: no root then.
        best.filter(|b| b.0 <= ROOT * g0).map(|b| b.1)
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
            c1 != c0
                && self.rate(&self.history[0]) != 0.0
                && d.abs() <= 3.0 * (c1 - c0).abs()
                && (c1 - c0) * d > -(c1 - c0).powi(2)
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
        state::solve(&self.model, &self.system, &mut disc, &mut z, &self.typical, &mut self.work)
    }

    /// True if a state lies so far from where it was predicted that it may belong to another branch.
    fn jumps(&self, predicted: &(Arc<Discretization>, Vec<f64>), s: &Solution) -> bool {
        let before = self.last();
        let globals = |disc: &Discretization, z: &[f64]| disc.globals(z).to_vec();
        let (old, guess) = (globals(&before.disc, &before.state), globals(&predicted.0, &predicted.1));
        let new = globals(&s.disc, &s.state);
        (0..new.len()).any(|g| {
            let scale = new[g].abs().max(old[g].abs()).max(0.1);
            let (miss, moved) = ((new[g] - guess[g]).abs(), (new[g] - old[g]).abs());
            miss > JUMP * scale && miss > 0.5 * moved
        })
    }

    /// Accepts a state of the branch. Limit points and stops passed since the state before are reported, with `watch`; a change of
    /// the elements of the meridian is made in any case, and the branch goes on from there in its new stage.
    fn accept(&mut self, solution: Solution, watch: bool) -> Result<(), Stop> {
        let a = self.last().clone();
        let change = self.change(&a, &solution)?;
        let end = change.as_ref().map_or(&solution, |c| &c.1);
        self.meet(Some(&a), end);
        if watch {
            for (kind, of, state) in self.events(&a, end)? {
                let reason = if kind == "fold" { Reason::Fold } else { Reason::Event };
                self.happen(kind, of, self.model.stage(), state.clone());
                self.report(reason, None, state);
                if kind == "end" {
                    return Err(Stop::Met);
                }
            }
        }
        let Some((change, at)) = change else {
            if self.asked.is_some()
                && self
                    .model
                    .clone()
                    .branch
                    .stops
                    .iter()
                    .any(|(_, f)| on_slots(&self.model, f, &a) * on_slots(&self.model, f, &solution) < 0.0)
            {
                return Err(Stop::Met);
            }
            self.push(solution);
            return Ok(());
        };
        let model = self.model.toggled(change.at).map_err(|_| Stop::Lost(change.of.clone()))?;
        if watch {
            self.happen(change.kind, change.of.clone(), model.stage(), at.clone());
            self.report(Reason::Event, None, at.clone());
        }
        self.enter(model, &at)
    }

    fn happen(&mut self, kind: &'static str, of: String, stage_after: String, solution: Solution) {
        self.outcome.events.push(Event { kind, of, stage_before: self.model.stage(), stage_after, solution });
    }

    /// Goes on from a state in another stage.
    fn enter(&mut self, model: Model, from: &Solution) -> Result<(), Stop> {
        let c = self.value(from);
        let (mut disc, mut z) = carry(&self.model, from, &model);
        self.model = Arc::new(model);
        self.system = self.model.system.clone();
        let of = self.model.quantities[self.control].formula.clone();
        self.system.closing = Closing::Value { of, target: c };
        let solution = state::solve(&self.model, &self.system, &mut disc, &mut z, &self.typical, &mut self.work)
            .map_err(Stop::Halt)?;
        self.history = vec![solution];
        self.entered = true;
        Ok(())
    }

    /// The first change of the elements of the meridian between two states, and the state in which it happens.
    fn change(&mut self, a: &Solution, b: &Solution) -> Result<Option<(Change, Solution)>, Stop> {
        let model = self.model.clone();
        let (ca, cb) = (self.value(a), self.value(b));
        let mut first: Option<(f64, Change, Solution)> = None;
        for change in &model.changes {
            let g = |s: &Solution| watched(&model, change, s);
            let (Some(ga), Some(gb)) = (g(a), g(b)) else { continue };
            // A new contact has no length yet; it is undone only after it has had some. Neither is a touch believed where the stage
            // has just begun with the lift-off.
            let fresh = self.entered && self.history.len() == 1 && ga.abs() < FRESH * gb.abs();
            let crossed = match change.when {
                When::Formula(_) => ga * gb < 0.0 && !fresh,
                When::Length(_) => ga > 1e-9 && gb < 0.0,
                When::Pressure(_) => ga > 0.0 && gb < 0.0,
            };
            if crossed {
                let s = self.between(a, b, g, 1e-14).ok_or(Stop::Astray)?;
                let t = (self.value(&s) - ca) / (cb - ca);
                if first.as_ref().is_none_or(|f| t < f.0) {
                    first = Some((t, change.clone(), s));
                }
            }
        }
        Ok(first.map(|(_, change, s)| (change, s)))
    }

    /// Limit points and stops between two states, in the order of the control.
    fn events(&mut self, a: &Solution, b: &Solution) -> Result<Vec<(&'static str, String, Solution)>, Stop> {
        let model = self.model.clone();
        let mut found = vec![];
        let (ca, cb) = (self.value(a), self.value(b));
        for name in &model.branch.limit_points {
            let Some(q) = model.quantities.iter().position(|q| q.name == *name) else { continue };
            if q == self.control {
                continue; // met as a turn of the control itself
            }
            let slope = |s: &Solution| s.quantity(q).map(|m| m.slope / self.rate(s));
            if let (Some(sa), Some(sb)) = (slope(a), slope(b))
                && sa * sb < 0.0
                && let Some(s) = self.extremum(q, a, b)
            {
                found.push(("fold", name.clone(), s));
            }
        }
        for (name, formula) in &model.branch.stops {
            let g = |s: &Solution| Some(on_slots(&model, formula, s));
            if let (Some(ga), Some(gb)) = (g(a), g(b))
                && ga * gb < 0.0
            {
                let s = self.between(a, b, g, 1e-15).ok_or(Stop::Astray)?;
                found.push(("end", name.clone(), s));
            }
        }
        // Where the branch ends a quantity may end with a double zero: that is no limit point.
        let ends: Vec<f64> = found.iter().filter(|f| f.0 == "end").map(|f| self.value(&f.2)).collect();
        found.retain(|f| f.0 != "fold" || ends.iter().all(|e| (self.value(&f.2) - e).abs() > 1e-6 * e.abs()));
        // Wrinkles: the least tension changes its sign.
        let least = |s: &Solution| Some(s.certificate.least_tension).filter(|w| w.is_finite());
        if let (Some(wa), Some(wb)) = (least(a), least(b))
            && wa * wb < 0.0
            && let Some(s) = self.between(a, b, least, 1e-6)
        {
            found.push(("wrinkling", "least tension".into(), s));
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
            let predicted = self.predict(target);
            match self.at(target) {
                Ok(solution) if self.jumps(&predicted, &solution) && step.abs() > LEAST_STEP * span => {
                    step = 0.3 * (target - here);
                }
                Ok(solution) => {
                    match self.accept(solution, watch) {
                        Err(Stop::Astray) if step.abs() > LEAST_STEP * span => {
                            step = 0.3 * (target - here);
                            continue;
                        }
                        other => other?,
                    }
                    if same(self.value(self.last()), c) {
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
        let model = self.model.clone();
        // Unit tangent in the globals, relative to their magnitude, pointing towards c.
        let unit = |s: &Solution, sign: f64| -> (Vec<f64>, f64) {
            let p = s.disc.p();
            let weights: Vec<f64> =
                s.state[p..].iter().enumerate().map(|(g, v)| model.system.global_scale(g, *v).powi(-2)).collect();
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
            match state::solve(&self.model, &self.system, &mut disc, &mut z, &self.typical, &mut self.work) {
                Ok(next) => {
                    // The tangent of `next` is per unit of arclength along `direction`, so it points onwards.
                    if self.rate(&next) * toward <= 0.0 {
                        let turn = self.turn(&next, &slots, &direction, base, ds)?;
                        self.happen("fold", self.model.branch.control.clone(), self.model.stage(), turn.clone());
                        self.report(Reason::Fold, None, turn);
                        self.history = vec![next];
                        self.entered = false;
                        return Err(Stop::Turned);
                    }
                    let passed = (self.value(&next) - c) * toward >= 0.0;
                    if passed {
                        return Ok(());
                    }
                    self.accept(next, watch)?;
                    if !Arc::ptr_eq(&model, &self.model) {
                        return Ok(()); // another stage, other unknowns
                    }
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

    /// The state in which the control is stationary, between the state at arclength 0 and `b`, at `ds`, which is beyond it.
    fn turn(&mut self, b: &Solution, slots: &[usize], direction: &[f64], base: f64, ds: f64) -> Result<Solution, Stop> {
        // Positive before the turn, negative after it. The rate of `a` is per unit of its own closing condition: its size is unknown.
        let beyond = self.rate(b).signum();
        let (mut xa, mut xb, mut gb) = (0.0, ds, -self.rate(b).abs());
        let mut ga = gb.abs();
        let (end, size) = (ds, ga);
        let mut best = b.clone();
        for _ in 0..60 {
            let mut x = (xa * gb - xb * ga) / (gb - ga);
            if !x.is_finite() || (x - xa) * (x - xb) >= 0.0 {
                x = 0.5 * (xa + xb);
            }
            let (mut disc, mut z) = (best.disc.clone(), best.state.clone());
            self.system.closing =
                Closing::Arc { slots: slots.to_vec(), direction: direction.to_vec(), target: base + x };
            let s = state::solve(&self.model, &self.system, &mut disc, &mut z, &self.typical, &mut self.work)
                .map_err(Stop::Halt)?;
            let g = -self.rate(&s) * beyond;
            best = s;
            if g.abs() <= 1e-13 * size || (xb - xa).abs() <= 1e-12 * end {
                break;
            }
            // Illinois: the end that stays counts half.
            if g > 0.0 {
                (xa, ga) = (x, g);
                gb *= if xb == end { 1.0 } else { 0.5 };
            } else {
                (xb, gb) = (x, g);
                ga *= if xa == 0.0 { 1.0 } else { 0.5 };
            }
        }
        Ok(best)
    }
}

/// The value of a formula of slots at a state.
fn on_slots(model: &Model, formula: &Formula, s: &Solution) -> f64 {
    let index = s.disc.slot_index();
    formula.value(&model.system, &|slot| s.state[index[slot]])
}

/// What is watched for a change, at a state.
fn watched(model: &Model, change: &Change, s: &Solution) -> Option<f64> {
    match &change.when {
        When::Formula(formula) => Some(on_slots(model, formula, s)),
        When::Length(piece) => {
            let globals = s.disc.globals(&s.state);
            let at = |place: Place| match place {
                Place::Unknown(g) => Some(globals[g]),
                Place::Fixed(eta) => Some(eta),
                Place::Pole => None,
            };
            let p = &model.system.pieces[*piece];
            Some(at(p.to)? - at(p.from)?)
        }
        When::Pressure(piece) => {
            let name = &model.system.pieces[*piece].name;
            profile(model, s).iter().filter(|r| r.segment == *name).filter_map(|r| r.p_c).reduce(f64::min)
        }
    }
}

/// A state of one stage as a first approximation in another: pieces and unknowns of the same name keep what they have; a piece
/// that appears has no length, at the end of the piece before it.
fn carry(old: &Model, s: &Solution, new: &Model) -> (Arc<Discretization>, Vec<f64>) {
    let same = |name: &str| old.system.pieces.iter().position(|p| p.name == name);
    let pieces = &new.system.pieces;
    let meshes =
        pieces.iter().map(|p| same(&p.name).map_or_else(|| uniform(2), |o| s.disc.meshes[o].clone())).collect();
    let disc = Discretization::new(new.system.layout().clone(), s.disc.gauss.clone(), meshes);
    let mut z = vec![0.0; disc.unknowns()];
    let old_globals = s.disc.globals(&s.state);
    let place = |place: Place| match place {
        Place::Unknown(g) => old_globals[g],
        Place::Fixed(eta) => eta,
        Place::Pole => 0.0,
    };
    for (i, piece) in pieces.iter().enumerate() {
        if let Some(o) = same(&piece.name) {
            let from = s.disc.y(o, 0)..s.disc.q(o) + s.disc.layout.segments[o].coupled;
            z[disc.y(i, 0)..disc.q(i) + disc.layout.segments[i].coupled].copy_from_slice(&s.state[from]);
            continue;
        }
        let Some(o) = i.checked_sub(1).and_then(|b| same(&pieces[b].name)) else { continue };
        let end = s.disc.y(o, s.disc.intervals(o));
        let n = piece.kind.states().min(old.system.pieces[o].kind.states());
        for point in 0..=disc.intervals(i) {
            let at = disc.y(i, point);
            z[at..at + n].copy_from_slice(&s.state[end..end + n]);
        }
    }
    for (g, name) in new.globals.iter().enumerate() {
        let at = disc.p() + g;
        if let Some(o) = old.globals.iter().position(|n| n == name) {
            z[at] = old_globals[o];
            continue;
        }
        for (i, piece) in pieces.iter().enumerate() {
            let before = i.checked_sub(1).and_then(|b| same(&pieces[b].name));
            if piece.to == Place::Unknown(g)
                && let Some(o) = same(&piece.name)
            {
                z[at] = place(old.system.pieces[o].to);
            } else if *name == format!("{}.start.h", piece.name)
                && let Some(o) = before
            {
                // Where the piece before it ends: its start, and its fall.
                let start = old.globals.iter().position(|n| *n == format!("{}.start.h", old.system.pieces[o].name));
                z[at] = start.map_or(0.0, |g| old_globals[g]) + s.state[s.disc.q(o)];
            }
        }
    }
    (Arc::new(disc), z)
}

/// True if two values agree to within what counts as the same.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}
