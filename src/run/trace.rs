//! Following a branch through the states that were asked for.

use super::start;
use super::state::{self, Halt, Work};
use crate::bvp::Discretization;
use crate::model::Model;
use crate::solution::Solution;
use crate::system::{Closing, System};
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

/// The smallest step, relative to the span of the branch, before a branch is given up.
const LEAST_STEP: f64 = 1e-7;

/// Processor time of this thread in seconds.
fn cpu_seconds() -> f64 {
    crate::run::clock::thread_seconds()
}

struct Tracer<'m> {
    model: &'m Model,
    system: System,
    /// The last states, newest last, with their value of the control.
    history: Vec<(f64, Solution)>,
    control: usize,
}

impl Tracer<'_> {
    fn last(&self) -> &(f64, Solution) {
        self.history.last().expect("a first state")
    }

    fn push(&mut self, solution: Solution) {
        let c = solution.quantity(self.control).expect("the control is a number").value;
        if self.history.len() > 1 {
            self.history.remove(0);
        }
        self.history.push((c, solution));
    }

    /// The state predicted at a value of the control, on the newest mesh: cubic Hermite extrapolation from two states with their
    /// tangents, or the tangent of one.
    fn predict(&self, c: f64) -> (Arc<Discretization>, Vec<f64>) {
        let (c1, s1) = self.last();
        let disc = s1.disc.clone();
        let slope = |s: &Solution| s.quantity(self.control).map_or(1.0, |q| q.slope);
        let d = c - c1;
        let (k1, t1) = (slope(s1), &s1.tangent);
        let usable = self.history.len() > 1 && {
            let (c0, _) = self.history[0];
            (c1 - c0) * d > 0.0 && d.abs() <= 3.0 * (c1 - c0).abs()
        };
        if !usable {
            let z = s1.state.iter().zip(t1).map(|(z, t)| z + d * t / k1).collect();
            return (disc, z);
        }
        let (c0, s0) = &self.history[0];
        let same = s0.disc.meshes == disc.meshes;
        let carry = |v: &[f64]| if same { v.to_vec() } else { s0.disc.transfer(v, &disc) };
        let (z0, t0, k0) = (carry(&s0.state), carry(&s0.tangent), slope(s0));
        let h = c1 - c0;
        let t = d / h; // beyond the newest state
        // Hermite basis on [c0, c1] at 1 + t, differences taken from the newest state.
        let (h00, h10, h11) = ((1.0 + 2.0 * (1.0 + t)) * t * t, (1.0 + t) * t * t, (1.0 + t) * (1.0 + t) * t);
        let z = (0..disc.unknowns())
            .map(|i| s1.state[i] + h00 * (z0[i] - s1.state[i]) + h * (h10 * t0[i] / k0 + h11 * t1[i] / k1))
            .collect();
        (disc, z)
    }

    /// Solves at a value of the control.
    fn at(&mut self, c: f64, work: &mut Work) -> Result<Solution, Halt> {
        let (mut disc, mut z) = self.predict(c);
        if let Closing::Value { target, .. } = &mut self.system.closing {
            *target = c;
        }
        state::solve(self.model, &self.system, &mut disc, &mut z, work)
    }

    /// Follows the branch from the last state to a value of the control, in as many steps as it takes.
    fn go(&mut self, c: f64, work: &mut Work) -> Result<(), Halt> {
        let span = (c - self.last().0).abs().max(1e-12 * c.abs());
        let mut step = c - self.last().0;
        loop {
            let here = self.last().0;
            let left = c - here;
            if left == 0.0 {
                return Ok(());
            }
            let target = if step.abs() >= 0.999 * left.abs() { c } else { here + step };
            match self.at(target, work) {
                Ok(solution) => {
                    self.push(solution);
                    if target == c {
                        return Ok(());
                    }
                    step *= 2.0;
                }
                Err(halt) => {
                    step = 0.3 * (target - here);
                    if step.abs() < LEAST_STEP * span {
                        return Err(halt);
                    }
                }
            }
        }
    }
}

/// Runs a model: the branch of its file, or the requested states only.
pub fn run(model: &Model, requests: &[Request], progress: &mut dyn FnMut(usize, usize) -> std::ops::ControlFlow<()>) -> Outcome {
    let mut outcome = Outcome { points: vec![], events: vec![], status: Status::Complete };
    let control = model
        .quantities
        .iter()
        .position(|q| q.name == model.branch.control)
        .expect("the control is a quantity of the model");
    let mut begun = cpu_seconds();
    let mut work = Work::default();
    let first = match start::first(model, &mut work) {
        Ok(first) => first,
        Err(halt) => {
            outcome.status = Status::Incomplete(format!("no first state was found: {halt}"));
            return outcome;
        }
    };
    let mut tracer = Tracer { model, system: model.system.clone(), history: vec![], control };
    // The first state was closed by something else; its tangent is of no use for the branch.
    let c = first.quantity(control).expect("the control is a number").value;
    tracer.push(first);
    if let Closing::Value { target, .. } = &mut tracer.system.closing {
        *target = c;
    }
    {
        let (_, s) = tracer.last();
        let (mut disc, mut z) = (s.disc.clone(), s.state.clone());
        match state::solve(model, &tracer.system, &mut disc, &mut z, &mut work) {
            Ok(s) => {
                tracer.history.clear();
                tracer.push(s);
            }
            Err(halt) => {
                outcome.status = Status::Incomplete(format!("no first state was found: {halt}"));
                return outcome;
            }
        }
    }
    let direct: Vec<f64> = requests.iter().map(|r| r.value).collect();
    let targets = if requests.is_empty() { &model.branch.targets } else { &direct };
    let total = targets.len();
    for (i, &c) in targets.iter().enumerate() {
        if progress(i, total).is_break() {
            outcome.status = Status::Incomplete("interrupted".into());
            break;
        }
        match tracer.go(c, &mut work) {
            Ok(()) => {
                let now = cpu_seconds();
                work.cpu_seconds = now - begun;
                begun = now;
                outcome.points.push(Point {
                    reason: if requests.is_empty() { Reason::Step } else { Reason::At },
                    at: requests.get(i).cloned(),
                    solution: tracer.last().1.clone(),
                    work,
                });
                work = Work::default();
            }
            Err(halt) => {
                let (name, value) = (&model.branch.control, tracer.last().0);
                outcome.status =
                    Status::Incomplete(format!("the branch could not be followed beyond {name} = {value}: {halt}"));
                break;
            }
        }
    }
    outcome
}
