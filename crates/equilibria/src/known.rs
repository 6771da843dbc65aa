//! Starts at equilibria that are known: where there is a history, the fastest ones.

use nalgebra::{UnitQuaternion, Vector3};

use crate::answer::Answer;
use crate::query::Query;
use crate::scaled::{Cut, Scaled};
use crate::start::Starts;

/// Turns of an equilibrium's segments, and the force on the first grip, over B / L^2; empty where nothing is known.
#[derive(Clone, Debug, Default)]
pub struct Known {
    /// Orientations of the segments.
    pub turns: Vec<UnitQuaternion<f64>>,
    /// The force on the first grip, with the sign of the pull along the cable.
    pub force: Vector3<f64>,
}

impl Known {
    /// Those of the lowest equilibrium; `None` where there is none.
    pub fn of(query: &Query, answer: &Answer) -> Option<Self> {
        let own = answer.equilibria.first()?;
        let unit = query.cable.bending[0].max(query.cable.bending[1]) / query.cable.length.powi(2);
        Some(Self { turns: own.orientations.clone(), force: own.grips[0].force / -unit })
    }

    /// Whether there is anything.
    pub fn is_known(&self) -> bool {
        !self.turns.is_empty()
    }
}

/// A start a query: as a rule the answer to the query before on a path. [`crate::Params::levels`] must be empty, as what is known
/// is so on the cable's own segments.
///
/// # Panics
/// In a search, if the number of turns is not that of the segments, or there are fewer starts than queries.
#[derive(Clone, Debug)]
pub struct Previous(pub Vec<Known>);

impl Starts for Previous {
    fn count(&self) -> usize {
        1
    }

    fn fill(
        &self,
        index: usize,
        _: &Scaled,
        _: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        forces: &mut [Vector3<f64>],
    ) -> usize {
        turns.copy_from_slice(&self.0[index].turns);
        forces[0] = self.0[index].force;
        1
    }
}
