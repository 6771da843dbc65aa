//! The state: what moves.

use nalgebra::{UnitQuaternion, Vector3};

use crate::InternalVariables;

/// What moves: arrays with one entry a segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Positions of the centres x [m].
    pub positions: Vec<Vector3<f64>>,
    /// Orientations q; local z is the rod's axis d3.
    pub orientations: Vec<UnitQuaternion<f64>>,
    /// Velocities v [m/s].
    pub velocities: Vec<Vector3<f64>>,
    /// Angular velocities w in world axes [rad/s], angle over time also where a segment turns far in a step.
    pub angular_velocities: Vec<Vector3<f64>>,
    /// What joints with laws remember, in the order of [`crate::Model::laws`]; empty before the first step.
    pub internals: Vec<InternalVariables>,
}

impl State {
    /// Number of segments.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no segment.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Axis d3 of segment `i`.
    pub fn axis(&self, i: usize) -> Vector3<f64> {
        self.orientations[i] * Vector3::z()
    }
}
