//! From a file, `--set` and `--sweep` to a model, with everything that is wrong on the way; `--at`.

use super::{Exit, Input, Language, complain};
use membrane::diagnostic::{Complaints, Diagnostic, Locate, Place, suggest};
use membrane::expr;
use membrane::model::{self, Ledger, Model};
use membrane::run::Request;
use membrane::spec::{Document, Origin, Source, Syntax};
use membrane::sweep::{self, Plan};

/// Complaints, each with the texts it is about.
#[derive(Default)]
pub struct Refusals {
    /// The complaints.
    pub list: Vec<Complaints>,
    /// Unknowns and conditions, where they could be counted.
    pub ledger: Ledger,
}

impl From<Vec<Complaints>> for Refusals {
    fn from(list: Vec<Complaints>) -> Refusals {
        Refusals { list, ledger: Ledger::default() }
    }
}

impl Refusals {
    /// Shows them all.
    pub fn report(&self) -> Exit {
        for (places, diagnostics) in &self.list {
            complain(diagnostics, &**places);
        }
        Exit::Refused
    }
}

/// A problem that was read and is right.
pub struct Understood {
    /// With what is set from outside.
    pub document: Document,
    /// What it means.
    pub model: Model,
    /// The cases of its sweep, if it has one.
    pub plan: Option<Plan>,
}

/// Reads a file, applies what is set in its order, and resolves it.
pub fn understand(file: &str, input: &Input) -> Result<Understood, Refusals> {
    let mut document = Document::load(file, input.from.map(Language::syntax)).map_err(|rejected| {
        let diagnostics = rejected.diagnostics.clone();
        Refusals::from(vec![(rejected as Box<dyn Locate>, diagnostics)])
    })?;
    let mut refusals = Refusals::default();
    for (key, value) in &input.sets {
        match model::set(&document, key, value) {
            Ok(changed) => document = changed,
            Err(refusal) => refusals.list.push(refusal),
        }
    }
    if !input.sweeps.is_empty() {
        match sweep::option(&document, &input.sweeps) {
            Ok(changed) => document = changed,
            Err(refused) => refusals.list.extend(refused),
        }
    }
    // What could be set is examined also where something else could not.
    let (resolved, plan) = (model::resolve(&document.problem), Plan::new(&document.problem));
    match (resolved, plan) {
        (Ok(model), Ok(plan)) if refusals.list.is_empty() => return Ok(Understood { document, model, plan }),
        (resolved, plan) => {
            let mut wrong = plan.err().unwrap_or_default();
            if let Err(refused) = resolved {
                wrong.extend(refused.diagnostics);
                refusals.ledger = refused.ledger;
            }
            if !wrong.is_empty() {
                refusals.list.push((Box::new(document), wrong));
            }
        }
    }
    Err(refusals)
}

/// The states that are asked for by `--at`.
pub fn requests(model: &Model, at: &[(String, String)]) -> Result<Vec<Request>, Refusals> {
    let mut refusals = Refusals::default();
    let mut requests = vec![];
    for (name, value) in at {
        let known = name_of_quantity(model, name);
        let number = expr::constant(value);
        // The option as it was written is the text that complaints show.
        let text = format!("{name}={value}");
        let mut wrong = vec![];
        wrong.extend(known.err().map(|d| d.label(Place::Bytes(0..name.len()), "")));
        if let Err(error) = &number {
            let error = error.clone().shifted(name.len() + 1);
            let help = error.help.unwrap_or_else(|| "a number, such as 0.5".into());
            wrong.push(Diagnostic::error(error.code, error.message).label(Place::Bytes(error.span), "").help(help));
        }
        if !wrong.is_empty() {
            let origin = Origin::new(Source { name: "--at".into(), text, syntax: Syntax::Ron });
            refusals.list.push((Box::new(origin), wrong));
        } else if let Ok(value) = number {
            requests.push(Request { name: name.clone(), value });
        }
    }
    if refusals.list.is_empty() { Ok(requests) } else { Err(refusals) }
}

fn name_of_quantity(model: &Model, name: &str) -> Result<(), Diagnostic> {
    if model.quantity(name).is_some() {
        return Ok(());
    }
    if model.parameters.iter().any(|p| p.0 == name) {
        let message = format!("`{name}` is a parameter, which has the same value in every state");
        return Err(Diagnostic::error("parameter-asked", message)
            .help(format!("to change it, use `--set {name}=..`; --at asks for states where a quantity has a value")));
    }
    let names = model.quantities.iter().map(|q| q.name.as_str());
    Err(Diagnostic::error("unknown-name", format!("there is no quantity `{name}` in this problem"))
        .help(suggest(name, names)))
}
