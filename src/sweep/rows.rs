//! What a case of a sweep gives: a row for each of its states, and one that says how it ended.

use super::plan::{Case, Plan};
use crate::model::Model;
use crate::output::{document, reason, resolved};
use crate::run::{self, Event, Outcome, Point, Reason, Request, Status};
use crate::spec::Problem;
use serde::Serialize;
use serde_json::{Map, Value};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A sweep that is to be solved.
pub struct Job<'a> {
    /// Its cases.
    pub plan: &'a Plan,
    /// States asked for in each case, instead of the branch.
    requests: &'a [Request],
    /// True if rows hold the fields along the meridian.
    profiles: bool,
    /// What tells results of this sweep from those of others.
    problem: String,
}

impl<'a> Job<'a> {
    /// The sweep of a problem, by its plan.
    pub fn new(problem: &Problem, model: &Model, plan: &'a Plan, requests: &'a [Request], profiles: bool) -> Self {
        let problem = identity(problem, model, requests, profiles);
        Job { plan, requests, profiles, problem }
    }

    /// What tells results of this sweep, made by this version, from those of others: 16 hexadecimal digits.
    pub fn problem(&self) -> &str {
        &self.problem
    }

    /// Solves one case. Nothing if it was stopped before its end.
    pub fn solve(&self, index: usize, stopped: &dyn Fn() -> bool) -> Option<Rows> {
        let case = self.plan.case(index);
        // One case that meets a mistake of this program must not take the others with it.
        let solved = catch_unwind(AssertUnwindSafe(|| self.answer(&case, stopped)));
        let broken = || Some((vec![], "failed", "an internal error, which is a mistake of this program".into()));
        let (states, status, message) = solved.unwrap_or_else(|_| broken())?;
        let verdict = Verdict { kind: "case", status, message, states: states.len(), cases: self.plan.cases() };
        Some(Rows { case: index, set: case.set, states, verdict, problem: self.problem.clone() })
    }

    fn answer(&self, case: &Case, stopped: &dyn Fn() -> bool) -> Option<(Vec<State>, &'static str, String)> {
        let model = match case.resolve() {
            Ok(model) => model,
            Err(refused) => {
                let said: Vec<String> = refused.diagnostics.into_iter().map(|d| d.message).collect();
                return Some((vec![], "refused", said.join("; ")));
            }
        };
        let mut cut = false;
        let outcome = run::run(&model, self.requests, &mut |_, _| {
            cut = cut || stopped();
            if cut { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        if cut {
            return None;
        }
        let states = states(&outcome, self.profiles);
        Some(match outcome.status {
            Status::Complete => (states, "complete", "everything that was asked for was solved".into()),
            Status::Incomplete(message) => (states, "incomplete", message),
        })
    }
}

/// All that one case gives.
#[derive(Clone, Debug)]
pub struct Rows {
    /// The number of the case.
    pub case: usize,
    /// What is set in it.
    pub set: Map<String, Value>,
    /// Its states, in the order of the result of a run.
    pub states: Vec<State>,
    /// How it ended.
    pub verdict: Verdict,
    problem: String,
}

/// A row as it is written: it stands for itself.
#[derive(Debug, Serialize)]
struct Row<'a, T> {
    case: usize,
    set: &'a Map<String, Value>,
    #[serde(flatten)]
    said: &'a T,
    problem: &'a str,
}

/// A state of a case.
#[derive(Clone, Debug, Serialize)]
pub struct State {
    /// The kind of event, or else the reason why it is reported.
    pub kind: &'static str,
    /// The quantity or name that the event is about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// The request that it answers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<At>,
    /// The stage.
    pub stage: String,
    /// The stage before an event.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage_before: Option<String>,
    /// The stage after an event.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage_after: Option<String>,
    /// Parameters, unknowns and outputs.
    pub quantities: Map<String, Value>,
    /// The estimated absolute error of each that is not given.
    pub error: Map<String, Value>,
    /// What is infinite by nature.
    pub infinite: Vec<String>,
    /// As in a certificate, and so the next three.
    pub first_integral: f64,
    /// See there.
    pub force_balance: f64,
    /// See there.
    pub virtual_work: f64,
    /// See there.
    pub identities: f64,
    /// True if nothing is violated.
    pub admissible: bool,
    /// What is, and where.
    pub violations: Vec<String>,
    /// The fields along the meridian, where they are asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profiles: Option<Value>,
}

/// A request, as it is written.
#[derive(Clone, Debug, Serialize)]
pub struct At {
    name: String,
    value: f64,
}

/// How a case ended.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    kind: &'static str,
    /// `complete`; `incomplete`, where not all was solved; `refused`, where the problem of the case cannot be right; `failed`.
    pub status: &'static str,
    /// Why.
    pub message: String,
    /// How many rows were before this one.
    pub states: usize,
    /// How many cases the sweep has.
    pub cases: usize,
}

impl Verdict {
    /// The status of a case in which all was solved.
    pub(super) const COMPLETE: &'static str = "complete";
    /// The kind of the last row of a case.
    pub(super) const KIND: &'static str = "case";

    /// True if all was solved.
    pub fn is_complete(&self) -> bool {
        self.status == Self::COMPLETE
    }
}

impl Rows {
    /// The rows as lines of JSON, each of which stands for itself.
    pub fn lines(&self) -> String {
        let mut text = String::new();
        for state in &self.states {
            self.line(state, &mut text);
        }
        self.line(&self.verdict, &mut text);
        text
    }

    fn line<T: Serialize>(&self, said: &T, text: &mut String) {
        let row = Row { case: self.case, set: &self.set, said, problem: &self.problem };
        // Maps with names as keys, texts and numbers: there is nothing that JSON could not say.
        *text += &serde_json::to_string(&row).unwrap_or_default();
        text.push('\n');
    }
}

/// The states of an outcome, with what happened in them.
fn states(outcome: &Outcome, profiles: bool) -> Vec<State> {
    let mut events = outcome.events.iter();
    let of = |point: &Point| match point.reason {
        // Each event is reported as a state as well, in the same order.
        Reason::Fold | Reason::Event => events.next(),
        _ => None,
    };
    let events: Vec<Option<&Event>> = outcome.points.iter().map(of).collect();
    outcome.points.iter().zip(events).map(|(point, event)| state(point, event, profiles)).collect()
}

fn state(point: &Point, event: Option<&Event>, profiles: bool) -> State {
    let (model, solution) = (&point.model, &point.solution);
    let proof = &solution.certificate;
    State {
        kind: event.map_or(reason(point.reason), |e| e.kind),
        of: event.map(|e| e.of.clone()),
        at: point.at.as_ref().map(|at| At { name: at.name.clone(), value: at.value }),
        stage: model.stage(),
        stage_before: event.map(|e| e.stage_before.clone()),
        stage_after: event.map(|e| e.stage_after.clone()),
        quantities: document::quantities(model, solution),
        error: document::errors(model, solution),
        infinite: solution.infinite.clone(),
        first_integral: proof.first_integral,
        force_balance: proof.force_balance,
        virtual_work: proof.virtual_work,
        identities: proof.identities,
        admissible: proof.is_admissible(),
        violations: proof.violations.clone(),
        profiles: profiles.then(|| document::profile(model, solution)),
    }
}

/// A hash (FNV-1a, 64 bits) of all that rows depend on.
fn identity(problem: &Problem, model: &Model, requests: &[Request], profiles: bool) -> String {
    let mut problem = problem.clone();
    // What is written about it changes nothing.
    (problem.schema, problem.title, problem.about) = (None, String::new(), None);
    problem.expect.clear();
    problem.figures.clear();
    let text = format!("{} {} {requests:?} {profiles}", env!("CARGO_PKG_VERSION"), resolved(&problem, model));
    let hash = text
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |h, byte| (h ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
    format!("{hash:016x}")
}
