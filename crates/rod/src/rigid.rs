//! Rigid bodies that rods are joined to: weights, hooks, beams, balls.

use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use crate::mesh::{SIDES, capped};
use crate::{Mesh, SolidMesh};

/// Shape of a rigid body: what it looks like, and what touches. Its middle, of a mesh its centroid, is the body's centre of mass.
#[derive(Clone, Debug, PartialEq)]
pub enum BodyShape {
    /// Nothing that one sees or touches.
    Hidden,
    /// A full sphere.
    Sphere {
        /// Radius [m].
        radius: f64,
    },
    /// A full cylinder about the body's z axis with half spheres at its ends.
    Capsule {
        /// Radius [m].
        radius: f64,
        /// Length of the cylinder, without the half spheres [m].
        length: f64,
    },
    /// A full cylinder about the body's z axis.
    Cylinder {
        /// Radius [m].
        radius: f64,
        /// Length [m].
        length: f64,
    },
    /// A full box with its edges along the body's axes.
    Box {
        /// Lengths of its edges [m].
        sides: Vector3<f64>,
    },
    /// A surface of triangles, convex or not.
    Mesh(Arc<SolidMesh>),
}

impl BodyShape {
    /// Its surface, with vertices on it; nothing where hidden.
    pub fn mesh(&self) -> Mesh {
        match *self {
            BodyShape::Hidden => Mesh::default(),
            BodyShape::Sphere { radius } => Mesh::round(&capped(radius, 0.0), SIDES),
            BodyShape::Capsule { radius, length } => Mesh::round(&capped(radius, 0.5 * length), SIDES),
            BodyShape::Cylinder { radius, length } => Mesh::cylinder(radius, length, SIDES),
            BodyShape::Box { sides } => Mesh::of_box(&(sides * 0.5)),
            BodyShape::Mesh(ref solid) => solid.mesh().clone(),
        }
    }

    /// Volume [m^3]; 0 where hidden.
    pub fn volume(&self) -> f64 {
        let ball = |r: f64| 4.0 / 3.0 * PI * r.powi(3);
        match *self {
            BodyShape::Hidden => 0.0,
            BodyShape::Sphere { radius } => ball(radius),
            BodyShape::Capsule { radius, length } => ball(radius) + PI * radius.powi(2) * length,
            BodyShape::Cylinder { radius, length } => PI * radius.powi(2) * length,
            BodyShape::Box { sides } => sides.product(),
            BodyShape::Mesh(ref solid) => solid.volume(),
        }
    }

    /// Moments of inertia about the body's axes of 1 kg that fills it evenly [m^2]; 0 where hidden.
    pub fn inertia_per_mass(&self) -> Vector3<f64> {
        let round = |across: f64, along: f64| Vector3::new(across, across, along);
        match *self {
            BodyShape::Hidden => Vector3::zeros(),
            BodyShape::Sphere { radius } => Vector3::repeat(0.4 * radius.powi(2)),
            BodyShape::Cylinder { radius: r, length: l } => round((3.0 * r * r + l * l) / 12.0, 0.5 * r * r),
            BodyShape::Capsule { radius: r, length: l } => {
                let share = 4.0 / 3.0 * r / (4.0 / 3.0 * r + l);
                let ends = round(0.4 * r * r + 0.25 * l * l + 0.375 * l * r, 0.4 * r * r);
                let middle = BodyShape::Cylinder { radius: r, length: l }.inertia_per_mass();
                ends * share + middle * (1.0 - share)
            }
            BodyShape::Box { sides } => {
                let [x, y, z] = [0, 1, 2].map(|k| sides[k] * sides[k] / 12.0);
                Vector3::new(y + z, x + z, x + y)
            }
            BodyShape::Mesh(ref solid) => solid.inertia_per_mass(),
        }
    }

    /// Extent along the body's z axis and largest distance from that axis [m]; `None` where hidden.
    pub fn extents(&self) -> Option<(f64, f64)> {
        match *self {
            BodyShape::Hidden => None,
            BodyShape::Sphere { radius } => Some((2.0 * radius, radius)),
            BodyShape::Capsule { radius, length } => Some((length + 2.0 * radius, radius)),
            BodyShape::Cylinder { radius, length } => Some((length, radius)),
            BodyShape::Box { sides } => Some((sides.z, 0.5 * sides.xy().norm())),
            BodyShape::Mesh(ref solid) => Some(solid.extents()),
        }
    }

    /// A place in the axes in which the shape is given [m], in the body's frame [m]: of a mesh these are not the same.
    pub fn place(&self, place: &Vector3<f64>) -> Vector3<f64> {
        if let BodyShape::Mesh(solid) = self { solid.place(place) } else { *place }
    }

    /// Half the length of the axis and the radius [m] of the capsule that it is; `None` where it is none.
    pub fn capsule(&self) -> Option<(f64, f64)> {
        match *self {
            BodyShape::Sphere { radius } => Some((0.0, radius)),
            BodyShape::Capsule { radius, length } => Some((0.5 * length, radius)),
            BodyShape::Hidden | BodyShape::Cylinder { .. } | BodyShape::Box { .. } | BodyShape::Mesh(_) => None,
        }
    }

    /// Drag coefficient times area [m^2]: 0.47 of a sphere's section, and 1 of the mean section of the others, which is a
    /// quarter of the surface (Cauchy; of a mesh that is not convex this is too much). Coefficients are Hoerner's (1965), for Reynolds numbers of 1e4 to 2e5.
    pub fn drag_area(&self) -> f64 {
        match *self {
            BodyShape::Hidden => 0.0,
            BodyShape::Sphere { radius } => 0.47 * PI * radius.powi(2),
            BodyShape::Capsule { radius, length } => PI * radius * (radius + 0.5 * length),
            BodyShape::Cylinder { radius, length } => 0.5 * PI * radius * (radius + length),
            BodyShape::Box { sides } => 0.5 * (sides.x * sides.y + sides.y * sides.z + sides.z * sides.x),
            BodyShape::Mesh(ref solid) => 0.25 * solid.area(),
        }
    }

    /// What it is, in a word: "hidden", "sphere", "capsule", "cylinder", "box" or "mesh".
    pub fn kind(&self) -> &'static str {
        match self {
            BodyShape::Hidden => "hidden",
            BodyShape::Sphere { .. } => "sphere",
            BodyShape::Capsule { .. } => "capsule",
            BodyShape::Cylinder { .. } => "cylinder",
            BodyShape::Box { .. } => "box",
            BodyShape::Mesh(_) => "mesh",
        }
    }

    /// Its lengths [m], each with its name.
    pub(crate) fn sizes(&self) -> Vec<(&'static str, f64)> {
        match *self {
            BodyShape::Hidden | BodyShape::Mesh(_) => Vec::new(),
            BodyShape::Sphere { radius } => vec![("radius", radius)],
            BodyShape::Capsule { radius, length } | BodyShape::Cylinder { radius, length } => {
                vec![("radius", radius), ("length", length)]
            }
            BodyShape::Box { sides } => sides.iter().map(|&side| ("side", side)).collect(),
        }
    }
}

/// What makes a segment a rigid body instead of a piece of a rod. Its frame is the segment's, with the centre of mass as
/// origin and the principal axes of inertia as axes.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidBody {
    /// Mass [kg].
    pub mass: f64,
    /// Moments of inertia about its own axes [kg m^2].
    pub inertia: Vector3<f64>,
    /// Shape.
    pub shape: BodyShape,
    /// Whether it touches rods and obstacles, where the model has contacts. A hidden body touches nothing, and bodies do not
    /// touch each other.
    pub touches: bool,
    /// Drag coefficient times area [m^2], the same from all sides: in air the drag is half of this times density and
    /// square of the relative velocity of the centre.
    pub drag_area: f64,
}

impl RigidBody {
    /// A body of `mass` [kg] that fills its shape evenly; a hidden one and a mesh about a given centre have no inertia yet.
    pub fn new(shape: BodyShape, mass: f64) -> Self {
        let (inertia, drag_area) = (shape.inertia_per_mass() * mass, shape.drag_area());
        Self { mass, inertia, shape, touches: true, drag_area }
    }

    /// A hidden body of `mass` [kg] with these moments of inertia about its axes [kg m^2].
    pub fn hidden(mass: f64, inertia: Vector3<f64>) -> Self {
        Self { mass, inertia, shape: BodyShape::Hidden, touches: false, drag_area: 0.0 }
    }

    /// Length along its z axis and radius [m] by which it is measured as a segment: of a hidden one its diameter of gyration.
    pub(crate) fn size(&self) -> (f64, f64) {
        let hidden = || (self.inertia.max() / self.mass).sqrt();
        self.shape.extents().unwrap_or_else(|| (2.0 * hidden(), hidden()))
    }
}

/// How a joint holds on to rigid bodies: what places on axes alone do not tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount {
    /// Places (x, y) of the connectors across the axes of bodies a and b, in their frames [m].
    pub across: [Vector2<f64>; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moments of inertia per mass and volume by summation over a fine grid.
    fn summed(shape: &BodyShape, half: Vector3<f64>, holds: impl Fn(&Vector3<f64>) -> bool) {
        let n = 120;
        let (mut count, mut sum) = (0.0, Vector3::zeros());
        for k in 0..n * n * n {
            let cell = Vector3::new((k % n) as f64, (k / n % n) as f64, (k / n / n) as f64);
            let x = (cell.add_scalar(0.5) / n as f64 * 2.0).add_scalar(-1.0).component_mul(&half);
            if holds(&x) {
                count += 1.0;
                let s = x.component_mul(&x);
                sum += Vector3::new(s.y + s.z, s.x + s.z, s.x + s.y);
            }
        }
        let volume = count * 8.0 * half.product() / f64::from(n).powi(3);
        assert!((shape.volume() / volume - 1.0).abs() < 2e-3, "{shape:?}: {volume}");
        let error = (shape.inertia_per_mass() - sum / count).norm() / shape.inertia_per_mass().norm();
        assert!(error < 5e-3, "{shape:?}: {error}");
    }

    #[test]
    fn volumes_and_moments_of_inertia_are_those_of_the_shapes() {
        let (radius, length) = (0.3, 0.7);
        let half = |z: f64| Vector3::new(radius, radius, z);
        summed(&BodyShape::Sphere { radius }, half(radius), |x| x.norm() < radius);
        summed(&BodyShape::Cylinder { radius, length }, half(0.5 * length), |x| x.xy().norm() < radius);
        summed(&BodyShape::Capsule { radius, length }, half(0.5 * length + radius), |x| {
            let end = Vector3::z() * x.z.clamp(-0.5 * length, 0.5 * length);
            (x - end).norm() < radius
        });
        let sides = Vector3::new(0.2, 0.5, 1.1);
        summed(&BodyShape::Box { sides }, sides * 0.5, |_| true);
    }
}
