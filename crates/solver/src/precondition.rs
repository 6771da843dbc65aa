//! Preconditioners of the conjugate gradients: what stands in for A^-1.

mod frozen;
mod local;

use std::fmt;
use std::str::FromStr;

use crate::system::{Six, System};

pub use frozen::Frozen;
pub(crate) use local::{BlockJacobi, Jacobi, Raw};

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
    /// The tree factor of the rest shape, turned along with the segments. Graphs without loops only.
    Frozen,
}

impl PreconditionerKind {
    /// All of them.
    pub const ALL: [PreconditionerKind; 4] = [Self::Raw, Self::Jacobi, Self::BlockJacobi, Self::Frozen];

    /// Its name in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Jacobi => "jacobi",
            Self::BlockJacobi => "block-jacobi",
            Self::Frozen => "frozen",
        }
    }
}

impl fmt::Display for PreconditionerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for PreconditionerKind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Self::name).join(", ");
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| format!("expected one of {}", names()))
    }
}

/// `z = M^-1 r` with M standing in for A.
pub(crate) trait Precondition {
    /// Takes over a system's matrix.
    fn prepare(&mut self, operator: &crate::operator::Operator, system: &System<f64>);

    /// `z = M^-1 r`; returns `r^T z`.
    fn apply(&mut self, system: &System<f64>, r: &[Six<f64>], z: &mut [Six<f64>]) -> f64;
}
