//! What takes the place of the sparse factor in builds without it: it cannot be made.

use super::{B, C, Entries, SparseError};

/// No factor: there is no value of this type.
pub enum SparseCholesky {}

impl SparseCholesky {
    /// Refuses.
    ///
    /// # Errors
    /// [`SparseError::Feature`].
    pub(crate) fn new(_blocks: usize, _pairs: &[(u32, u32)]) -> Result<Self, SparseError> {
        Err(SparseError::Feature)
    }

    /// See the factor itself.
    ///
    /// # Errors
    /// None: there is no factor.
    pub(crate) fn factor(&mut self, _diag: &[[[f64; B]; B]], _off: &[[[f64; B]; B]]) -> Result<(), SparseError> {
        match *self {}
    }

    /// See the factor itself.
    pub(crate) fn solve(&mut self, _rhs: &mut [[f64; B]]) {
        match *self {}
    }
}

/// No products: there is no factor.
#[derive(Clone, Debug, Default)]
pub struct Products;

impl Products {
    /// See the products themselves.
    pub(crate) fn new(cholesky: &SparseCholesky) -> Self {
        match *cholesky {}
    }

    /// See the products themselves.
    pub(crate) fn find(&mut self, cholesky: &SparseCholesky, _groups: usize, _entries: &[Entries]) {
        match *cholesky {}
    }

    /// See the products themselves.
    pub(crate) fn block(&self, _group: usize, _other: usize) -> [[f64; C]; C] {
        [[0.0; C]; C]
    }
}
