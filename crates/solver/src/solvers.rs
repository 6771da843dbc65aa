//! The linear solvers by name.

use rod::Model;
use thiserror::Error;

use crate::component::Members;
use crate::direct::Direct;
use crate::linear::LinearSolver;
use crate::looped::Looped;
use crate::sparse::SparseError;
use crate::topology::Topology;

/// Which linear solver to use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SolverKind {
    /// Block elimination along the tree; sparse Cholesky where the graph has a loop.
    #[default]
    Direct,
}

/// Why a linear solver cannot be set up.
#[derive(Debug, Error)]
pub enum SolverError {
    /// The sparse factor cannot be had.
    #[error(transparent)]
    Sparse(#[from] SparseError),
}

impl SolverKind {
    /// Sets the solver up for one connected set of segments.
    ///
    /// # Errors
    /// If the solver does not fit the graph.
    pub fn build(
        &self,
        _model: &Model,
        _members: &Members,
        topology: &Topology,
    ) -> Result<Box<dyn LinearSolver>, SolverError> {
        match self {
            SolverKind::Direct => match Direct::new(topology) {
                Some(direct) => Ok(Box::new(direct)),
                None => Ok(Box::new(Looped::new(topology)?)),
            },
        }
    }
}
