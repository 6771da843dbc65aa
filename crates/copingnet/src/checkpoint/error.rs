//! What can be wrong with a checkpoint, and where.

use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why there is no checkpoint, or no training state.
#[derive(Debug, Error)]
pub enum CheckpointError {
    /// The operating system refused, or there is no form for the data in the file.
    #[error("cannot {action} {}: {cause}", file.display())]
    Io {
        /// What was tried: "read", "write".
        action: &'static str,
        /// The file.
        file: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A file was not written.
    #[error(transparent)]
    Write(#[from] export::ExportError),
    /// The text of a card cannot be read, is of another version, or was changed after it was written.
    #[error(transparent)]
    Sealed(#[from] export::SealedError),
    /// A value that is not allowed.
    #[error("{}: {key} = {value}, but it must be {allowed}", file.display())]
    Value {
        /// The file.
        file: PathBuf,
        /// The key, or the name of the tensor.
        key: String,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
}

impl CheckpointError {
    /// A value that must not stand there; `allowed` says what may.
    pub fn value(file: &Path, key: impl Into<String>, value: impl ToString, allowed: impl Into<String>) -> Self {
        let (key, allowed) = (key.into(), allowed.into());
        Self::Value { file: file.to_owned(), key, value: value.to_string(), allowed }
    }

    pub(super) fn io(action: &'static str, file: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |cause| Self::Io { action, file: file.to_owned(), cause }
    }
}
