//! The factor of the rest shape, turned along with the segments, applied to b.

use component::Component;
use jointed::linear::precondition::Frozen;
use kernels::Spatial;

use super::InitialGuess;

/// Starts linear solves from the solution of the rest shape's system. It has no memory.
pub struct FrozenGuess {
    frozen: Frozen,
}

impl FrozenGuess {
    /// A guess by this factor.
    pub(crate) fn new(frozen: Frozen) -> Self {
        Self { frozen }
    }
}

impl InitialGuess for FrozenGuess {
    fn helps_solves(&self) -> bool {
        true
    }

    fn start_solve(&mut self, component: &Component<f64>, _: usize, dlambda: &mut [Spatial<f64>]) -> bool {
        let system = &component.system;
        self.frozen.refresh(system);
        self.frozen.solve(
            system,
            #[inline(always)]
            |joint| system.joints[joint].rhs,
            dlambda,
        );
        true
    }
}
