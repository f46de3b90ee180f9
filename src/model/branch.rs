//! The branch that is asked for: its control, the values at which states are reported, limit points and stops.
//!
//! The branch brings the last condition of the count: the control has a given value. While the solver follows the branch it puts
//! arclength in its place.

use super::ledger::Ledger;
use super::names::Names;
use super::{Initial, token};
use crate::diagnostic::Diagnostic;
use crate::expr::nearest;
use crate::spec::{self, Number, Problem};
use crate::system::{Closing, Formula, System};

/// The branch that is asked for.
#[derive(Clone, Debug)]
pub struct Branch {
    /// Name of the control.
    pub control: String,
    /// The values of the control at which states are reported.
    pub steps: Steps,
    /// Quantities whose limit points are located.
    pub limit_points: Vec<String>,
    /// Named stops: lhs - rhs = 0.
    pub stops: Vec<(String, Formula)>,
}

/// Values of the control, in order.
#[derive(Clone, Debug, PartialEq)]
pub enum Steps {
    /// As listed.
    Listed(Vec<f64>),
    /// Equally spaced.
    Spaced {
        /// The first state reported; without it the initial state is reported and the steps follow.
        from: Option<f64>,
        /// The last one.
        to: f64,
        /// How many are reported, `from` and `to` included, the initial state not.
        count: usize,
        /// Equal ratios instead of equal differences.
        log: bool,
    },
    /// Growing without a last one: until a stop, or as far as states exist.
    Open {
        /// The first state reported, if not the initial one.
        from: Option<f64>,
        /// The difference between two.
        step: f64,
    },
}

/// Values of the control at most, where no last one is given.
const MOST_STEPS: usize = 2000;

impl Steps {
    /// True if the first state reported is given, rather than the initial state.
    pub fn has_first(&self) -> bool {
        matches!(self, Steps::Spaced { from: Some(_), .. } | Steps::Open { from: Some(_), .. } | Steps::Listed(_))
    }

    /// The values, given the control in the initial state.
    pub fn targets(&self, start: f64) -> Vec<f64> {
        match *self {
            Steps::Listed(ref list) => list.clone(),
            Steps::Open { from, step } => {
                let first = from.unwrap_or(start + step);
                (0..MOST_STEPS).map(|i| first + step * i as f64).collect()
            }
            Steps::Spaced { from, to, count, log } => {
                let (first, skip) = match from {
                    Some(from) => (from, 0),
                    None => (start, 1),
                };
                let last = count + skip - 1;
                (skip..=last)
                    .map(|i| match i as f64 / last.max(1) as f64 {
                        _ if i == last => to,
                        t if log => first * (to / first).powf(t),
                        t => first + (to - first) * t,
                    })
                    .collect()
            }
        }
    }
}

/// Reads the branch, and adds its condition.
pub(super) fn branch(
    problem: &Problem,
    names: &mut Names,
    initial: &Initial,
    system: &mut System,
    ledger: &mut Ledger,
    errors: &mut Vec<Diagnostic>,
) -> Option<Branch> {
    let Some(said) = &problem.branch else {
        // One state: nothing moves. The last condition must then come from the file.
        errors.push(
            Diagnostic::error("no-branch", "the file does not say which branch of states is asked for")
                .at("", "no `branch` in this problem")
                .help("name the unknown or output that moves: branch: (control: \"..\", from: .., to: .., steps: ..)"),
        );
        return None;
    };
    let control = said.control.as_str();
    let pointer = "/branch/control";
    if problem.parameters.contains_key(control) {
        errors.push(
            Diagnostic::error("control-is-given", format!("the control `{control}` is a parameter, which is given"))
                .at(pointer, "given, so it cannot be found")
                .at_key(format!("/parameters/{}", token(control)), "declared as a parameter here")
                .help(format!(
                    "declare it among the unknowns with its initial value: unknowns: {{ \"{control}\": .. }}"
                )),
        );
        return None;
    }
    if !problem.unknowns.contains_key(control) && !problem.outputs.contains_key(control) && control != "p_f" {
        let known: Vec<&str> = problem.unknowns.keys().chain(problem.outputs.keys()).map(String::as_str).collect();
        let mut d =
            Diagnostic::error("unknown-name", format!("the control `{control}` is neither an unknown nor an output"))
                .at(pointer, "no unknown or output has this name");
        if let Some(near) = nearest(control, known.iter().copied()) {
            d = d.help(format!("did you mean `{near}`?"));
        }
        errors.push(d.help(format!("unknowns and outputs: {}", known.join(", "))));
        return None;
    }
    let of = names.formula(system, control, pointer, true, errors)?;
    if of.slots().is_empty() {
        errors.push(
            Diagnostic::error("control-is-constant", format!("the control `{control}` is the same in every state"))
                .at(pointer, "changes nothing"),
        );
        return None;
    }
    ledger.condition(format!("branch: {control}"), format!("{control} = given"), "branch".into());
    let mut constant = |number: &Option<Number>, key: &str| -> Option<f64> {
        number.as_ref().and_then(|n| names.constant(n, &format!("/branch/{key}"), errors))
    };
    let (from, to) = (constant(&said.from, "from"), constant(&said.to, "to"));
    let count = said.steps.map_or(20, |s| s.get());
    let log = said.spacing == spec::Spacing::Log;
    let steps = if let Some(at) = &said.at {
        if said.from.is_some() || said.to.is_some() || said.steps.is_some() {
            errors.push(
                Diagnostic::error("branch-at", "a branch has either a list `at` or `from`, `to` and `steps`")
                    .at("/branch", "both are given"),
            );
        }
        let values = at.iter().enumerate();
        Steps::Listed(values.filter_map(|(i, n)| names.constant(n, &format!("/branch/at/{i}"), errors)).collect())
    } else if let Some(to) = to {
        if log && !from.or(names.initial_value(control, initial)).is_some_and(|first| first * to > 0.0) {
            errors.push(
                Diagnostic::error(
                    "log-spacing",
                    "logarithmic spacing needs `from` and `to` of the same sign, not zero",
                )
                .at("/branch/spacing", "not possible here"),
            );
        }
        Steps::Spaced { from, to, count, log }
    } else {
        // The control grows until a stop, or as far as states exist; `steps` of them span five times the size of the initial shape.
        Steps::Open { from, step: 10.0 * initial.radius / count as f64 }
    };
    let mut stops = vec![];
    for (name, equation) in &said.stops {
        let pointer = format!("/branch/stops/{}", token(name));
        if let Some(f) = names.equation(system, equation.as_str(), &pointer, false, errors) {
            stops.push((name.clone(), f));
        }
    }
    let mut limit_points = vec![];
    for (i, name) in said.limit_points.iter().enumerate() {
        let name = name.as_str();
        if problem.unknowns.contains_key(name) || problem.outputs.contains_key(name) || name == "p_f" {
            limit_points.push(name.to_owned());
        } else {
            let known: Vec<&str> = problem.unknowns.keys().chain(problem.outputs.keys()).map(String::as_str).collect();
            errors.push(
                Diagnostic::error("unknown-name", format!("`{name}` is neither an unknown nor an output"))
                    .at(format!("/branch/limit_points/{i}"), "no quantity has this name")
                    .help(format!("unknowns and outputs: {}", known.join(", "))),
            );
        }
    }
    system.closing = Closing::Value { of, target: 0.0 };
    Some(Branch { control: control.to_owned(), steps, limit_points, stops })
}
