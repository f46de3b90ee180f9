//! Following a branch from state to state.

use super::clock::thread_seconds;
use super::outcome::{Outcome, Point, Reason, Request, Status};
use super::stage::on_slots;
use super::state::{self, Halt, Work};
use crate::bvp::Discretization;
use crate::model::Model;
use crate::number::plain;
use crate::solution::Solution;
use crate::system::{Closing, System, continue_field};
use std::sync::Arc;

/// The smallest step, relative to the span of the branch, before the control is believed to turn back.
const LEAST_STEP: f64 = 1e-3;
/// A state that misses its prediction by more, relative, and by half of the way that was made, is taken for one of another branch.
const JUMP: f64 = 0.3;
/// A field is not continued further than this, relative to the last step.
const FURTHEST: f64 = 3.0;
/// A value that misses an end of the branch by less, relative, is that end.
const SAME: f64 = 1e-10;

pub(super) struct Tracer {
    /// The problem in the present stage.
    pub(super) model: Arc<Model>,
    /// Its equations, with the closing condition of the moment.
    pub(super) system: System,
    pub(super) control: usize,
    /// The last two states, newest last.
    pub(super) history: Vec<Solution>,
    /// True if the first state of the history is one in which the stage changed.
    pub(super) entered: bool,
    pub(super) outcome: Outcome,
    /// Work since the last reported state.
    pub(super) work: Work,
    pub(super) begun: f64,
    /// What is asked for between the states of the branch, with what was found.
    pub(super) asked: Option<Asked>,
    /// The largest magnitude of each quantity among the reported states, against which one that vanishes is measured.
    pub(super) typical: Vec<f64>,
}

/// Requests for values of quantities other than the control, and the answers.
#[derive(Default)]
pub(super) struct Asked {
    /// The requests.
    pub(super) requests: Vec<Request>,
    /// The least and largest value met, for each.
    pub(super) ranges: Vec<(f64, f64)>,
    /// The states found, for each.
    pub(super) answers: Vec<Vec<Point>>,
}

/// How a walk ends before its goal.
pub(super) enum Stop {
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
    pub(super) fn last(&self) -> &Solution {
        self.history.last().expect("a first state")
    }

    pub(super) fn value(&self, s: &Solution) -> f64 {
        s.quantity(self.control).expect("the control is a number").value
    }

    /// d control / d closing condition.
    pub(super) fn rate(&self, s: &Solution) -> f64 {
        s.quantity(self.control).map_or(1.0, |q| q.slope)
    }

    pub(super) fn push(&mut self, solution: Solution) {
        if self.history.len() > 1 {
            self.history.remove(0);
            self.entered = false;
        }
        self.history.push(solution);
    }

    pub(super) fn report(&mut self, reason: Reason, at: Option<Request>, solution: Solution) {
        let now = thread_seconds();
        self.work.cpu_seconds = now - self.begun + self.work.elsewhere;
        self.begun = now;
        for (t, q) in self.typical.iter_mut().zip(&solution.quantities) {
            *t = t.max(q.map_or(0.0, |q| q.value.abs()));
        }
        self.note_accuracy(&solution);
        let (model, work) = (self.model.clone(), std::mem::take(&mut self.work));
        self.outcome.points.push(Point { reason, at, solution, model, work });
    }

    /// A reported state that is less accurate than asked makes the outcome incomplete; it is reported with its errors all the same.
    pub(super) fn note_accuracy(&mut self, solution: &Solution) {
        let (worst, which) = solution.worst_error(self.model.accuracy, &self.typical);
        if worst > 1.0 && self.outcome.status == Status::Complete {
            let m = solution.quantity(which).expect("the worst quantity is a number");
            self.outcome.status = Status::Incomplete(format!(
                "at {} = {} the accuracy asked for was not reached: `{}` is known to {:.1e} relative; rounding alone allows no more",
                self.model.branch.control,
                plain(self.value(solution)),
                self.model.quantities[which].name,
                m.error / m.value.abs()
            ));
        }
    }

    /// The state predicted at a value of the control, on the newest mesh: the cubic through two states with their tangents, or the
    /// tangent of one.
    pub(super) fn predict(&self, c: f64) -> (Arc<Discretization>, Vec<f64>) {
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

    /// The field of a charged membrane at a predicted state on the newest mesh: it goes on from the last states as far as the shape does.
    fn foresee(&mut self, disc: &Discretization, z: &[f64]) {
        let (Some(s1), true) = (self.history.last(), self.system.repels()) else { return };
        let s0 = &self.history[0];
        let before = if s0.disc.meshes == disc.meshes { s0.state.clone() } else { s0.disc.transfer(&s0.state, disc) };
        let (mut along, mut length) = (0.0, 0.0);
        for (s, segment) in disc.layout.segments.iter().enumerate() {
            for i in disc.y(s, 0)..disc.y(s, disc.intervals(s)) + segment.states {
                let step = s1.state[i] - before[i];
                along += (z[i] - s1.state[i]) * step;
                length += step * step;
            }
        }
        let t = if length > 0.0 { along / length } else { 0.0 };
        let t = if t.abs() <= FURTHEST { t } else { 0.0 };
        continue_field(&mut self.system, [s0.system(&self.model), s1.system(&self.model)], t);
    }

    /// Solves at a value of the control.
    pub(super) fn at(&mut self, c: f64) -> Result<Solution, Halt> {
        let (mut disc, mut z) = self.predict(c);
        self.foresee(&disc, &z);
        let of = &self.model.quantities[self.control].formula;
        self.system.closing = Closing::Value { of: of.clone(), target: c };
        state::solve(&self.model, &mut self.system, &mut disc, &mut z, &self.typical, &mut self.work)
    }

    /// True if a state lies so far from where it was predicted that it may belong to another branch.
    pub(super) fn jumps(&self, predicted: &(Arc<Discretization>, Vec<f64>), s: &Solution) -> bool {
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
    pub(super) fn accept(&mut self, solution: Solution, watch: bool) -> Result<(), Stop> {
        let a = self.last().clone();
        let change = self.change(&a, &solution)?;
        let end = change.as_ref().map_or(&solution, |c| &c.1);
        if !watch && let Some(stop) = self.stop_between(&a, end)? {
            self.meet(Some(&a), &stop);
            self.push(stop);
            return Err(Stop::Met);
        }
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
            self.push(solution);
            return Ok(());
        };
        let phi = self.joint_angle(&change, &at);
        let model = self.model.after(&change, phi).map_err(|_| Stop::Lost(change.of.clone()))?;
        if watch {
            self.happen(change.kind, change.of.clone(), model.stage(), at.clone());
            self.report(Reason::Event, None, at.clone());
        }
        self.enter(model, &at)
    }

    /// The state between two at which a stop of the file is met, if any.
    fn stop_between(&mut self, a: &Solution, b: &Solution) -> Result<Option<Solution>, Stop> {
        let model = self.model.clone();
        for (_, formula) in &model.branch.stops {
            let g = |s: &Solution| Some(on_slots(&model, formula, s));
            if on_slots(&model, formula, a) * on_slots(&model, formula, b) < 0.0 {
                return Ok(Some(self.between(a, b, g, 1e-15).ok_or(Stop::Astray)?));
            }
        }
        Ok(None)
    }

    /// Follows the branch from the last state to a value of the control, in as many steps as it takes.
    pub(super) fn go(&mut self, c: f64, watch: bool) -> Result<(), Stop> {
        let span = (c - self.value(self.last())).abs();
        let mut step = c - self.value(self.last());
        let onwards = step.signum();
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
                    // A contact that appears at a pole begins a little behind its event: `c` may lie in between.
                    let leapt = self.entered && (c - self.value(self.last())) * onwards < 0.0;
                    if same(self.value(self.last()), c) || leapt {
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
}

/// True if two values agree to within what counts as the same.
pub(super) fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}
