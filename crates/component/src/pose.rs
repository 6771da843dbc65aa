//! Poses of bodies.

use kernels::lane::Real;
use kernels::math::{Quat, Vec3};

/// Position and orientation of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyPose<T> {
    /// Position x [m].
    pub x: Vec3<T>,
    /// Orientation q.
    pub q: Quat<T>,
}

impl<T: Real> BodyPose<T> {
    /// The same pose in every lane.
    pub(crate) fn splat(pose: &BodyPose<f64>) -> Self {
        Self { x: Vec3::splat(pose.x), q: Quat::splat(pose.q) }
    }
}
