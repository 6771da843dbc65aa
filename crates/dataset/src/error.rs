//! What can be wrong with a data set, and where.

use std::path::Path;

use export::{ExportError, SealedError};
use thiserror::Error;

/// Why there is no data set.
#[derive(Debug, Error)]
pub enum DatasetError {
    /// A file was not written or not read, or a value in it is not allowed.
    #[error(transparent)]
    File(#[from] ExportError),
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
        Self::File(ExportError::value(file, key, value, allowed))
    }

    pub(crate) fn io(action: &'static str, file: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |cause| Self::File(ExportError::io(action, file)(cause))
    }

    /// Whether a file says that it is of another version of the format.
    pub(crate) fn is_other_schema(&self) -> bool {
        matches!(self, Self::File(ExportError::Sealed(SealedError::Value { key, value, .. }))
            if key == "schema_version" && value != "missing")
    }
}
