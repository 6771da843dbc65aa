//! Poses in the world.

use nalgebra::{UnitQuaternion, Vector3};

/// A pose in the world: position [m] and orientation (local z is the rod's axis d3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position [m].
    pub position: Vector3<f64>,
    /// Orientation.
    pub orientation: UnitQuaternion<f64>,
}
