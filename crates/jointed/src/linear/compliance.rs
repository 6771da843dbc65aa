//! How a connected set's bodies answer forces from outside: by transfers along chains and trees, by products with a sparse factor
//! where joints form loops.

mod loops;

use std::sync::Arc;

use self::loops::Loops;
use crate::linear::articulated::{Articulated, Side};
use crate::linear::looped::Looped;
use crate::linear::sparse::SparseError;
use crate::system::System;
use crate::topology::Topology;

/// Finds answers, with the memory for it.
pub enum Compliance {
    /// Bodies that move form chains and trees, or answer each for itself.
    Tree(Box<Articulated>),
    /// They form loops.
    Looped(Box<Loops>),
}

impl Compliance {
    /// Memory for systems of this connectivity, whose bodies answer `with_joints` or each for itself.
    ///
    /// # Errors
    /// If the factor would be too large.
    pub fn new(system: &System<f64>, with_joints: bool) -> Result<Self, SparseError> {
        Ok(match Articulated::new(&system.topology, with_joints) {
            Some(transfers) => Compliance::Tree(Box::new(transfers)),
            None => Compliance::Looped(Box::new(Loops::new(&system.topology)?)),
        })
    }

    /// Whether it is of this connectivity.
    pub fn is_of(&self, topology: &Arc<Topology>) -> bool {
        match self {
            Compliance::Tree(transfers) => transfers.is_of(topology),
            Compliance::Looped(loops) => loops.is_of(topology),
        }
    }

    /// The work that unit forces of the `sides` do on each other's answers, with a system's matrix: for each pair that is
    /// coupled, `block(s, t, b)` gets `b[r][c] = f_s,r . P f_t,c`, for one of its two orders. Two sides of one contact may
    /// come as one, under the number of the first. `solver` is that of the system, if it has a sparse factor: it need not be made twice.
    pub fn couple(
        &mut self,
        system: &System<f64>,
        solver: Option<&mut Looped>,
        sides: &[Side],
        block: impl FnMut(usize, usize, [[f64; 3]; 3]),
    ) {
        match self {
            Compliance::Tree(transfers) => transfers.couple(system, sides, block),
            Compliance::Looped(loops) => loops.couple(system, solver, sides, block),
        }
    }
}
