//! Runs as files.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use export::{ExportError, write_atomically};

use crate::{Run, ViewError};

/// Writes a run as JSON (`view.json`), whole or not at all.
///
/// # Errors
/// [`ExportError::Io`] with `path`, if the system refuses.
pub fn write_run(path: &Path, run: &Run) -> Result<(), ExportError> {
    write_atomically(path, |writer| {
        serde_json::to_writer(&mut *writer, run)?;
        writer.write_all(b"\n")
    })
}

/// Reads a run that [`write_run`] wrote, and checks that all of it can be decoded.
///
/// # Errors
/// [`ViewError::File`] if the file cannot be read; [`ViewError::Damaged`] if it is not JSON, not a run, or damaged. Both
/// name the file.
pub fn read_run(path: &Path) -> Result<Run, ViewError> {
    let damaged = |reason: String| ViewError::Damaged { path: path.to_owned(), reason };
    let unreadable = |cause: io::Error| ExportError::Io { action: "read", path: path.to_owned(), cause };
    let bytes = fs::read(path).map_err(unreadable)?;
    let run: Run = serde_json::from_slice(&bytes).map_err(|error| damaged(error.to_string()))?;
    run.decode().map_err(|error| damaged(error.to_string()))?;
    Ok(run)
}
