//! What can go wrong with a page.

use thiserror::Error;

/// Why a page was not written or not read back.
#[derive(Debug, Error)]
pub enum ReportError {
    /// A part of the page that cannot stand there.
    #[error("{id:?}: {message}")]
    Part {
        /// The id of a section, a figure or a table; "page" for the page itself.
        id: String,
        /// What is wrong with it, and what is allowed.
        message: String,
    },
    /// A file that cannot be written, or read.
    #[error(transparent)]
    File(#[from] export::ExportError),
}
