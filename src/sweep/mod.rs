//! The branch of a problem for many values of its parameters.
//!
//! [`Plan`] is the list of cases that a file's `sweep` means, or the options of a command ([`option`]); [`crew`] solves them
//! in parallel, [`Rows`] is what a case gives: lines that stand for themselves. [`Journal`] is the file of those lines, which
//! survives the end of its process at any moment, and [`merge`] makes one of the files of several processes.

pub mod crew;
mod journal;
mod merge;
mod option;
mod plan;
mod rows;
mod table;

pub use journal::{Journal, Opening, Trouble};
pub use merge::{Merged, merge};
pub use option::option;
pub use plan::{Case, Plan};
pub use rows::{At, Job, Rows, State, Verdict};
pub use table::Table;

/// A part of a sweep: every n-th case, beginning with the i-th.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which part, from 0.
    part: usize,
    /// Of how many.
    parts: usize,
}

impl Shard {
    /// The whole sweep.
    pub const WHOLE: Shard = Shard { part: 0, parts: 1 };

    /// True if a case belongs to this part.
    pub fn holds(self, case: usize) -> bool {
        case % self.parts == self.part
    }

    /// The file of this part: `sweep.jsonl`, or `sweep-2-of-4.jsonl`.
    pub fn file(self) -> String {
        match self.parts {
            1 => "sweep.jsonl".into(),
            n => format!("sweep-{}-of-{n}.jsonl", self.part + 1),
        }
    }

    /// The part whose file has this name, if it is one of several.
    fn of_file(name: &str) -> Option<Shard> {
        let (part, parts) = name.strip_prefix("sweep-")?.strip_suffix(".jsonl")?.split_once("-of-")?;
        format!("{part}/{parts}").parse().ok().filter(|shard: &Shard| shard.file() == name)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.part + 1, self.parts)
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((i @ 1.., n)) if i <= n => Ok(Shard { part: i - 1, parts: n }),
            Some((i, n)) => Err(format!("there is no part {i} of {n}: parts are 1/{n} to {n}/{n}")),
            None => Err("two whole numbers are wanted, such as 2/4: the second of four parts".into()),
        }
    }
}
