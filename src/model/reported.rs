//! What is reported and compared, and what is known besides: quantities, expectations, unknowns that nothing uses, conditions of
//! the catalogue that the file does not have.

use super::names::Names;
use super::set::{is_setting, unknown};
use super::token;
use crate::diagnostic::Diagnostic;
use crate::spec::{Number, Problem};
use crate::system::{Formula, System};

/// A named number that is reported.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// Its name in the result.
    pub name: String,
    /// How it is computed.
    pub formula: Formula,
}

/// An expected value of independent origin.
#[derive(Clone, Debug)]
pub struct Expectation {
    /// Settings under which it holds, as `--set` takes them.
    pub set: Vec<(String, String)>,
    /// The state: a quantity and its value; nothing means the only state.
    pub at: Option<(String, f64)>,
    /// Quantity and expected value.
    pub values: Vec<(String, f64)>,
    /// Relative tolerance.
    pub relative: f64,
    /// Where the values come from.
    pub source: String,
    /// True where a converged solution must *not* reproduce them.
    pub refuted: bool,
}

/// Everything that is reported besides the parameters: unknowns, the pressure of the fluid, outputs, the initial state.
pub(super) fn quantities(
    problem: &Problem,
    names: &mut Names,
    system: &System,
    errors: &mut Vec<Diagnostic>,
) -> Vec<Quantity> {
    let mut list = vec![];
    let mut add = |list: &mut Vec<Quantity>, name: &str, text: &str, pointer: String, errors: &mut Vec<Diagnostic>| {
        if list.iter().any(|q: &Quantity| q.name == name) {
            return;
        }
        if let Some(formula) = names.formula(system, text, &pointer, false, errors) {
            list.push(Quantity { name: name.to_owned(), formula });
        }
    };
    for name in problem.unknowns.keys() {
        add(&mut list, name, name, format!("/unknowns/{}", token(name)), errors);
    }
    if problem.fluid.is_some() {
        add(&mut list, "p_f", "p_f", "/fluid".into(), errors);
    }
    for (name, number) in &problem.outputs {
        let text = match number {
            Number::Value(v) => format!("{v}"),
            Number::Formula(f) => f.clone(),
        };
        add(&mut list, name, &text, format!("/outputs/{}", token(name)), errors);
    }
    for (name, text) in [("P_i", "initial.w_l"), ("lambda_i", "initial.lambda"), ("p_f0", "initial.overpressure")] {
        if !problem.outputs.contains_key(name) && !problem.parameters.contains_key(name) {
            add(&mut list, name, text, String::new(), errors);
        }
    }
    list
}

/// Unknowns that nothing depends on.
pub(super) fn unused(problem: &Problem, names: &Names, errors: &mut Vec<Diagnostic>) {
    for name in problem.unknowns.keys() {
        if !names.used.contains(name.as_str()) {
            errors.push(
                Diagnostic::error("unused-unknown", format!("no condition depends on the unknown `{name}`"))
                    .at_key(format!("/unknowns/{}", token(name)), "used nowhere, so nothing can determine it"),
            );
        }
    }
}

/// The values that the file names as known.
pub(super) fn expectations(problem: &Problem, names: &Names, errors: &mut Vec<Diagnostic>) -> Vec<Expectation> {
    let mut list = vec![];
    for (i, e) in problem.expect.iter().enumerate() {
        let pointer = format!("/expect/{i}");
        for key in e.set.keys().filter(|key| !is_setting(problem, key)) {
            let d = unknown(problem, key, "", "a state where it has a value is named in `at`");
            errors.push(d.at_key(format!("{pointer}/set/{}", token(key)), "nothing of this name can be set"));
        }
        let mut at = vec![];
        for (name, number) in &e.at {
            if let Some(v) = names.constant(number, &format!("{pointer}/at/{}", token(name)), errors) {
                at.push((name.clone(), v));
            }
        }
        if at.len() > 1 {
            errors.push(
                Diagnostic::error("expect-at", "an expectation names one quantity in `at`; parameters belong in `set`")
                    .at(format!("{pointer}/at"), "more than one"),
            );
        }
        let mut values = vec![];
        for (name, number) in &e.values {
            let known = problem.outputs.contains_key(name) || problem.unknowns.contains_key(name) || name == "p_f";
            if !known {
                errors.push(
                    Diagnostic::error("unknown-name", format!("`{name}` is not a reported quantity"))
                        .at_key(format!("{pointer}/values/{}", token(name)), "no output or unknown has this name"),
                );
            }
            if let Some(v) = names.constant(number, &format!("{pointer}/values/{}", token(name)), errors) {
                values.push((name.clone(), v));
            }
        }
        let set = e.set.iter().map(|(k, v)| (k.clone(), v.to_string())).collect();
        list.push(Expectation {
            set,
            at: at.into_iter().next(),
            values,
            relative: e.relative.get(),
            source: e.source.clone(),
            refuted: e.refuted.is_some(),
        });
    }
    list
}

/// Conditions of the catalogue at the joints that have names, and what fixes the membrane on the axis.
pub(super) fn known_conditions(names: &mut Names, system: &System) -> Vec<(String, Formula)> {
    let mut texts = vec![];
    for joint in &names.joints {
        let j = &joint.name;
        let sides = |field: &str| format!("{j}.before.{field} = {j}.after.{field}");
        texts.push((
            format!("{j}: frictionless edge (lambda w_l - w continuous)"),
            format!("{j}.before.lambda*{j}.before.w_l - {j}.before.w = {j}.after.lambda*{j}.after.w_l - {j}.after.w"),
        ));
        for field in ["lambda", "w_l", "u", "tau"] {
            texts.push((format!("{j}: {field} continuous"), sides(field)));
        }
        texts.push((format!("{j}: material place given"), format!("{j}.phi = 0")));
        texts.push((format!("{j}: axial position given"), format!("{j}.after.h = 0")));
    }
    texts.push(("axial position of the membrane given".to_owned(), "membrane.start.h = 0".to_owned()));
    let mut found = vec![];
    for (name, text) in texts {
        if let Some(f) = names.equation(system, &text, "", true, &mut vec![]) {
            found.push((name, f));
        }
    }
    found
}
