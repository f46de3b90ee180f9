//! One file of the files of several processes.

use super::Shard;
use super::journal::{Reader, Trouble};
use crate::output::files;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// What was merged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Merged {
    /// The file.
    pub path: PathBuf,
    /// How many files it was made of.
    pub parts: usize,
    /// How many cases it holds: all of the sweep.
    pub cases: usize,
    /// How many of them are not wholly solved.
    pub unsolved: usize,
}

/// Makes `sweep.jsonl` of the files of all parts of a sweep in a directory: what one process would have written.
///
/// # Errors
/// What is missing or does not belong together; no file is written then.
pub fn merge(directory: &Path, overwrite: bool) -> Result<Merged, String> {
    let path = directory.join(Shard::WHOLE.file());
    let shards = shards(directory)?;
    if path.exists() && !overwrite {
        return Err(format!("{} exists already: --overwrite replaces it", path.display()));
    }
    let mut readers = vec![];
    for shard in &shards {
        let part = directory.join(shard.file());
        let file = File::open(&part).map_err(|e| format!("{}: {e}", part.display()))?;
        readers.push(Reader::new(file, &part));
    }
    let mut merged = Merged { path: path.clone(), parts: shards.len(), cases: 0, unsolved: 0 };
    let mut wrong = None;
    let written = files::write_with(&path, |out| {
        wrong = weave(&mut readers, &shards, out, &mut merged)?.err();
        match wrong {
            None => Ok(()),
            Some(_) => Err(io::Error::other("")), // nothing is renamed
        }
    });
    match (wrong, written) {
        (Some(message), _) => Err(message),
        (None, Err(error)) => Err(format!("{} cannot be written: {error}", path.display())),
        (None, Ok(())) => Ok(merged),
    }
}

/// Takes one case after the other, each from the file of its part.
fn weave(
    readers: &mut [Reader],
    shards: &[Shard],
    out: &mut dyn Write,
    merged: &mut Merged,
) -> io::Result<Result<(), String>> {
    let (mut rows, mut cases) = (vec![], None);
    let parts = readers.len();
    loop {
        let part = merged.cases % parts;
        let (file, shard) = (shards[part].file(), shards[part]);
        let span = match readers[part].next(&mut rows) {
            Ok(span) => span,
            Err(Trouble::Io(_, error)) => return Err(error),
            Err(trouble) => return Ok(Err(trouble.to_string())),
        };
        let Some(span) = span else {
            return Ok(match cases {
                Some(cases) if cases == merged.cases => Ok(()),
                _ => Err(format!("{file} ends before case {}: --shard {shard} --resume solves the rest", merged.cases)),
            });
        };
        if span.case != merged.cases {
            return Ok(Err(format!(
                "{file} has case {} where case {} should be: --shard {shard} --resume puts it in order",
                span.case, merged.cases
            )));
        }
        let problem = readers[0].problem.clone();
        if readers[part].problem != problem || *cases.get_or_insert(span.cases) != span.cases {
            return Ok(Err(format!("{file} is of another problem than {}", shards[0].file())));
        }
        out.write_all(&rows)?;
        merged.cases += 1;
        merged.unsolved += usize::from(!span.complete);
    }
}

/// The parts of the sweep whose files are in a directory, if all are there.
fn shards(directory: &Path) -> Result<Vec<Shard>, String> {
    let name = directory.display();
    let entries = std::fs::read_dir(directory).map_err(|e| format!("{name}: {e}"))?;
    let mut found: Vec<Shard> = entries.filter_map(|entry| Shard::of_file(entry.ok()?.file_name().to_str()?)).collect();
    found.sort_by_key(|shard| (shard.parts, shard.part));
    let Some(first) = found.first() else {
        return Err(format!("there are no files sweep-I-of-N.jsonl in {name}"));
    };
    let parts = first.parts;
    if let Some(other) = found.iter().find(|shard| shard.parts != parts) {
        return Err(format!(
            "{name} has parts of {parts} and parts of {}: leave those that belong together",
            other.parts
        ));
    }
    let missing: Vec<String> = (0..parts)
        .map(|part| Shard { part, parts })
        .filter(|shard| !found.contains(shard))
        .map(|shard| shard.to_string())
        .take(20)
        .collect();
    match missing.is_empty() {
        true => Ok(found),
        false => Err(format!("parts are missing in {name}: --shard {}", missing.join(", "))),
    }
}
