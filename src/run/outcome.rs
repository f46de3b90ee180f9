//! What a run answers.

use super::state::Work;
use crate::model::Model;
use crate::solution::Solution;
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
    /// The problem in the stage of this state.
    pub model: Arc<Model>,
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
    /// The stage before it.
    pub stage_before: String,
    /// The stage after it.
    pub stage_after: String,
    /// The state, in the stage before.
    pub solution: Solution,
    /// The problem in that stage.
    pub model: Arc<Model>,
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
