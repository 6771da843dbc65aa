//! What counts: the iterations that a network's guess saves on validation scenes.

pub(crate) mod solves;
pub(crate) mod steps;

/// What is measured, in pairs.
pub(crate) struct Columns {
    /// One line about the ratios.
    pub(crate) about: &'static str,
    /// Of the two of a pair, in words.
    pub(crate) parts: [&'static str; 2],
    /// One a pair.
    pub(crate) pairs: Vec<Pair>,
}

/// Two ratios that belong together.
pub(crate) struct Pair {
    /// Short, for the head of a column.
    pub(crate) head: String,
    /// As in names of files' columns.
    pub(crate) name: String,
    /// Preconditioner, or "direct".
    pub(crate) solver: &'static str,
    /// Tolerance of each of the two.
    pub(crate) tolerances: [f64; 2],
}

/// Ratios, a pair for each of [`Columns::pairs`].
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Measured {
    pub(crate) pairs: Vec<[f64; 2]>,
    /// By what weights are chosen, the less the better.
    pub(crate) score: f64,
}
