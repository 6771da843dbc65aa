//! Preconditioners of the conjugate gradients: what stands in for A^-1.

mod approximate_inverse;
mod frozen;
mod local;

use names::names;

use crate::linear::operator::Operator;
use crate::system::System;
use crate::topology::Topology;
use kernels::Spatial;

use approximate_inverse::Precondition;
pub use frozen::Frozen;
use local::{BlockJacobi, Jacobi, Raw};

/// Which preconditioner to use. Each is symmetric and positive definite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PreconditionerKind {
    /// None: SI units as they are, metres beside 1/metres.
    Raw,
    /// The diagonal of A.
    Jacobi,
    /// The 6x6 blocks on the diagonal of A.
    #[default]
    BlockJacobi,
    /// The factor of the rest shape, turned along with the segments.
    Frozen,
}

names!(PreconditionerKind { Raw = "raw", Jacobi = "jacobi", BlockJacobi = "block-jacobi", Frozen = "frozen" });

/// A preconditioner of a chosen kind, with its memory.
pub struct Preconditioner(Chosen);

enum Chosen {
    Raw(Raw),
    Jacobi(Jacobi),
    BlockJacobi(BlockJacobi),
    Frozen(Box<Frozen>),
}

impl Preconditioner {
    /// Memory for systems of this connectivity. `frozen` holds the rest shape where the kind needs it; without it, the
    /// 6x6 blocks take its place.
    pub fn new(kind: PreconditionerKind, topology: &Topology, frozen: Option<Frozen>) -> Self {
        let joints = topology.joints.len();
        Self(match (kind, frozen) {
            (PreconditionerKind::Raw, _) => Chosen::Raw(Raw),
            (PreconditionerKind::Jacobi, _) => Chosen::Jacobi(Jacobi::new(joints)),
            (PreconditionerKind::Frozen, Some(frozen)) => Chosen::Frozen(Box::new(frozen)),
            (PreconditionerKind::BlockJacobi | PreconditionerKind::Frozen, _) => {
                Chosen::BlockJacobi(BlockJacobi::new(joints))
            }
        })
    }

    /// Takes over a system's matrix, which `operator` holds already.
    #[inline(always)]
    pub fn prepare(&mut self, operator: &Operator, system: &System<f64>) {
        match &mut self.0 {
            Chosen::Raw(m) => m.prepare(operator, system),
            Chosen::Jacobi(m) => m.prepare(operator, system),
            Chosen::BlockJacobi(m) => m.prepare(operator, system),
            Chosen::Frozen(m) => m.prepare(operator, system),
        }
    }

    /// `z = M^-1 r`, one entry a joint; returns `r^T z`.
    #[inline(always)]
    pub fn apply(&mut self, system: &System<f64>, r: &[Spatial<f64>], z: &mut [Spatial<f64>]) -> f64 {
        match &mut self.0 {
            Chosen::Raw(m) => m.apply(system, r, z),
            Chosen::Jacobi(m) => m.apply(system, r, z),
            Chosen::BlockJacobi(m) => m.apply(system, r, z),
            Chosen::Frozen(m) => m.apply(system, r, z),
        }
    }
}
