//! Files that are either whole or not there: written under a temporary name, then renamed.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Temporary files that have not been renamed yet; dropped, they are removed.
#[derive(Default)]
struct Pending(Vec<(PathBuf, PathBuf)>);

impl Drop for Pending {
    fn drop(&mut self) {
        for (temporary, _) in &self.0 {
            let _ = fs::remove_file(temporary);
        }
    }
}

impl Pending {
    fn write(&mut self, path: PathBuf, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if path.is_dir() || name.is_empty() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory"));
        }
        let temporary = path.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
        let mut file = io::BufWriter::new(File::create(&temporary)?);
        self.0.push((temporary, path));
        write(&mut file)?;
        file.into_inner()?.sync_all()
    }

    fn rename(mut self) -> io::Result<()> {
        while let Some((temporary, path)) = self.0.first() {
            fs::rename(temporary, path)?;
            self.0.remove(0);
        }
        Ok(())
    }
}

/// Writes files into a directory, which is made where there is none. Those of the same names are replaced when all are
/// complete.
///
/// # Errors
/// The first that goes wrong; no half file is left then.
pub fn write_all(directory: &Path, files: &[(&str, String)]) -> io::Result<()> {
    fs::create_dir_all(directory)?;
    let mut pending = Pending::default();
    for (name, text) in files {
        pending.write(directory.join(name), |file| file.write_all(text.as_bytes()))?;
    }
    pending.rename()
}

/// Writes one file, replacing one of the same name when it is complete.
///
/// # Errors
/// What goes wrong; no half file is left then.
pub fn write(path: &Path, text: &str) -> io::Result<()> {
    write_with(path, |file| file.write_all(text.as_bytes()))
}

/// Writes one file piece by piece, replacing one of the same name when it is complete.
///
/// # Errors
/// What goes wrong, the errors of `write` among it; no half file is left then.
pub fn write_with(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut pending = Pending::default();
    pending.write(path.to_owned(), write)?;
    pending.rename()
}

/// Writes a file that must not exist yet.
///
/// # Errors
/// That it exists, and what else goes wrong; no half file is left then.
pub fn create(path: &Path, text: &str) -> io::Result<()> {
    let mut file = File::create_new(path)?;
    file.write_all(text.as_bytes()).inspect_err(|_| {
        let _ = fs::remove_file(path);
    })
}
