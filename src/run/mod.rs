//! From a model to its branch of states.
//!
//! [`solve`](state) finds one state to the accuracy asked for; [`start`](start) finds the first one, without a guess; [`trace`](trace) follows the
//! branch through what was asked.

mod clock;
mod rank;
mod start;
mod state;
mod trace;

pub use rank::{Rank, rank};
pub use state::{Halt, Work};
pub use trace::{Event, Outcome, Point, Reason, Request, Status, run};
