//! `--set KEY=VALUE`: a change of the file before it is understood.

use super::token;
use crate::diagnostic::{Complaints, Diagnostic, Locate};
use crate::expr::{self, nearest};
use crate::spec::{Document, Number, Problem, Source, Syntax};

/// The document with `key` set to `value`: a parameter (a number or formula, in the unit in which the file writes the
/// parameter), or a top-level key, whose value is RON.
///
/// # Errors
/// An unknown key, with the list of those that exist; a value that cannot be read; what the file is missing with it. The
/// document returned with them can show their places.
pub fn set(document: &Document, key: &str, value: &str) -> Result<Document, Complaints> {
    let problem = &document.problem;
    let name = format!("--set {key}");
    let source = |text: String| Source { name: name.clone(), text, syntax: Syntax::Ron };
    let rejected = |r: Box<crate::spec::Rejected>| {
        let diagnostics = r.diagnostics.clone();
        (r as Box<dyn Locate>, diagnostics)
    };
    let refuse = |d: Diagnostic| Err((Box::new(document.clone()) as Box<dyn Locate>, vec![d]));
    if let Some(old) = problem.parameters.get(key) {
        let unit = written_unit(old);
        let parsed = match expr::parse(value) {
            Ok(parsed) => parsed,
            Err(e) => {
                let d = Diagnostic::error(e.code, format!("--set {key}={value}: {}", e.message));
                return refuse(d.help(e.help.unwrap_or_default()));
            }
        };
        let text = match (parsed.literal(), unit) {
            (Some((v, None)), None) => format!("{v}"),
            (Some((v, None)), Some(unit)) => format!("\"{v}[{unit}]\""),
            (_, Some(unit)) if parsed.units().is_empty() => format!("\"({value})*1[{unit}]\""),
            _ => format!("{value:?}"),
        };
        return document.replace(&format!("/parameters/{}", token(key)), source(text)).map_err(rejected);
    }
    if ROOT_KEYS.contains(&key) {
        return document.replace(&format!("/{key}"), source(value.to_owned())).map_err(rejected);
    }
    let asked = format!("states where it has a value are asked for with --at {key}={value}");
    refuse(unknown(problem, key, "--set: ", &asked))
}

/// True if a setting of this name exists.
pub(super) fn is_setting(problem: &Problem, key: &str) -> bool {
    problem.parameters.contains_key(key) || ROOT_KEYS.contains(&key)
}

/// The complaint about a setting that does not exist, with those that do; `asked` says how an unknown is given a value.
pub(super) fn unknown(problem: &Problem, key: &str, by: &str, asked: &str) -> Diagnostic {
    let parameters: Vec<&str> = problem.parameters.keys().map(String::as_str).collect();
    let mut d = Diagnostic::error("unknown-key", format!("{by}there is no parameter or top-level key `{key}`"));
    if let Some(near) = nearest(key, parameters.iter().copied().chain(ROOT_KEYS)) {
        d = d.help(format!("did you mean `{near}`?"));
    }
    if problem.unknowns.contains_key(key) {
        d = d.help(format!("`{key}` is an unknown: {asked}"));
    }
    d.help(format!("parameters: {}", parameters.join(", "))).help(format!("top-level keys: {}", ROOT_KEYS.join(", ")))
}

/// The unit in which a parameter is written, if it is written with one.
fn written_unit(number: &Number) -> Option<String> {
    let parsed = expr::parse(number.formula()?).ok()?;
    parsed.units().first().map(|unit| unit.text.clone())
}

/// A value in the unit in which a parameter is written.
pub fn in_unit_of(parameter: &Number, value: f64) -> Number {
    match written_unit(parameter) {
        Some(unit) => Number::Formula(format!("{value}[{unit}]")),
        None => Number::Value(value),
    }
}

/// The top-level keys that can be set.
const ROOT_KEYS: [&str; 23] = [
    "title",
    "about",
    "units",
    "parameters",
    "unknowns",
    "definitions",
    "reference",
    "material",
    "wrinkling",
    "initial",
    "fluid",
    "tractions",
    "bodies",
    "contact",
    "meridian",
    "constraints",
    "branch",
    "sweep",
    "outputs",
    "accuracy",
    "figures",
    "identities",
    "expect",
];
