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
    /// The text of a card cannot be read.
    #[error("{}:{line}: {message}", file.display())]
    Text {
        /// The file.
        file: PathBuf,
        /// Line of the mistake, from 1.
        line: usize,
        /// The line, and what is wrong with it.
        message: String,
    },
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

impl From<export::SealedError> for CheckpointError {
    fn from(error: export::SealedError) -> Self {
        use export::SealedError::{Text, Value};
        match error {
            Text { file, line, message } => Self::Text { file, line, message },
            Value { file, key, value, allowed } => Self::Value { file, key: key.to_owned(), value, allowed },
        }
    }
}

impl CheckpointError {
    pub(super) fn value(file: &Path, key: impl Into<String>, value: impl ToString, allowed: impl Into<String>) -> Self {
        let (key, allowed) = (key.into(), allowed.into());
        Self::Value { file: file.to_owned(), key, value: value.to_string(), allowed }
    }

    pub(super) fn io(action: &'static str, file: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |cause| Self::Io { action, file: file.to_owned(), cause }
    }
}
