//! What can be wrong with a recorded run.

use std::path::PathBuf;

use export::ExportError;
use thiserror::Error;

/// Why a run cannot be decoded: what does not fit, and where.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{key}: {reason}")]
pub struct DecodeError {
    /// Where in the run: "time", "segments.length", "data".
    pub key: &'static str,
    /// What does not fit, and what is expected.
    pub reason: String,
}

impl DecodeError {
    pub(crate) fn new(key: &'static str, reason: impl Into<String>) -> Self {
        Self { key, reason: reason.into() }
    }
}

/// Why a run was not read from its file or not written.
#[derive(Debug, Error)]
pub enum ViewError {
    /// The system refused.
    #[error(transparent)]
    File(#[from] ExportError),
    /// The file is no recorded run, or a damaged one.
    #[error("{} is damaged or not a recorded run: {reason}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        reason: String,
    },
}
