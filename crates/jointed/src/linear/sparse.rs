//! The sparse factor of graphs with loops, with the cargo feature `sparse`; without it such graphs are refused.

#[cfg(feature = "sparse")]
mod cholesky;
#[cfg(not(feature = "sparse"))]
mod none;
#[cfg(feature = "sparse")]
mod products;

use thiserror::Error;

#[cfg(feature = "sparse")]
pub use cholesky::SparseCholesky;
#[cfg(not(feature = "sparse"))]
pub use none::{Products, SparseCholesky};
#[cfg(feature = "sparse")]
pub use products::Products;

/// Rows of a block: three of stretch-shear, three of bend-twist.
const B: usize = 6;

/// Columns of a group of them.
const C: usize = 3;

/// Entries of a group of columns in one block row.
#[derive(Clone, Copy, Debug)]
pub struct Entries {
    /// Number of the group.
    pub group: u32,
    /// The block row.
    pub block: u32,
    /// By column.
    pub columns: [[f64; B]; C],
}

/// Why a matrix has no factor.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SparseError {
    /// A pair does not name a block below the diagonal, or names one twice.
    #[error("pair {index} = ({row}, {col}): it must be row > col, inside of {blocks} block rows, and given only once")]
    Pair {
        /// Index into `pairs`.
        index: usize,
        /// Block row.
        row: u32,
        /// Block column.
        col: u32,
        /// Number of block rows.
        blocks: usize,
    },
    /// The number of blocks given is not that of the pattern.
    #[error("{found} {what} blocks for a pattern of {expected}")]
    BlockCount {
        /// "diagonal" or "off-diagonal".
        what: &'static str,
        /// Blocks found.
        found: usize,
        /// Blocks expected.
        expected: usize,
    },
    /// The matrix is not positive definite, or not finite.
    #[error("the matrix is not positive definite: a pivot of block row {block} is not a positive number")]
    NotPositiveDefinite {
        /// Block row at which the elimination broke down.
        block: usize,
    },
    /// The factor does not fit into memory, or its indices into 32 bits.
    #[error("the factor of {blocks} block rows is too large")]
    TooLarge {
        /// Number of block rows.
        blocks: usize,
    },
    /// The build has no sparse factor.
    #[error("rods that form loops need the cargo feature `sparse`")]
    Feature,
}
