//! What a problem's tables are made of: names of columns, rows, and what stands in them.

use crate::answer::Equilibrium;
use crate::problem::Problem;

/// A problem whose queries and answers are tables.
pub trait Tabled: Problem {
    /// Where a file has the numbers of a query.
    type Columns;
    /// Shape of what an equilibrium has for each segment, but for the segments' own dimension: how many cables.
    const SHAPE: &'static [usize];

    /// Names of all columns that a file may have, in the order in which [`bytes`](super::bytes) writes them.
    fn names() -> Vec<String>;

    /// Finds the columns of a header.
    ///
    /// # Errors
    /// If one is missing or there twice.
    fn columns(header: &Header) -> Result<Self::Columns, String>;

    /// The query of a row, checked.
    ///
    /// # Errors
    /// The first thing found wrong.
    fn query(columns: &Self::Columns, row: &Row) -> Result<Self::Query, String>;

    /// The numbers of a query, as [`Self::names`] says; NaN where there is none.
    fn query_numbers(query: &Self::Query) -> Vec<f64>;

    /// Names of the columns of an answer after the first eight.
    fn answer_names() -> Vec<String>;

    /// Their numbers.
    fn answer_numbers(found: &Self::Equilibrium) -> Vec<f64>;

    /// Cables of an equilibrium.
    fn cables(found: &Self::Equilibrium) -> &[Equilibrium];
}

/// Names of a file's columns.
pub struct Header(pub(super) Vec<String>);

impl Header {
    /// Checks that all are known.
    pub(super) fn new(names: Vec<String>, known: &[String]) -> Result<Self, String> {
        match names.iter().find(|name| !known.contains(name)) {
            Some(name) => Err(format!("column `{name:.40}` is not known; there are {}", known.join(", "))),
            None => Ok(Self(names)),
        }
    }

    /// The column of this name, if there is one.
    pub(super) fn place(&self, name: &str) -> Result<Option<usize>, String> {
        let mut places = (0..self.0.len()).filter(|&k| self.0[k] == name);
        match (places.next(), places.next()) {
            (place, None) => Ok(place),
            _ => Err(format!("there are two columns `{name}`")),
        }
    }

    /// The column of this name, which must be there.
    pub(super) fn needed(&self, name: &str) -> Result<usize, String> {
        self.place(name)?.ok_or_else(|| format!("column `{name}` is missing"))
    }
}

/// A row of a file.
pub struct Row<'a> {
    pub(super) header: &'a Header,
    /// A column's number, nothing, or what stands there in the place of a number.
    pub(super) value: &'a dyn Fn(usize) -> Result<Option<f64>, String>,
}

impl Row<'_> {
    /// Whether there is anything in a column.
    pub(super) fn has(&self, column: usize) -> bool {
        !matches!((self.value)(column), Ok(None))
    }

    /// The number in a column.
    pub(super) fn number(&self, column: usize) -> Result<f64, String> {
        let wrong = |found: &str| format!("{} = {found}, but it must be a number", self.header.0[column]);
        (self.value)(column).map_err(|found| wrong(&found))?.ok_or_else(|| wrong("``"))
    }
}
