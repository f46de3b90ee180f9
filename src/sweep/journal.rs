//! The file of a sweep: lines of JSON, the rows of one case together, the last of them with `"kind": "case"`.
//!
//! Rows are appended case by case, each case in one piece, and never changed: whatever happens to the process, the file is whole
//! up to the last complete case, and what is behind that is cut off when the sweep is resumed. At the end the cases are put in
//! order, under a temporary name that is renamed.

use super::Shard;
use super::rows::Verdict;
use crate::output::files;
use serde::Deserialize;
use std::borrow::Cow;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// What is wrong with the file of a sweep.
#[derive(Debug, thiserror::Error)]
pub enum Trouble {
    /// There is one already, and nobody said what to do with it.
    #[error("{0} exists already: --resume goes on with it, --overwrite begins anew")]
    Exists(String),
    /// Another process writes to it.
    #[error("{0} is being written by another process")]
    Busy(String),
    /// It belongs to another sweep.
    #[error(
        "{0} is of another problem, other values of --at, or another version of this program: --overwrite begins anew"
    )]
    Foreign(String),
    /// It is no such file, or something was changed in it.
    #[error("{0}, line {1}: this is no row of a sweep ({2})")]
    Damaged(String, usize, String),
    /// The system refuses.
    #[error("{0}: {1}")]
    Io(String, io::Error),
}

/// What to do with a file that exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Opening {
    /// Nothing: it must not exist.
    New,
    /// Go on with it.
    Resume,
    /// Begin anew.
    Overwrite,
}

/// What is read of a row.
#[derive(Deserialize)]
struct Head<'a> {
    case: usize,
    #[serde(borrow)]
    kind: Cow<'a, str>,
    #[serde(borrow)]
    problem: Cow<'a, str>,
    #[serde(borrow)]
    status: Option<Cow<'a, str>>,
    cases: Option<usize>,
}

/// The rows of a case in a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    /// The case.
    pub case: usize,
    /// Where its rows begin, in bytes.
    pub start: u64,
    /// How many bytes they are.
    pub length: u64,
    /// True if all of it was solved.
    pub complete: bool,
    /// How many cases the sweep has.
    pub cases: usize,
}

/// Reads a file of rows, case by case.
pub(super) struct Reader {
    input: BufReader<File>,
    name: String,
    line: usize,
    /// The bytes that were read, up to and with the last complete case.
    end: u64,
    /// The problem that all rows are about.
    pub problem: Option<String>,
}

impl Reader {
    pub fn new(file: File, path: &Path) -> Reader {
        let name = path.display().to_string();
        Reader { input: BufReader::with_capacity(1 << 16, file), name, line: 0, end: 0, problem: None }
    }

    fn damaged(&self, why: impl Into<String>) -> Trouble {
        Trouble::Damaged(self.name.clone(), self.line, why.into())
    }

    /// The next complete case, with its bytes; nothing at the end, or where the rest is no complete case.
    pub fn next(&mut self, bytes: &mut Vec<u8>) -> Result<Option<Span>, Trouble> {
        bytes.clear();
        let mut case = None;
        loop {
            let begin = bytes.len();
            self.input.read_until(b'\n', bytes).map_err(|e| Trouble::Io(self.name.clone(), e))?;
            let line = &bytes[begin..];
            if line.last() != Some(&b'\n') {
                return Ok(None); // the end, or a row that was never finished
            }
            self.line += 1;
            let head: Head = serde_json::from_slice(line).map_err(|e| self.damaged(e.to_string()))?;
            if *case.get_or_insert(head.case) != head.case {
                return Err(self.damaged(format!("of case {}, in the middle of another", head.case)));
            }
            match &self.problem {
                None => self.problem = Some(head.problem.into_owned()),
                Some(problem) if *problem != head.problem => return Err(self.damaged("of another problem")),
                Some(_) => {}
            }
            if head.kind == Verdict::KIND {
                let (start, length) = (self.end, bytes.len() as u64);
                self.end += length;
                let complete = head.status.as_deref() == Some(Verdict::COMPLETE);
                return Ok(Some(Span { case: head.case, start, length, complete, cases: head.cases.unwrap_or(0) }));
            }
        }
    }
}

/// The file of a sweep, to be written.
pub struct Journal {
    path: PathBuf,
    file: File,
    spans: Vec<Span>,
    end: u64,
}

impl Journal {
    /// Opens the file of a part of a sweep in a directory.
    ///
    /// # Errors
    /// [`Trouble`]; the file is as it was then.
    pub fn open(directory: &Path, shard: Shard, problem: &str, opening: Opening) -> Result<Journal, Trouble> {
        let path = directory.join(shard.file());
        let name = || path.display().to_string();
        let io = |e| Trouble::Io(name(), e);
        std::fs::create_dir_all(directory).map_err(io)?;
        let mut options = OpenOptions::new();
        options.read(true).write(true);
        match opening {
            Opening::New => options.create_new(true),
            Opening::Resume | Opening::Overwrite => options.create(true).truncate(false),
        };
        let file = options.open(&path).map_err(|e| match e.kind() {
            io::ErrorKind::AlreadyExists => Trouble::Exists(name()),
            _ => io(e),
        })?;
        // Where the system has no locks, nobody is kept out.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(Trouble::Busy(name()));
        }
        let mut journal = Journal { path: path.clone(), file, spans: vec![], end: 0 };
        if opening == Opening::Resume {
            journal.read(shard, problem)?;
        }
        journal.file.set_len(journal.end).map_err(io)?;
        journal.file.seek(SeekFrom::Start(journal.end)).map_err(io)?;
        Ok(journal)
    }

    /// Finds the complete cases.
    fn read(&mut self, shard: Shard, problem: &str) -> Result<(), Trouble> {
        let file = self.file.try_clone().map_err(|e| self.trouble(e))?;
        let mut reader = Reader::new(file, &self.path);
        let (mut bytes, mut seen) = (vec![], std::collections::HashSet::new());
        loop {
            let span = reader.next(&mut bytes)?;
            if reader.problem.as_deref().is_some_and(|p| p != problem) {
                return Err(Trouble::Foreign(self.path.display().to_string()));
            }
            let Some(span) = span else { break };
            if !shard.holds(span.case) || span.case >= span.cases || !seen.insert(span.case) {
                return Err(reader.damaged(format!("case {} does not belong here, or is here twice", span.case)));
            }
            self.spans.push(span);
        }
        self.end = reader.end;
        Ok(())
    }

    fn trouble(&self, error: io::Error) -> Trouble {
        Trouble::Io(self.path.display().to_string(), error)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The cases that are in it, in any order.
    pub fn cases(&self) -> impl Iterator<Item = usize> {
        self.spans.iter().map(|span| span.case)
    }

    /// How many of them are not wholly solved.
    pub fn unsolved(&self) -> usize {
        self.spans.iter().filter(|span| !span.complete).count()
    }

    /// Adds the rows of a case.
    ///
    /// # Errors
    /// Those of the system; the file is whole up to the case before then, after a cut at its end.
    pub fn append(&mut self, case: usize, rows: &str, complete: bool) -> Result<(), Trouble> {
        self.file.write_all(rows.as_bytes()).map_err(|e| self.trouble(e))?;
        let length = rows.len() as u64;
        self.spans.push(Span { case, start: self.end, length, complete, cases: 0 });
        self.end += length;
        Ok(())
    }

    /// Puts the cases in order and makes sure that they are on the disk.
    ///
    /// # Errors
    /// Those of the system; the file is whole then, in the order in which it was written.
    pub fn finish(mut self) -> Result<(), Trouble> {
        self.sorted().map_err(|e| self.trouble(e))
    }

    fn sorted(&mut self) -> io::Result<()> {
        self.file.sync_all()?;
        if self.spans.is_sorted_by_key(|span| span.case) {
            return Ok(());
        }
        self.spans.sort_by_key(|span| span.case);
        let (spans, file) = (&self.spans, &mut self.file);
        files::write_with(&self.path, |out| {
            let mut rows = vec![];
            for span in spans {
                file.seek(SeekFrom::Start(span.start))?;
                rows.resize(span.length as usize, 0);
                file.read_exact(&mut rows)?;
                out.write_all(&rows)?;
            }
            Ok(())
        })
    }
}
