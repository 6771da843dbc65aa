//! What can be wrong with a file.

use thiserror::Error;

pub(crate) type Result<T> = std::result::Result<T, MjcfError>;

/// Why there is no scene.
#[derive(Debug, Error)]
pub enum MjcfError {
    /// A file cannot be read.
    #[error("cannot read {file}{by}: {source}")]
    Read {
        /// The file.
        file: String,
        /// Where it is named, in words; empty for the first one.
        by: String,
        /// The reason.
        source: std::io::Error,
    },
    /// Something is wrong, or is not understood.
    #[error("{file}:{line}: {message}")]
    Invalid {
        /// The file.
        file: String,
        /// Line of the mistake, from 1.
        line: usize,
        /// The element, the attribute, its value, and what is allowed.
        message: String,
    },
}
