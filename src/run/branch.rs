//! What is asked of a branch: the states of the file, or those in which quantities have given values.

use super::clock::thread_seconds;
use super::outcome::{Outcome, Point, Reason, Request, Status};
use super::start;
use super::state::{Halt, Work};
use super::trace::{Asked, Stop, Tracer, same};
use crate::model::{Model, Steps};
use crate::number::plain;
use crate::physics::material::Energy;
use crate::solution::{Measured, Solution};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Turns of the control on one branch.
const MOST_TURNS: usize = 20;
/// Accuracy of states that only lead to others, where they are dear.
const APPROACH: f64 = 1e-5;
/// What is said of a run that was stopped.
const INTERRUPTED: &str = "interrupted";

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

/// A stiffness relative to the tension, lambda w_ll/w_l, below which the end of a branch is put down to the material.
const SOFT: f64 = 0.2;

/// The model with the accuracy that states need which only lead to others: as it is, or less where the membrane repels itself.
fn approach(model: &Arc<Model>) -> Arc<Model> {
    if model.system.repels() && model.accuracy < APPROACH {
        return Arc::new(Model { accuracy: APPROACH, ..Model::clone(model) });
    }
    model.clone()
}

impl Tracer {
    /// The first state, ready to be continued in the control. It is not reported, and need not be accurate where states are dear.
    fn begin(&mut self) -> Result<(), String> {
        let exact = self.model.clone();
        self.model = approach(&exact);
        let result = self.begin_with();
        self.model = exact;
        result
    }

    fn begin_with(&mut self) -> Result<(), String> {
        let first =
            start::first(&self.model, &mut self.work).map_err(|halt| format!("no first state was found: {halt}"))?;
        // It was closed by something else than the control.
        let c = self.value(&first);
        self.history.push(first);
        let again = self.at(c).map_err(|halt| format!("no first state was found: {halt}"))?;
        self.history = vec![again];
        Ok(())
    }

    /// From the first state to the first value of the control. The states between are reported where `watch`.
    fn go_first(&mut self, c: f64, watch: bool) -> Result<(), Stop> {
        let exact = self.model.clone();
        if watch || approach(&exact).accuracy == exact.accuracy {
            return self.go(c, watch);
        }
        self.model = approach(&exact);
        let reached = self.go(c, false);
        if self.model.presence == exact.presence {
            self.model = exact;
        }
        reached?;
        let again = self.at(c).map_err(Stop::Halt)?;
        self.history = vec![again];
        Ok(())
    }

    /// The initial state, or where a condition of the file holds another one at its value of the control, such as an edge that is stuck at
    /// a material point of its own: that one.
    fn begun(&self, initial: Solution) -> Solution {
        let first = self.last();
        let differ = |(a, b): (&Option<Measured>, &Option<Measured>)| {
            a.zip(*b).is_some_and(|(a, b)| (a.value - b.value).abs() > 1e3 * (a.error + b.error) + 1e-6 * a.value.abs())
        };
        let other = same(self.value(first), self.value(&initial))
            && initial.quantities.iter().zip(&first.quantities).any(differ);
        if other { first.clone() } else { initial }
    }

    /// The branch of the file.
    pub(super) fn branch(&mut self, progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> Result<(), String> {
        let initial = start::initial(&self.model);
        let c0 = self.value(&initial);
        let targets = self.model.branch.steps.targets(c0);
        let loaded = !self.model.touches();
        self.begin()?;
        let initial = self.begun(initial);
        if loaded && !self.model.branch.steps.has_first() {
            self.report(Reason::Start, None, initial.clone());
        }
        if loaded && same(targets[0], c0) {
            self.report(Reason::Step, None, initial);
        } else {
            // To the first value: the first state may lie on either side of it, and is not part of the branch asked for.
            match self.go_first(targets[0], loaded) {
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
                let (control, goal) = (&self.model.branch.control, plain(targets[targets.len() - 1]));
                Err(format!(
                    "{control} = {goal} is not reached: the control turns back, and the branch leaves its range"
                ))
            }
            Err(message) => Err(message),
        }
    }

    pub(super) fn report_last(&mut self, end: bool) {
        let solution = self.last().clone();
        self.report(if end { Reason::End } else { Reason::Step }, None, solution);
    }

    /// Walks from value to value of the control, in the direction of the list; where the control turns, on through the values on the
    /// other side. True when the last value or a stop of the file is reached, false when the branch leaves the list at its
    /// beginning.
    pub(super) fn walk(
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
    pub(super) fn return_to(&mut self, first: &Solution, model: &Arc<Model>) {
        self.model = model.clone();
        self.system = model.system.clone();
        self.history = vec![first.clone()];
        self.entered = false;
    }

    /// Why a walk ended.
    pub(super) fn stopped(&self, stop: &Stop) -> String {
        let (control, c) = (&self.model.branch.control, plain(self.value(self.last())));
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

    pub(super) fn lost(&self, halt: &Halt) -> String {
        let c = plain(self.value(self.last()));
        let mut message =
            format!("the branch could not be followed beyond {} = {c}: {halt}", self.model.branch.control);
        if self.model.system.law.locking().is_some() {
            message += "; a material that locks allows no state beyond some load";
        }
        if let Some((stiffness, segment)) = self.last().softest(&self.model).filter(|(s, _)| *s < SOFT) {
            message += &format!(
                "; the material has nearly lost its stiffness on `{segment}`, where lambda w_ll/w_l is down to {stiffness:.1e}: an \
                 energy that grows so slowly, or is not convex, allows no state beyond some load"
            );
        }
        let violations = &self.last().certificate.violations;
        if !violations.is_empty() {
            message += &format!("; the last state is inadmissible: {}", violations.join(", "));
        }
        message
    }

    /// Requested states.
    pub(super) fn requests(
        &mut self,
        requests: &[Request],
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<(), String> {
        let initial = start::initial(&self.model);
        let c0 = self.value(&initial);
        let loaded = !self.model.touches();
        self.begin()?;
        let initial = self.begun(initial);
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
                    Ok(()) if !same(self.value(self.last()), requests[i].value) => {
                        let (control, value) = (&self.model.branch.control, requests[i].value);
                        let here = plain(self.value(self.last()));
                        missing.push(format!("{control} = {value} is not reached: a contact appears there; the first state with it has {control} = {here}"));
                    }
                    Ok(()) => {
                        let solution = self.last().clone();
                        self.report(Reason::At, Some(requests[i].clone()), solution);
                        answers[i].extend(self.outcome.points.pop());
                    }
                    // The end itself is a state of the branch.
                    Err(Stop::Met) if same(self.value(self.last()), requests[i].value) => {
                        let solution = self.last().clone();
                        self.report(Reason::At, Some(requests[i].clone()), solution);
                        answers[i].extend(self.outcome.points.pop());
                        self.return_to(&first, &begun);
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
                let reached = self.go_first(targets[0], false);
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
                        "{} = {} is never met: on this branch it runs from {} to {}",
                        r.name,
                        r.value,
                        plain(low),
                        plain(high)
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
}
