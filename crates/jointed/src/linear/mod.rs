//! The linear solvers, and the seam between them and the outer loop.

pub mod articulated;
pub mod cg;
pub mod compliance;
pub mod direct;
mod dual;
mod info;
pub mod looped;
pub mod operator;
pub mod precondition;
pub mod solvers;
pub mod sparse;

pub use info::{LinearInfo, LinearStatus};

use self::looped::Looped;
use crate::system::System;
use kernels::Spatial;
use kernels::lane::Real;

/// Solves `A dlambda = b`.
pub trait LinearSolver<T: Real = f64>: Send + Sync {
    /// Solves `system` into `dlambda` (one entry a joint), which holds the start when `has_start` and anything otherwise.
    fn solve(&mut self, system: &System<T>, has_start: bool, dlambda: &mut [Spatial<T>]) -> LinearInfo;

    /// Whether a start makes a difference.
    fn uses_start(&self) -> bool;

    /// The sparse factor that it solves with, if it does.
    fn looped(&mut self) -> Option<&mut Looped> {
        None
    }
}
