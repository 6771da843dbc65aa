//! A folder that belongs to one run: what an earlier run left in it goes, what no run wrote is never touched.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::ExportError;
use crate::file::{is_temporary, write_json};
use crate::folder::{foreign, remove_frames};

/// Name of the record: which files of the folder are a run's.
const RECORD: &str = "run.json";

/// Version of the record.
#[derive(Serialize, Deserialize)]
enum Format {
    #[serde(rename = "rods-run-1")]
    Run1,
}

/// The record as it stands in the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    format: Format,
    /// Whether the run came to its end; where it did not, files may be missing.
    finished: bool,
    /// Names in the folder; those of folders of frames end in a slash.
    files: Vec<String>,
}

/// A folder that one run has to itself, for as long as this value lives.
///
/// The folder's `run.json` names what belongs to the run. It is there before any other file is, so that the next run
/// finds and removes what this one leaves, whatever becomes of it: temporary files of a run that was killed, too. Two
/// runs at once are kept apart by a lock of the operating system on the folder, which ends with the process and leaves
/// nothing behind. File systems without such locks (some network drives) cannot keep them apart.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// Holds the lock.
    _lock: Option<File>,
}

impl RunFolder {
    /// Takes `path`, which is created if it does not exist, for a run that will write `files` there: names, of folders of
    /// frames with a slash at the end. Removes what an earlier run wrote.
    ///
    /// # Errors
    /// [`ExportError::Busy`] if another run writes into the folder; [`ExportError::Taken`] if something that no run wrote
    /// stands where one of `files` or the record must go; [`ExportError::Io`] if the folder cannot be made or written to.
    /// Nothing has been changed then, but that an empty folder may have been made.
    pub fn take(path: &Path, files: &[&str]) -> Result<Self, ExportError> {
        if path.exists() && !path.is_dir() {
            return Err(ExportError::io("create the directory", path)(io::ErrorKind::NotADirectory.into()));
        }
        fs::create_dir_all(path).map_err(ExportError::io("create the directory", path))?;
        let folder = Self { path: path.to_owned(), _lock: lock(path)? };
        let earlier = folder.earlier()?.map_or(Vec::new(), |record| record.files);
        for name in files {
            folder.check(name, earlier.iter().any(|known| known == name))?;
        }
        let mut known = earlier.clone();
        known.extend(
            files.iter().filter(|name| !earlier.iter().any(|known| known == *name)).map(|&name| name.to_owned()),
        );
        folder.record(false, &known)?;
        known.push(RECORD.to_owned());
        folder.clear(&earlier, &known).map_err(ExportError::io("remove an earlier run from", path))?;
        Ok(folder)
    }

    /// Takes the folder of a run that has ended, to add `files` to it, named as in [`Self::take`], or to replace them. From
    /// then on they are the run's.
    ///
    /// # Errors
    /// As [`Self::take`].
    pub fn add(path: &Path, files: &[&str]) -> Result<Self, ExportError> {
        let folder = Self { path: path.to_owned(), _lock: lock(path)? };
        let Record { finished, files: mut known, .. } =
            folder.earlier()?.unwrap_or(Record { format: Format::Run1, finished: true, files: Vec::new() });
        for &name in files {
            let is_known = known.iter().any(|known| known == name);
            folder.check(name, is_known)?;
            if !is_known {
                known.push(name.to_owned());
            }
        }
        folder.record(finished, &known)?;
        Ok(folder)
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Ends the run, which wrote these files.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the record cannot be written: then it names what was to be written.
    pub fn finish(self, written: &[String]) -> Result<(), ExportError> {
        self.record(true, written)
    }

    /// What an earlier run wrote or was about to write; `None` where there is no record of any.
    fn earlier(&self) -> Result<Option<Record>, ExportError> {
        let path = self.path.join(RECORD);
        let text = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            text => text,
        };
        // What cannot be read or has other content is somebody else's.
        let record: Option<Record> = text.ok().and_then(|text| serde_json::from_slice(&text).ok());
        let record = record.filter(|record| record.files.iter().all(|name| is_plain(name)));
        record.map(Some).ok_or(ExportError::Taken { path })
    }

    /// Checks that nothing stands at a name, or what an earlier run wrote there (`is_known`).
    fn check(&self, name: &str, is_known: bool) -> Result<(), ExportError> {
        let path = self.path.join(name.trim_end_matches('/'));
        let found = match path.symlink_metadata() {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            found => found.map_err(ExportError::io("look at", &path))?,
        };
        if !is_known || found.is_dir() != name.ends_with('/') {
            return Err(ExportError::Taken { path });
        }
        if found.is_dir() {
            let foreign = foreign(&path, extension(name)).map_err(ExportError::io("read", &path))?;
            return foreign.map_or(Ok(()), |path| Err(ExportError::Taken { path }));
        }
        Ok(())
    }

    fn record(&self, finished: bool, files: &[String]) -> Result<(), ExportError> {
        let record = Record { format: Format::Run1, finished, files: files.to_vec() };
        write_json(&self.path.join(RECORD), &record)
    }

    /// Removes what an earlier run wrote, and all temporary files with the names of a run's.
    fn clear(&self, earlier: &[String], known: &[String]) -> io::Result<()> {
        for name in earlier {
            let path = self.path.join(name.trim_end_matches('/'));
            match path.symlink_metadata() {
                Err(_) => {}
                Ok(found) if found.is_dir() => {
                    if name.ends_with('/') {
                        remove_frames(&path, extension(name))?;
                    }
                }
                Ok(_) => fs::remove_file(&path)?,
            }
        }
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            let name = entry.file_name();
            let is_left = |known: &String| is_temporary(&name.to_string_lossy(), known.trim_end_matches('/'));
            if !known.iter().any(is_left) {
                continue;
            }
            if entry.file_type()?.is_dir() {
                fs::remove_dir_all(entry.path())?;
            } else {
                fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    }
}

/// Extension of the frames in a folder: its name.
fn extension(name: &str) -> &str {
    name.trim_end_matches('/')
}

/// Whether a name of the record is one of something in the folder itself.
fn is_plain(name: &str) -> bool {
    let name = name.strip_suffix('/').unwrap_or(name);
    let mut parts = Path::new(name).components();
    matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name)
}

/// Locks a folder for this process; `None` where the system or the file system has no such locks.
fn lock(path: &Path) -> Result<Option<File>, ExportError> {
    let Ok(folder) = File::open(path) else { return Ok(None) };
    match folder.try_lock() {
        Ok(()) => Ok(Some(folder)),
        Err(TryLockError::WouldBlock) => Err(ExportError::Busy { path: path.to_owned() }),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}
