//! `membrane new`.

use super::{Exit, refuse, say};
use membrane::output::files;
use std::io::ErrorKind;
use std::path::Path;

/// A problem that runs, explained line by line.
const START: &str = include_str!("start.ron");
/// What stands where its title goes.
const TITLE: &str = "\"TITLE\"";

/// Writes a file to start from.
pub fn write(name: &str) -> Exit {
    let path = if name.ends_with(".ron") { name.to_owned() } else { format!("{name}.ron") };
    let title = match Path::new(&path).file_stem().and_then(|stem| stem.to_str()) {
        Some(stem) if !stem.is_empty() && !name.ends_with(['/', '\\']) && stem != ".ron" => stem,
        _ => return refuse("no-name", "a name for the file is wanted"),
    };
    let text = START.replace(TITLE, &format!("{title:?}"));
    match files::create(Path::new(&path), &text) {
        Ok(()) => {
            say(&format!("{path} is written; try: membrane run {path}"));
            Exit::Done
        }
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            refuse("exists", &format!("{path} exists already and is left as it is"))
        }
        Err(error) => refuse("unwritable", &format!("{path} cannot be written: {error}")),
    }
}
