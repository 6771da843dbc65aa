//! A branched query in units of the mean length L of its arms and the largest bending stiffness B: lengths in L, moments in
//! B / L, forces in B / L^2.

use nalgebra::{UnitQuaternion, Vector3};

pub use super::query::Junction;
use super::query::{ARMS, BranchedQuery, directions};
use crate::scaled::Scaled;

/// A branched query without units. The first grip is the origin.
#[derive(Clone, Copy, Debug)]
pub struct Star {
    /// The arms, but for their chords and second ends, in the star's units.
    pub arms: [Scaled; ARMS],
    /// Lengths of the arms.
    pub lengths: [f64; ARMS],
    /// Places of the grips.
    pub places: [Vector3<f64>; ARMS],
    /// Frames of the arms' ends in the junction's.
    pub directions: [UnitQuaternion<f64>; ARMS],
    /// L [m] and B [N m^2].
    pub units: [f64; 2],
}

impl Star {
    /// Takes the units off.
    pub fn new(query: &BranchedQuery) -> Self {
        let BranchedQuery { arms, grips } = query;
        let length = arms.iter().map(|cable| cable.length).sum::<f64>() / ARMS as f64;
        let bending = arms.iter().map(|cable| cable.bending[0].max(cable.bending[1])).fold(0.0, f64::max);
        let scaled = |k: usize| {
            let cable = &arms[k];
            Scaled {
                stiffness: [cable.bending[0], cable.bending[1], cable.torsion].map(|k| k / bending),
                rest: [0, 1, 2].map(|k| cable.rest[k] * length),
                weight: cable.weight * cable.length * length.powi(2) / bending,
                compliance: cable.stretch_compliance * bending / length.powi(3),
                carried: [cable.carried.weight * length.powi(2) / bending, cable.carried.place / cable.length],
                chord: Vector3::zeros(),
                ends: [grips[k].orientation; 2],
                held: true,
            }
        };
        Self {
            arms: [0, 1, 2].map(scaled),
            lengths: arms.map(|cable| cable.length / length),
            places: grips.map(|grip| (grip.position - grips[0].position) / length),
            directions: directions(),
            units: [length, bending],
        }
    }

    /// An arm with its second end at the junction, in units of its own length where it says how it lies: chord and rest shape.
    pub(crate) fn arm(&self, arm: usize, junction: &Junction) -> Scaled {
        let length = self.lengths[arm];
        let own = &self.arms[arm];
        Scaled {
            rest: own.rest.map(|x| x * length),
            chord: (junction.position - self.places[arm]) / length,
            ends: [own.ends[0], junction.orientation * self.directions[arm]],
            ..*own
        }
    }

    /// The junction in the query's units, from the query's origin.
    pub(crate) fn junction(&self, query: &BranchedQuery, own: &Junction) -> Junction {
        Junction { position: query.grips[0].position + own.position * self.units[0], ..*own }
    }
}
