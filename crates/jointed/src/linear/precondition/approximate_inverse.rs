//! What a preconditioner does.

use crate::linear::operator::Operator;
use crate::system::System;
use kernels::Spatial;

/// `z = M^-1 r` with M standing in for A.
pub(super) trait Precondition {
    /// Takes over a system's matrix.
    fn prepare(&mut self, operator: &Operator, system: &System<f64>);

    /// `z = M^-1 r`; returns `r^T z`.
    fn apply(&mut self, system: &System<f64>, r: &[Spatial<f64>], z: &mut [Spatial<f64>]) -> f64;
}
