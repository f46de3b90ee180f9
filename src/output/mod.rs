//! What is written: the result document, tables for people and for programs, the explanation of a problem, files.
//!
//! Everything here is text made of a [`Problem`], its [`Model`] and the [`Outcome`] of a run; nothing is computed and
//! nothing is printed.

pub mod csv;
pub mod document;
pub mod explain;
pub mod files;
mod resolved;
pub mod table;

use crate::model::Model;
use crate::run::{Outcome, Point, Reason};
use crate::spec::Problem;

pub use resolved::resolved;

/// A run with what it was made of.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// The problem as it stood when it was solved, with what was set from outside.
    pub problem: &'a Problem,
    /// What it means.
    pub model: &'a Model,
    /// What was found.
    pub outcome: &'a Outcome,
}

impl Report<'_> {
    /// The value of a quantity or parameter in a state.
    pub fn value(&self, point: &Point, name: &str) -> Option<f64> {
        let place = self.model.quantities.iter().position(|q| q.name == name);
        match place {
            Some(i) => point.solution.quantity(i).map(|q| q.value),
            None => self.model.parameters.iter().find(|p| p.0 == name).map(|p| p.1),
        }
    }
}

/// The word for the reason why a state is reported.
pub fn reason(reason: Reason) -> &'static str {
    match reason {
        Reason::At => "at",
        Reason::Step => "step",
        Reason::Fold => "fold",
        Reason::Event => "event",
        Reason::Start => "start",
        Reason::End => "end",
    }
}
