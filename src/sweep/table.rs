//! A sweep for people: one line for each state, as the cases come.

use super::plan::{Plan, short};
use super::rows::{Rows, State};
use crate::model::Model;
use crate::number::{known, plain, small};
use crate::run::Request;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::fmt::Write;

/// Columns of characters that a line may take.
const WIDTH: usize = 110;
/// Characters of a column of numbers.
const CELL: usize = 13;
/// Significant digits.
const DIGITS: usize = 7;
/// Cases that are named at the end.
const NAMED: usize = 20;

/// The columns, and what there is to say at the end.
pub struct Table {
    set: Vec<String>,
    columns: Vec<String>,
    left_out: Vec<String>,
    cases: usize,
    states: usize,
    inadmissible: usize,
    unsolved: Vec<usize>,
    worst: Option<(f64, String, usize)>,
}

impl Table {
    /// The columns of a sweep: what is set, the control, what is asked for, and what else there is room for.
    pub fn new(plan: &Plan, model: &Model, requests: &[Request]) -> Table {
        let set = plan.names();
        let asked = requests.iter().map(|r| r.name.as_str());
        let moving = model.quantities.iter().filter(|q| q.formula.probes().next().is_some());
        let first = std::iter::once(model.branch.control.as_str()).chain(asked);
        let mut names: Vec<String> = vec![];
        for name in first.chain(moving.map(|q| q.name.as_str())) {
            if !names.iter().any(|n| n == name) {
                names.push(name.into());
            }
        }
        let room = (WIDTH.saturating_sub(6 + CELL * (set.len() + 1)) / CELL).max(1);
        let left_out = names.split_off(room.min(names.len()));
        Table { set, columns: names, left_out, cases: 0, states: 0, inadmissible: 0, unsolved: vec![], worst: None }
    }

    /// The line above all others, with the line below it.
    pub fn head(&self) -> String {
        let mut text = format!("{:>6}", "case");
        let names = self.set.iter().map(String::as_str).chain(["kind"]).chain(self.columns.iter().map(String::as_str));
        names.for_each(|name| cell(&mut text, name));
        let line = "-".repeat(text.chars().count());
        format!("{text}\n{line}\n")
    }

    /// The lines of a case.
    pub fn lines(&mut self, rows: &Rows) -> String {
        self.count(rows);
        let mut text = String::new();
        for state in &rows.states {
            self.start(&mut text, rows);
            cell(&mut text, state.kind);
            for name in &self.columns {
                cell(&mut text, &number(state, name).map_or("-".into(), |(value, error)| known(value, error, DIGITS)));
            }
            text.push('\n');
        }
        if !rows.verdict.is_complete() {
            self.start(&mut text, rows);
            cell(&mut text, rows.verdict.status);
            let _ = writeln!(text, "  {}", rows.verdict.message);
        }
        text
    }

    fn start(&self, text: &mut String, rows: &Rows) {
        let _ = write!(text, "{:>6}", rows.case);
        self.set.iter().for_each(|name| cell(text, &rows.set.get(name).map_or("-".into(), short)));
    }

    fn count(&mut self, rows: &Rows) {
        self.cases += 1;
        self.states += rows.states.len();
        self.inadmissible += rows.states.iter().filter(|s| !s.admissible).count();
        if !rows.verdict.is_complete() {
            self.unsolved.push(rows.case);
        }
        let mut typical: HashMap<&str, f64> = HashMap::new();
        for (state, name) in rows.states.iter().flat_map(|s| s.error.keys().map(move |name| (s, name))) {
            let largest = typical.entry(name).or_default();
            *largest = largest.max(number(state, name).map_or(0.0, |n| n.0.abs()));
        }
        for state in &rows.states {
            for name in state.error.keys() {
                // What rounding leaves of a number is no error, and one that vanishes is measured against its other values.
                let Some((value, error)) = number(state, name).filter(|n| n.1 > 1e-13) else { continue };
                let relative = error / value.abs().max(1e-3 * typical[name.as_str()]);
                if self.worst.as_ref().is_none_or(|w| relative > w.0) {
                    self.worst = Some((relative, name.clone(), rows.case));
                }
            }
        }
    }

    /// What there is to say at the end.
    pub fn tail(&self, accuracy: f64) -> String {
        let mut text = String::new();
        if !self.left_out.is_empty() {
            let _ = writeln!(text, "Not shown for want of room: {}", self.left_out.join(", "));
        }
        let _ = writeln!(text, "\n{} states of {} cases.", self.states, self.cases);
        if let Some((error, name, case)) = &self.worst {
            let asked = plain(accuracy);
            let _ = writeln!(
                text,
                "Largest estimated relative error: {} ({name} in case {case}); {asked} was asked for.",
                small(*error)
            );
        }
        let _ = match self.inadmissible {
            0 => writeln!(text, "Every state is admissible."),
            n => writeln!(text, "Not admissible: {n} of {} states.", self.states),
        };
        let _ = match self.unsolved.len() {
            0 => writeln!(text, "Complete: everything that was asked for was solved."),
            n => {
                let named: Vec<String> = self.unsolved.iter().take(NAMED).map(usize::to_string).collect();
                let more = if n > NAMED { ", .." } else { "" };
                writeln!(text, "Incomplete: not, or not wholly, solved: {n} cases ({}{more})", named.join(", "))
            }
        };
        text
    }
}

/// A quantity with its error.
fn number(state: &State, name: &str) -> Option<(f64, f64)> {
    let of = |map: &Map<String, Value>| map.get(name).and_then(Value::as_f64);
    Some((of(&state.quantities)?, of(&state.error).unwrap_or(0.0)))
}

/// A cell on the right of its column; what is too long for it is cut.
fn cell(text: &mut String, word: &str) {
    let word: String = word.chars().take(CELL - 1).collect();
    let _ = write!(text, "{word:>CELL$}");
}
