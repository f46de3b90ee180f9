//! Problem files, solved for tests.
#![allow(dead_code)] // each test uses a part of it

pub mod program;

use membrane::diagnostic::render;
use membrane::model::{self, Model};
use membrane::run::{self, Outcome, Request};
use membrane::spec::{Document, Source, Syntax};
use std::ops::ControlFlow;
use std::path::Path;

/// The shipped problem files, in the order of their names.
pub fn shipped() -> Vec<String> {
    let mut files: Vec<String> = std::fs::read_dir("problems")
        .unwrap()
        .map(|entry| entry.unwrap().path().to_str().unwrap().to_owned())
        .filter(|path| path.ends_with(".ron"))
        .collect();
    files.sort();
    assert!(files.len() >= 4, "{files:?}");
    files
}

/// The name of a problem file without directory and extension.
pub fn stem(file: &str) -> &str {
    Path::new(file).file_stem().unwrap().to_str().unwrap()
}

pub fn parse(name: &str, text: String, syntax: Syntax) -> Document {
    Document::read(Source { name: name.into(), text, syntax })
        .unwrap_or_else(|rejected| panic!("{}", render(&rejected.diagnostics, &*rejected, false)))
}

pub fn read(file: &str) -> Document {
    parse(file, std::fs::read_to_string(file).unwrap(), Syntax::Ron)
}

/// The document with settings as `--set` takes them.
pub fn with<K: AsRef<str>, V: AsRef<str>>(document: &Document, settings: &[(K, V)]) -> Document {
    let mut document = document.clone();
    for (key, value) in settings {
        document = model::set(&document, key.as_ref(), value.as_ref())
            .unwrap_or_else(|(places, diagnostics)| panic!("{}", render(&diagnostics, &*places, false)));
    }
    document
}

pub fn resolve(document: &Document) -> Model {
    model::resolve(&document.problem)
        .unwrap_or_else(|refused| panic!("{}", render(&refused.diagnostics, document, false)))
}

/// The whole branch, or the states where a quantity has a value.
pub fn run(model: &Model, at: Option<(&str, f64)>) -> Outcome {
    let requests: Vec<Request> =
        at.iter().map(|(name, value)| Request { name: (*name).into(), value: *value }).collect();
    run::run(model, &requests, &mut |_, _| ControlFlow::Continue(()))
}

/// Value and claimed error of a quantity at a point.
pub fn measured(model: &Model, outcome: &Outcome, point: usize, name: &str) -> Option<(f64, f64)> {
    let i = model.quantities.iter().position(|q| q.name == name)?;
    outcome.points[point].solution.quantities[i].map(|m| (m.value, m.error))
}
