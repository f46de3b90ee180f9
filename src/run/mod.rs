//! From a model to its branch of states.
//!
//! `start` finds the first state, without a guess; `state` finds one to the accuracy asked for; `trace` goes from state to state, in
//! the control or, where that turns back, by arclength (`arc`); `stage` sees what happens on the way, and changes the elements
//! of the meridian; `between` finds states between two; `branch` walks through all that was asked; `rank` examines whether the
//! conditions determine their solution.

mod arc;
mod between;
mod branch;
mod clock;
mod emerge;
mod outcome;
mod rank;
mod stage;
mod start;
mod state;
mod trace;

pub use branch::run;
pub use outcome::{Event, Outcome, Point, Reason, Request, Status};
pub use rank::{Rank, rank};
pub use state::{Halt, Work};
