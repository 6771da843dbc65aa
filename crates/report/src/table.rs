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
    pub name: String,
    /// Where its cells stand.
    pub align: Align,
}

impl Column {
    /// A column of text.
    pub fn text(name: impl Into<String>) -> Self {
        Self { name: name.into(), align: Align::Left }
    }

    /// A column of numbers.
    pub fn number(name: impl Into<String>) -> Self {
        Self { name: name.into(), align: Align::Right }
    }
}

/// Where the cells of a column stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// At the left, as text does.
    Left,
    /// At the right, as numbers do.
    Right,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cell {
    /// What it says.
    pub text: String,
    /// How loudly.
    pub emphasis: Emphasis,
}

impl Cell {
    /// A cell that stands out.
    pub fn strong(text: impl Into<String>) -> Self {
        Self { text: text.into(), emphasis: Emphasis::Strong }
    }

    /// A cell that stands back.
    pub fn muted(text: impl Into<String>) -> Self {
        Self { text: text.into(), emphasis: Emphasis::Muted }
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self { text: text.into(), emphasis: Emphasis::Plain }
    }
}

/// How loudly a cell speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Emphasis {
    /// As the others.
    Plain,
    /// Bold: the best of a row, the number to look at.
    Strong,
    /// Grey: not measured, not applicable.
    Muted,
}
