//! The documents for programs: the result of a run, the findings of a check. Their shape is versioned.

use super::{Report, reason, resolved};
use crate::diagnostic::{self, Diagnostic, Locate};
use crate::model::{Entry, Ledger, Model};
use crate::run::Rank;
use crate::run::{Event, Point, Status};
use crate::solution::{self, Solution};
use serde_json::{Map, Value, json};

/// Version of the result document.
pub const SCHEMA_VERSION: u32 = 1;

/// The result of a run, with the profiles of every state where they are asked for.
pub fn result(report: &Report, profiles: bool) -> Value {
    let outcome = report.outcome;
    let (status, message) = match &outcome.status {
        Status::Complete => ("complete", "everything that was asked for was solved"),
        Status::Incomplete(message) => ("incomplete", message.as_str()),
    };
    json!({
        "schema_version": SCHEMA_VERSION,
        "program": { "name": env!("CARGO_PKG_NAME"), "version": env!("CARGO_PKG_VERSION") },
        "problem": resolved(report.problem, report.model),
        "status": status,
        "message": message,
        "points": outcome.points.iter().map(|p| point(&p.model, p, profiles)).collect::<Vec<_>>(),
        "events": outcome.events.iter().map(|e| event(report.model, e)).collect::<Vec<_>>(),
    })
}

fn point(model: &Model, point: &Point, profiles: bool) -> Value {
    let solution = &point.solution;
    let proof = &solution.certificate;
    let error = errors(model, solution);
    let mut value = json!({
        "reason": reason(point.reason),
        "at": point.at.as_ref().map(|at| json!({ "name": at.name, "value": at.value })),
        "stage": model.stage(),
        "quantities": quantities(model, solution),
        "infinite": solution.infinite,
        "certificate": {
            "error": error,
            "first_integral": proof.first_integral,
            "force_balance": proof.force_balance,
            "virtual_work": proof.virtual_work,
            "identities": proof.identities,
            "admissible": proof.is_admissible(),
            "violations": proof.violations,
        },
        "work": {
            "newton_iterations": point.work.effort.iterations,
            "factorisations": point.work.effort.factorisations,
            "intervals": point.work.intervals,
            "cpu_seconds": point.work.cpu_seconds,
        },
    });
    if profiles {
        value["profiles"] = profile(model, solution);
    }
    value
}

/// The fields along the meridian.
pub(crate) fn profile(model: &Model, solution: &Solution) -> Value {
    let row = |r: solution::Row| {
        json!({
            "segment": r.segment, "phi": r.phi, "S": r.arc, "u": r.u, "h": r.h, "tau": r.tau,
            "lambda": r.lambda, "mu": r.mu, "w_l": r.w_l, "w_m": r.w_m, "p_c": r.p_c,
        })
    };
    solution::profile(model, solution).into_iter().map(row).collect()
}

fn event(model: &Model, event: &Event) -> Value {
    json!({
        "kind": event.kind,
        "of": event.of,
        "stage_before": event.stage_before,
        "stage_after": event.stage_after,
        "quantities": quantities(model, &event.solution),
    })
}

/// Parameters, unknowns and outputs by name. What is no finite number is left out.
pub(crate) fn quantities(model: &Model, solution: &Solution) -> Map<String, Value> {
    let given = model.parameters.iter().filter(|p| p.1.is_finite()).map(|p| (p.0.clone(), json!(p.1)));
    given.chain(numbers(model, solution, |q| q.value)).collect()
}

/// The estimated absolute error of each quantity.
pub(crate) fn errors(model: &Model, solution: &Solution) -> Map<String, Value> {
    numbers(model, solution, |q| q.error).collect()
}

/// A number of each quantity that has a finite one.
fn numbers<'a>(
    model: &'a Model,
    solution: &'a Solution,
    of: impl Fn(&solution::Measured) -> f64 + 'a,
) -> impl Iterator<Item = (String, Value)> + 'a {
    let value = move |m: &solution::Measured| Some(of(m)).filter(|v| v.is_finite());
    let named = model.quantities.iter().zip(&solution.quantities);
    named.filter_map(move |(q, m)| Some((q.name.clone(), json!(value(m.as_ref()?)?))))
}

/// What a check found in one file.
#[derive(Clone, Debug, Default)]
pub struct Finding {
    /// The file, as the user names it.
    pub file: String,
    /// Its diagnostics as objects.
    pub diagnostics: Vec<Value>,
    /// Its unknowns and conditions, where they could be counted.
    pub ledger: Ledger,
    /// Whether its conditions determine its unknowns.
    pub rank: Rank,
}

impl Finding {
    /// Adds complaints.
    pub fn complain(&mut self, diagnostics: &[Diagnostic], places: &dyn Locate) {
        self.diagnostics.extend(diagnostic::to_json(diagnostics, places));
    }

    fn ledger(&self) -> Value {
        let list = |entries: &[Entry], what: &str| -> Value {
            entries.iter().map(|e| json!({ "name": e.name, what: e.text, "origin": e.origin })).collect()
        };
        json!({
            "unknowns": list(&self.ledger.unknowns, "meaning"),
            "conditions": list(&self.ledger.conditions, "equation"),
        })
    }

    fn rank(&self) -> Value {
        let r = &self.rank;
        json!({ "deficiency": r.deficiency, "dependent": r.dependent, "free": r.free, "closing": r.closing, "neutral": r.neutral })
    }
}

/// What a check found: the diagnostics of all files, ledger and rank of the one file, or of each in `files` where there are
/// several.
pub fn check(findings: &[Finding]) -> Value {
    let diagnostics: Vec<&Value> = findings.iter().flat_map(|f| &f.diagnostics).collect();
    let one = |of: fn(&Finding) -> Value| match findings {
        [only] => of(only),
        _ => Value::Null,
    };
    let file =
        |f: &Finding| json!({ "file": f.file, "diagnostics": f.diagnostics, "ledger": f.ledger(), "rank": f.rank() });
    json!({
        "diagnostics": diagnostics,
        "ledger": one(Finding::ledger),
        "rank": one(Finding::rank),
        "files": findings.iter().map(file).collect::<Vec<_>>(),
    })
}
