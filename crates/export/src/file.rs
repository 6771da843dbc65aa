//! Files that are complete or not there.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use tempfile::NamedTempFile;

use crate::ExportError;

/// Bytes that a writer or a reader moves at once.
pub(crate) const CHUNK: usize = 1 << 20;

/// End of a temporary file's name.
pub(crate) const SUFFIX: &str = ".tmp";

/// Random letters and digits in a temporary file's name.
pub(crate) const RANDOM: usize = 6;

/// What the names of temporary files for the file `name` begin with.
pub(crate) fn prefix(name: &str) -> String {
    format!(".{name}-")
}

/// Whether `file` is named as temporary files and folders for the file `name` are: what a process leaves that is killed.
pub(crate) fn is_temporary(file: &str, name: &str) -> bool {
    let random = file.strip_prefix(&prefix(name)).and_then(|rest| rest.strip_suffix(SUFFIX));
    random.is_some_and(|random| random.len() == RANDOM && random.bytes().all(|byte| byte.is_ascii_alphanumeric()))
}

/// A new file with a name of its own in `directory`, for the file `name`, readable as the user's other files are; removed
/// when dropped.
pub(crate) fn temporary(directory: &Path, name: &str) -> io::Result<NamedTempFile> {
    let prefix = prefix(name);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX).rand_bytes(RANDOM);
    // `File::create_new` obeys the umask; tempfile's own choice would hide the renamed file from everybody else.
    let file = builder.make_in(directory, |path| File::create_new(path));
    // The error's kind alone: the random name that tempfile adds to it says nothing to a reader.
    file.map_err(|error| error.kind().into())
}

/// A file that is complete and on the disk under a temporary name beside its own; removed when dropped.
pub(crate) struct Staged {
    path: PathBuf,
    file: NamedTempFile,
}

/// Writes a file under a temporary name in the directory of `path`.
///
/// # Errors
/// [`ExportError::Io`] with `path`, for an error of the system or of `write`, or if `path` cannot be replaced by a file.
pub(crate) fn stage(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<Staged, ExportError> {
    let attempt = || {
        let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
        if path.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        let directory = path.parent().filter(|d| !d.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let file = temporary(directory, &name.to_string_lossy())?;
        write_whole(file.as_file(), write)?;
        Ok(Staged { path: path.to_owned(), file })
    };
    attempt().map_err(ExportError::io("write", path))
}

impl Staged {
    /// Gives the file its own name, which is returned.
    pub(crate) fn publish(self) -> Result<PathBuf, ExportError> {
        match self.file.persist(&self.path) {
            Ok(_) => Ok(self.path),
            Err(error) => Err(ExportError::io("write", &self.path)(error.error)),
        }
    }
}

/// Fills an empty file and waits until all of it is on the disk.
pub(crate) fn write_whole(file: &File, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(CHUNK, file);
    write(&mut writer)?;
    writer.flush()?;
    drop(writer);
    file.sync_all()
}

/// Writes a file under a temporary name in the same directory, and renames it to `path` when it is complete and on the
/// disk. A file that was there is replaced; after an error it is still there, untouched, and nothing else is left
/// behind.
///
/// # Errors
/// [`ExportError::Io`] with `path`, for an error of the system or of `write`.
pub fn write_atomically(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), ExportError> {
    stage(path, write)?.publish()?;
    Ok(())
}

/// Writes `value` as indented JSON. A number that is not finite becomes `null`.
///
/// # Errors
/// [`ExportError::Io`] with `path`, if the system refuses or `value` has no form in JSON.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), ExportError> {
    write_atomically(path, |writer| {
        serde_json::to_writer_pretty(&mut *writer, value)?;
        writer.write_all(b"\n")
    })
}
