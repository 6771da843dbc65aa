//! What can be wrong with a data set, and where.

use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why there is no data set.
#[derive(Debug, Error)]
pub enum DatasetError {
    /// The operating system refused.
    #[error("cannot {action} {}: {cause}", file.display())]
    Io {
        /// What was tried: "read", "map", "create the directory".
        action: &'static str,
        /// The file or directory.
        file: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A file was not written.
    #[error(transparent)]
    Write(#[from] export::ExportError),
    /// The text of a manifest cannot be read, is of another version, or was changed after it was written.
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
    /// A setting that is not allowed.
    #[error("setting {key} = {value}, but it must be {allowed}")]
    Setting {
        /// The setting.
        key: &'static str,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A trajectory cannot be recorded.
    #[error("trajectory {index}: {message}")]
    Trajectory {
        /// Its index.
        index: u64,
        /// What is wrong.
        message: String,
    },
}

impl DatasetError {
    pub(crate) fn value(file: &Path, key: impl Into<String>, value: impl ToString, allowed: impl Into<String>) -> Self {
        let (key, allowed) = (key.into(), allowed.into());
        Self::Value { file: file.to_owned(), key, value: value.to_string(), allowed }
    }

    /// Whether a file says that it is of another version of the format.
    pub(crate) fn is_other_schema(&self) -> bool {
        use export::SealedError::Value;
        matches!(self, Self::Sealed(Value { key: "schema_version", value, .. }) if value != "missing")
    }

    pub(crate) fn io(action: &'static str, file: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |cause| Self::Io { action, file: file.to_owned(), cause }
    }
}
