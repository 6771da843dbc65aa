//! Capsules and their boxes.

use nalgebra::Vector3;

/// All points within `radius` of a centre line. A line of length zero makes it a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// First end of the centre line [m].
    pub start: Vector3<f64>,
    /// Second end of the centre line [m].
    pub end: Vector3<f64>,
    /// Radius [m].
    pub radius: f64,
}

impl Capsule {
    /// The smallest box around the capsule, but for rounding.
    pub fn aabb(&self) -> Aabb {
        let radius = Vector3::repeat(self.radius);
        Aabb { min: self.start.inf(&self.end) - radius, max: self.start.sup(&self.end) + radius }
    }
}

/// A box along the axes, its faces included. `min <= max` must hold on each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner [m].
    pub min: Vector3<f64>,
    /// Upper corner [m].
    pub max: Vector3<f64>,
}

impl Aabb {
    /// Whether the boxes have a point in common; touching faces count.
    #[inline]
    pub fn overlaps(&self, other: &Aabb) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }

    /// The smallest box around both.
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }
}
