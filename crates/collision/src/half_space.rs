//! Capsules above a plane.

use nalgebra::Vector3;

use crate::shape::Capsule;

/// All points x with normal . x <= offset, a ground with its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Unit normal, out of the ground.
    pub normal: Vector3<f64>,
    /// Distance of the surface from the origin along the normal [m].
    pub offset: f64,
}

/// The point of a capsule's surface that is lowest below an end of its centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowestPoint {
    /// The point [m].
    pub point: Vector3<f64>,
    /// Its height above the surface [m], negative inside the ground.
    pub height: f64,
}

impl HalfSpace {
    /// Height of a point above the surface [m], negative inside the ground.
    pub fn height(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// The lowest points at the start and at the end of a capsule. The lower one is the lowest of the whole capsule, and
    /// if both are above the ground, so is all of it.
    pub fn lowest_points(&self, capsule: &Capsule) -> [LowestPoint; 2] {
        [capsule.start, capsule.end].map(|end| LowestPoint {
            point: end - self.normal * capsule.radius,
            height: self.height(&end) - capsule.radius,
        })
    }
}
