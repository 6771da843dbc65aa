//! A folder that belongs to one run: what an earlier run left in it stays until the new one is complete, what no run wrote is
//! never touched.

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
/// A run writes its files into the folder [`RunFolder::UNFINISHED`] in its own, and they take the place of an earlier run's
/// when all are there. The `run.json` in either folder names what belongs to a run. It is there before any other file is,
/// so that the next run finds and removes what this one leaves, whatever becomes of it: temporary files of a run that was
/// killed, too. Two runs at once are kept apart by a lock of the operating system on the folder, which ends with the process
/// and leaves nothing behind. File systems without such locks (some network drives) cannot keep them apart.
#[derive(Debug)]
pub struct RunFolder {
    directory: PathBuf,
    /// Where files are written.
    path: PathBuf,
    /// The names that were asked for.
    files: Vec<String>,
    /// Holds the lock.
    _lock: Option<File>,
}

impl RunFolder {
    /// Name of the folder in a run's folder that holds the files of a run that has not come to its end.
    pub const UNFINISHED: &str = "unfinished";

    /// Takes `directory`, which is created if it does not exist, for a run that will write `files` there: names, of folders
    /// of frames with a slash at the end. What a run left that did not come to its end goes, but for those of its files that
    /// are in `kept`: they stay until they are replaced or this run ends.
    ///
    /// # Errors
    /// [`ExportError::Busy`] if another run writes into the folder; [`ExportError::Taken`] if something that no run wrote
    /// stands where one of `files` or the record must go; [`ExportError::Io`] if the folder cannot be made or written to.
    /// Nothing has been changed then, but that an empty folder may have been made.
    pub fn take(directory: &Path, files: &[&str], kept: &[&str]) -> Result<Self, ExportError> {
        if directory.exists() && !directory.is_dir() {
            return Err(ExportError::io("create the directory", directory)(io::ErrorKind::NotADirectory.into()));
        }
        fs::create_dir_all(directory).map_err(ExportError::io("create the directory", directory))?;
        let path = directory.join(Self::UNFINISHED);
        let files: Vec<String> = files.iter().map(|&name| name.to_owned()).collect();
        let folder = Self { directory: directory.to_owned(), path, files, _lock: lock(directory)? };
        let earlier = earlier(directory)?.map_or(Vec::new(), |record| record.files);
        for name in &folder.files {
            check(directory, name, earlier.contains(name))?;
        }
        let left = folder.left()?;
        fs::create_dir_all(&folder.path).map_err(ExportError::io("create the directory", &folder.path))?;
        let mut known = union(&left, &folder.files);
        record(&folder.path, false, &known)?;
        known.push(RECORD.to_owned());
        let goes: Vec<String> = left.into_iter().filter(|name| !kept.contains(&name.as_str())).collect();
        clear(&folder.path, &goes, &known).map_err(ExportError::io("remove an earlier run from", &folder.path))?;
        Ok(folder)
    }

    /// Takes the folder of a run that has ended, to add `files` to it, named as in [`Self::take`], or to replace them. They
    /// are written into the folder itself, and from then on they are the run's.
    ///
    /// # Errors
    /// As [`Self::take`].
    pub fn add(directory: &Path, files: &[&str]) -> Result<Self, ExportError> {
        let lock = lock(directory)?;
        let Record { finished, files: mut known, .. } =
            earlier(directory)?.unwrap_or(Record { format: Format::Run1, finished: true, files: Vec::new() });
        for &name in files {
            let is_known = known.iter().any(|known| known == name);
            check(directory, name, is_known)?;
            if !is_known {
                known.push(name.to_owned());
            }
        }
        record(directory, finished, &known)?;
        Ok(Self { directory: directory.to_owned(), path: directory.to_owned(), files: known, _lock: lock })
    }

    /// Where the files are to be written.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder in which they are in the end.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Ends the run, which wrote these of its files: they take the place of the earlier run's, which goes.
    ///
    /// # Errors
    /// [`ExportError::Io`] if a file cannot be moved or removed, or the record cannot be written: then what it names is what
    /// there may be.
    pub fn finish(self, written: &[String]) -> Result<(), ExportError> {
        let earlier = earlier(&self.directory)?.map_or(Vec::new(), |record| record.files);
        // From here to the next record there may be files of both.
        record(&self.directory, false, &union(&earlier, written))?;
        let replace = ExportError::io("replace an earlier run in", &self.directory);
        self.replace(&earlier, written).map_err(replace)?;
        record(&self.directory, true, written)
    }

    /// Moves what was written to its place, and removes what else is there of this run and the earlier one.
    fn replace(&self, earlier: &[String], written: &[String]) -> io::Result<()> {
        let mut known = union(earlier, written);
        known.push(RECORD.to_owned());
        // A file that takes the place of another does so at once.
        let is_replaced = |name: &&String| !name.ends_with('/') && written.contains(name);
        let goes: Vec<String> = earlier.iter().filter(|name| !is_replaced(name)).cloned().collect();
        clear(&self.directory, &goes, &known)?;
        for name in written {
            let [from, to] = [&self.path, &self.directory].map(|place| place.join(name.trim_end_matches('/')));
            move_to(&from, &to)?;
        }
        // What was of no use beyond this run, and what a killed one had left.
        let mut left = self.left().ok().unwrap_or_default();
        left.push(RECORD.to_owned());
        clear(&self.path, &left, &union(&left, &self.files))?;
        match fs::remove_dir(&self.path) {
            // Something that no run wrote is in it.
            Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => Ok(()),
            removed => removed,
        }
    }

    /// What a run that did not come to its end has left; nothing where there is none.
    fn left(&self) -> Result<Vec<String>, ExportError> {
        let taken = || ExportError::Taken { path: self.path.clone() };
        match self.path.symlink_metadata() {
            Ok(found) if found.is_dir() => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            _ => return Err(taken()),
        }
        if let Some(Record { files, .. }) = earlier(&self.path)? {
            return Ok(files);
        }
        // A run that was killed before it could say anything.
        let is_empty = fs::read_dir(&self.path).is_ok_and(|mut entries| entries.next().is_none());
        if is_empty { Ok(Vec::new()) } else { Err(taken()) }
    }
}

/// Names in either list.
fn union(names: &[String], more: &[String]) -> Vec<String> {
    names.iter().chain(more.iter().filter(|name| !names.contains(name))).cloned().collect()
}

/// What a run in `directory` wrote or was about to write; `None` where there is no record of any.
fn earlier(directory: &Path) -> Result<Option<Record>, ExportError> {
    let path = directory.join(RECORD);
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
fn check(directory: &Path, name: &str, is_known: bool) -> Result<(), ExportError> {
    let path = directory.join(name.trim_end_matches('/'));
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

fn record(directory: &Path, finished: bool, files: &[String]) -> Result<(), ExportError> {
    let record = Record { format: Format::Run1, finished, files: files.to_vec() };
    write_json(&directory.join(RECORD), &record)
}

/// Removes these files of a run, and all temporary files with the `known` names of a run's.
fn clear(directory: &Path, files: &[String], known: &[String]) -> io::Result<()> {
    for name in files {
        let path = directory.join(name.trim_end_matches('/'));
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
    for entry in fs::read_dir(directory)? {
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

/// Moves a file or a folder of frames to a place where there is nothing, or, of a folder, one with somebody's files.
fn move_to(from: &Path, to: &Path) -> io::Result<()> {
    if from.is_dir() && to.is_dir() {
        for entry in fs::read_dir(from)? {
            let entry = entry?;
            fs::rename(entry.path(), to.join(entry.file_name()))?;
        }
        return fs::remove_dir(from);
    }
    fs::rename(from, to)
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
