//! Folders of frames that are complete or not there.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::ExportError;
use crate::file::{RANDOM, SUFFIX, prefix, write_whole};

/// Every frame's file begins with this.
const PREFIX: &str = "frame_";
/// Digits of a frame's number, more where there are more frames.
const DIGITS: usize = 4;

/// A folder of one file a frame, `frame_0000.extension` and so on, in the making under a temporary name beside its own;
/// removed when dropped.
pub(crate) struct Folder {
    path: PathBuf,
    extension: &'static str,
    digits: usize,
    staged: TempDir,
}

impl Folder {
    /// Begins a folder for `frames` frames at `path`.
    ///
    /// # Errors
    /// [`ExportError::Io`] with `path` if it cannot be created, or if something stands there that no export wrote.
    pub(crate) fn stage(path: &Path, frames: usize, extension: &'static str) -> Result<Self, ExportError> {
        replaceable(path, extension).map_err(ExportError::io("replace", path))?;
        let staged = beside(path).map_err(ExportError::io("create the directory", path))?;
        let digits = DIGITS.max(frames.saturating_sub(1).to_string().len());
        Ok(Self { path: path.to_owned(), extension, digits, staged })
    }

    /// Name of a frame's file in the folder.
    pub(crate) fn name(&self, frame: usize) -> String {
        format!("{PREFIX}{frame:0width$}.{}", self.extension, width = self.digits)
    }

    /// Writes a frame's file.
    pub(crate) fn write(
        &self,
        frame: usize,
        write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
    ) -> Result<(), ExportError> {
        let name = self.name(frame);
        let attempt = || write_whole(&File::create_new(self.staged.path().join(&name))?, write);
        attempt().map_err(ExportError::io("write", &self.path.join(&name)))
    }

    /// Gives the folder its own name, which is returned. An earlier export's folder is removed after that.
    pub(crate) fn publish(self) -> Result<PathBuf, ExportError> {
        let attempt = || {
            replaceable(&self.path, self.extension)?;
            if !self.path.exists() {
                return fs::rename(self.staged.path(), &self.path);
            }
            let old = beside(&self.path)?;
            let aside = old.path().join("old");
            fs::rename(&self.path, &aside)?;
            fs::rename(self.staged.path(), &self.path).inspect_err(|_| {
                // Nothing better can be done than to try.
                let _ = fs::rename(&aside, &self.path);
            })
        };
        attempt().map_err(ExportError::io("replace", &self.path))?;
        // It has another name now: there is nothing to remove.
        let _ = self.staged.keep();
        Ok(self.path)
    }
}

/// A new directory with a name of its own beside `path`.
fn beside(path: &Path) -> io::Result<TempDir> {
    let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
    let parent = path.parent().filter(|d| !d.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let prefix = prefix(&name.to_string_lossy());
    let directory = tempfile::Builder::new().prefix(&prefix).suffix(SUFFIX).rand_bytes(RANDOM).tempdir_in(parent);
    // The error's kind alone: the random name that tempfile adds to it says nothing to a reader.
    directory.map_err(|error| error.kind().into())
}

/// Checks that at `path` there is nothing, or a folder with nothing but frames of this extension in it.
fn replaceable(path: &Path, extension: &str) -> io::Result<()> {
    match path.symlink_metadata() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error.kind().into()),
        Ok(metadata) if metadata.is_dir() => {}
        Ok(_) => return Err(io::ErrorKind::NotADirectory.into()),
    }
    match foreign(path, extension)? {
        None => Ok(()),
        Some(other) => {
            let name = Path::new(other.file_name().unwrap_or_default()).display();
            Err(io::Error::new(io::ErrorKind::AlreadyExists, format!("it holds {name}, which no export wrote")))
        }
    }
}

/// Something in a folder that is no frame of this extension, if there is any.
pub(crate) fn foreign(folder: &Path, extension: &str) -> io::Result<Option<PathBuf>> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if !is_frame(&entry.file_name().to_string_lossy(), extension) {
            return Ok(Some(entry.path()));
        }
    }
    Ok(None)
}

/// Removes the frames of this extension from a folder, and the folder if nothing is left in it.
pub(crate) fn remove_frames(folder: &Path, extension: &str) -> io::Result<()> {
    let mut is_empty = true;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if is_frame(&entry.file_name().to_string_lossy(), extension) && !entry.file_type()?.is_dir() {
            fs::remove_file(entry.path())?;
        } else {
            is_empty = false;
        }
    }
    if is_empty { fs::remove_dir(folder) } else { Ok(()) }
}

/// Whether a file's name is one that [`Folder::name`] gives.
fn is_frame(name: &str, extension: &str) -> bool {
    let number = name.strip_prefix(PREFIX).and_then(|name| name.strip_suffix(extension)?.strip_suffix('.'));
    number.is_some_and(|digits| digits.len() >= DIGITS && digits.bytes().all(|digit| digit.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_the_order_of_frames() {
        let directory = tempfile::tempdir().unwrap();
        let names = |frames: usize| {
            let folder = Folder::stage(&directory.path().join("obj"), frames, "obj").unwrap();
            [0, 9, frames - 1].map(|frame| folder.name(frame)).join(" ")
        };
        assert_eq!(names(10_000), "frame_0000.obj frame_0009.obj frame_9999.obj");
        assert_eq!(names(10_001), "frame_00000.obj frame_00009.obj frame_10000.obj");
    }
}
