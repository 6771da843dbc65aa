//! Tables.

use crate::Conditions;

/// A table. Its first column names the rows.
#[derive(Clone, Debug)]
pub struct Table {
    /// Anchor in the page and name of the CSV file: a to z, 0 to 9, '-' and '_', unique in the page.
    pub id: String,
    /// A short title.
    pub title: String,
    /// What the table shows and how to read it, with inline marks (see [`crate::Block::Paragraph`]).
    pub caption: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows, each with as many cells as there are columns.
    pub rows: Vec<Vec<Cell>>,
    /// Under which conditions the numbers were measured.
    pub conditions: Conditions,
}

/// A column of a table.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its heading, with the unit.
    pub(crate) name: String,
    /// On which side its cells stand.
    pub(crate) class: &'static str,
}

impl Column {
    /// A column of text.
    pub fn text(name: impl Into<String>) -> Self {
        Self { name: name.into(), class: "left" }
    }

    /// A column of numbers.
    pub fn number(name: impl Into<String>) -> Self {
        Self { name: name.into(), class: "right" }
    }
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cell {
    pub(crate) text: String,
    /// How loudly it speaks.
    pub(crate) class: &'static str,
}

impl Cell {
    /// A bold cell: the best of a row, the number to look at.
    pub fn strong(text: impl Into<String>) -> Self {
        Self { text: text.into(), class: " strong" }
    }

    /// A grey cell: not measured, not applicable.
    pub fn muted(text: impl Into<String>) -> Self {
        Self { text: text.into(), class: " muted" }
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self { text: text.into(), class: "" }
    }
}
