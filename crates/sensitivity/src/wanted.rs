//! What a gradient is asked for.

use nalgebra::Vector3;

/// A shift and a turn.
pub(super) type Pair = [Vector3<f64>; 2];

/// What a gradient is asked for beyond the first state and held bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Joints: compliances, rest shapes, inner damping.
    pub joints: bool,
    /// Segments: masses and inertias.
    pub segments: bool,
    /// Loads.
    pub loads: bool,
    /// Gravity, damping and the air.
    pub surroundings: bool,
    /// Obstacles: where they are at the start and at the end of each step.
    pub obstacles: bool,
}

impl Wanted {
    /// All of it.
    pub const ALL: Self = Self { joints: true, segments: true, loads: true, surroundings: true, obstacles: true };
}
