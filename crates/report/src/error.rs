//! What can go wrong with a page.

use thiserror::Error;

/// Why a page was not written or not read back.
#[derive(Debug, Error)]
pub enum ReportError {
    /// An id that cannot be a file's name everywhere.
    #[error("id {id:?}: allowed are a to z, 0 to 9, '-' and '_', beginning with a letter, at most 80 in all")]
    Id {
        /// The id of a section, a figure or a table.
        id: String,
    },
    /// An id that two parts of the page have.
    #[error("id {id:?}: more than one section, figure or table has it; ids must be unique in a page")]
    DuplicateId {
        /// The id.
        id: String,
    },
    /// A condition that says nothing.
    #[error("{id:?}: the condition {key:?} has the value {value:?}; neither may be empty")]
    EmptyCondition {
        /// The id of the figure or table; "page" for the page's own.
        id: String,
        /// The condition's key.
        key: String,
        /// The condition's value.
        value: String,
    },
    /// Rows, columns or parts that do not match.
    #[error("{id:?}: {what} has {found} entries instead of {expected}")]
    Shape {
        /// The id of the figure or table.
        id: String,
        /// Which list: "row 3", "values".
        what: String,
        /// Entries found.
        found: usize,
        /// Entries expected.
        expected: usize,
    },
    /// Values that have no form in CSV, or a CSV file that cannot be read.
    #[error("csv/{id}.csv: {cause}")]
    Csv {
        /// The id of the figure or table.
        id: String,
        /// What the CSV library says.
        cause: csv::Error,
    },
    /// A file that cannot be written, or read.
    #[error(transparent)]
    File(#[from] export::ExportError),
}
