//! From a model to its branch of states.
//!
//! `state` finds one state to the accuracy asked for; `start` finds the first one, without a guess; `trace` follows the branch
//! through what was asked, from stage to stage; `rank` examines whether the conditions determine their solution.

mod clock;
mod rank;
mod start;
mod state;
mod trace;

pub use rank::{Rank, rank};
pub use state::{Halt, Work};
pub use trace::{Event, Outcome, Point, Reason, Request, Status, run};
