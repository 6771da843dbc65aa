//! The linear solvers by name, and the sparse factor as one of them.

use std::fmt;
use std::str::FromStr;

use rod::Model;
use thiserror::Error;

use crate::linear::cg::{Cg, CgParams};
use crate::linear::direct::Direct;
use crate::linear::looped::Looped;
use crate::linear::precondition::{Frozen, PreconditionerKind};
use crate::linear::sparse::SparseError;
use crate::linear::{LinearInfo, LinearSolver, LinearStatus};
use crate::members::Members;
use crate::system::System;
use crate::topology::Topology;
use kernels::Spatial;

/// Which linear solver to use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SolverKind {
    /// Block elimination along the tree; sparse Cholesky where the graph has a loop.
    #[default]
    Direct,
    /// Sparse Cholesky, on any graph.
    Sparse,
    /// Preconditioned conjugate gradients, on any graph.
    Cg(CgParams),
}

/// Why a linear solver cannot be set up.
#[derive(Debug, Error, PartialEq)]
pub enum SolverError {
    /// The sparse factor cannot be had.
    #[error(transparent)]
    Sparse(#[from] SparseError),
}

impl SolverKind {
    /// Conjugate gradients with this preconditioner and default tolerance and cap.
    pub fn cg(preconditioner: PreconditionerKind) -> Self {
        Self::Cg(CgParams { preconditioner, ..CgParams::default() })
    }

    /// Its name in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            SolverKind::Direct => "direct",
            SolverKind::Sparse => "sparse",
            SolverKind::Cg(params) => match params.preconditioner {
                PreconditionerKind::Raw => "cg-raw",
                PreconditionerKind::Jacobi => "cg-jacobi",
                PreconditionerKind::BlockJacobi => "cg-block-jacobi",
                PreconditionerKind::Frozen => "cg-frozen",
            },
        }
    }

    /// A solver that factors the matrix of this connectivity; `None` where it does not factor.
    ///
    /// # Errors
    /// If the factor would be too large.
    pub fn factored(self, topology: &Topology) -> Result<Option<Box<dyn LinearSolver>>, SolverError> {
        let direct = if self == Self::Direct { Direct::new(topology) } else { None };
        match (self, direct) {
            (Self::Cg(_), _) => Ok(None),
            (_, Some(direct)) => Ok(Some(Box::new(direct))),
            (_, None) => Ok(Some(Box::new(Looped::new(topology)?))),
        }
    }

    /// Sets the solver up for one connected set of segments.
    ///
    /// # Errors
    /// If the solver cannot work on this graph.
    pub fn build(
        &self,
        model: &Model,
        members: &Members,
        topology: &Topology,
    ) -> Result<Box<dyn LinearSolver>, SolverError> {
        if let Some(solver) = self.factored(topology)? {
            return Ok(solver);
        }
        let params = if let Self::Cg(params) = *self { params } else { CgParams::default() };
        let frozen = match params.preconditioner {
            PreconditionerKind::Frozen => Some(Frozen::new(model, members, topology)?),
            _ => None,
        };
        Ok(Box::new(Cg::new(params, topology, frozen)))
    }
}

impl LinearSolver for Looped {
    fn solve(&mut self, system: &System<f64>, _has_start: bool, dlambda: &mut [Spatial<f64>]) -> LinearInfo {
        if self.factor(system).is_err() {
            dlambda.fill(Spatial::zero());
            return LinearInfo { status: LinearStatus::NotPositiveDefinite, ..LinearInfo::default() };
        }
        let q_a = |joint: usize| system.frame(joint);
        self.solve_factored(
            |joint| system.joints[joint].to_world(system.joints[joint].rhs, q_a(joint)),
            |joint, x| dlambda[joint] = system.joints[joint].multipliers_from_world(x, q_a(joint)),
        );
        LinearInfo::default()
    }

    fn uses_start(&self) -> bool {
        false
    }

    fn looped(&mut self) -> Option<&mut Looped> {
        Some(self)
    }
}

impl fmt::Display for SolverKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for SolverKind {
    type Err = String;

    /// "direct", "cg" (with the default preconditioner) or "cg-" and a preconditioner's name.
    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "direct" => return Ok(Self::Direct),
            "sparse" => return Ok(Self::Sparse),
            "cg" => return Ok(Self::Cg(CgParams::default())),
            _ => {}
        }
        let kind = name.strip_prefix("cg-").and_then(|kind| kind.parse().ok());
        kind.map(Self::cg).ok_or_else(|| {
            let names = PreconditionerKind::ALL.map(|kind| format!("cg-{kind}")).join(", ");
            format!("expected one of direct, sparse, cg, {names}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for kind in PreconditionerKind::ALL.map(SolverKind::cg).into_iter().chain([SolverKind::Direct]) {
            assert_eq!(kind.to_string().parse(), Ok(kind));
        }
        assert_eq!("cg".parse(), Ok(SolverKind::cg(PreconditionerKind::BlockJacobi)));
        assert!("cg-none".parse::<SolverKind>().unwrap_err().contains("cg-frozen"));
    }
}
