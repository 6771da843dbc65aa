//! What can go wrong between a run and its files.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::sealed::printable;
use crate::{Format, SealedError};

/// Why a file was not written or not read.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The operating system refused: no permission, disk full, no such directory, or data that cannot be put into the
    /// format.
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        /// What was tried: "write", "read", "create the directory".
        action: &'static str,
        /// The file or directory.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
    /// Another run writes into the folder.
    #[error("another run is writing into {}: wait for its end, or choose another folder", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// Something that no run wrote stands where a run's file must go.
    #[error("{} is in the way and is not from an earlier run: move it, or choose another folder", path.display())]
    Taken {
        /// What stands there.
        path: PathBuf,
    },
    /// The file is not what a run wrote, or not as it was written.
    #[error("{} is damaged or not from a run: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        reason: String,
    },
    /// The arrays of a state, or the segments given, are not as many as the trajectory's.
    #[error("{found} segments for a trajectory of {expected}")]
    Segments {
        /// Segments found.
        found: usize,
        /// Segments expected.
        expected: usize,
    },
    /// The joints given are not as many as those whose forces the trajectory keeps.
    #[error("{found} joints for a trajectory with the forces of {expected}")]
    Joints {
        /// Joints found.
        found: usize,
        /// Joints expected.
        expected: usize,
    },
    /// A format cannot hold what is to be exported.
    #[error("{format} cannot hold this: {reason}")]
    Format {
        /// The format.
        format: Format,
        /// What is too large or missing, and what is allowed.
        reason: String,
    },
    /// The text of a file cannot be read, is of another version or was changed, or a value in a file is not allowed.
    #[error(transparent)]
    Sealed(#[from] SealedError),
    /// There is no such frame.
    #[error("frame {frame} does not exist, the trajectory has {frames}")]
    NoFrame {
        /// Frame asked for.
        frame: usize,
        /// Frames there are.
        frames: usize,
    },
}

impl ExportError {
    /// An [`ExportError::Io`] to be made from the system's error.
    pub fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |cause| Self::Io { action, path: path.to_owned(), cause }
    }

    /// A value in a file that must not stand there; `allowed` says what may. Control characters of a damaged file are
    /// replaced, so that the message is one line.
    pub fn value(file: &Path, key: impl Into<String>, value: impl ToString, allowed: impl Into<String>) -> Self {
        let (key, value) = (printable(&key.into()), printable(&value.to_string()));
        Self::Sealed(SealedError::Value { file: file.to_owned(), key, value, allowed: allowed.into() })
    }

    pub(crate) fn damaged(path: &Path, reason: impl Into<String>) -> Self {
        Self::Damaged { path: path.to_owned(), reason: reason.into() }
    }
}
