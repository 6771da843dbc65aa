//! Surfaces as triangles: those of rigid bodies and obstacles for drawing, and those that segments touch.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

/// Vertices about the axis of a round shape, and from its equator to a pole.
pub(crate) const SIDES: usize = 32;
const RINGS: usize = 8;

/// A surface in the frame of what it is of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Places of the vertices [m]; at an edge of the shape there is one for each of its faces.
    pub positions: Vec<Vector3<f64>>,
    /// Unit normals out of it, one a vertex.
    pub normals: Vec<Vector3<f64>>,
    /// Vertices of each triangle, counterclockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Why triangles are no surface.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MeshError {
    /// A place is not finite.
    #[error("vertex {0} is not finite")]
    NotFinite(usize),
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} has a vertex {vertex}, but there are {count}")]
    NoVertex {
        /// Index of the triangle.
        triangle: usize,
        /// Index of the vertex.
        vertex: u32,
        /// Vertices that there are.
        count: usize,
    },
    /// No triangle has an area.
    #[error("there is no triangle with an area")]
    Empty,
}

/// A place on the outline of a round shape, and the latitude of the normal there [rad].
pub(crate) struct Profile {
    radius: f64,
    height: f64,
    latitude: f64,
}

/// Outline of a sphere whose halves are pulled apart along the axis, from below.
pub(crate) fn capped(radius: f64, half: f64) -> Vec<Profile> {
    let at = |k: usize, side: f64| {
        let latitude = FRAC_PI_2 * side * k as f64 / RINGS as f64;
        let across = if k == RINGS { 0.0 } else { radius * latitude.cos() };
        Profile { radius: across, height: half * side + radius * latitude.sin(), latitude }
    };
    let first = usize::from(half == 0.0);
    (0..=RINGS).rev().map(|k| at(k, -1.0)).chain((first..=RINGS).map(|k| at(k, 1.0))).collect()
}

impl Mesh {
    /// The surface of triangles, with the mean normals of the triangles about each vertex. Triangles without an area, or one
    /// that no number holds, are left out.
    ///
    /// # Errors
    /// [`MeshError`] where a vertex is not finite or not there, or no triangle is left.
    pub fn new(positions: Vec<Vector3<f64>>, mut triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let count = positions.len();
        if let Some(index) = positions.iter().position(|place| !place.iter().all(|x| x.is_finite())) {
            return Err(MeshError::NotFinite(index));
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&vertex| vertex as usize >= count) {
                return Err(MeshError::NoVertex { triangle, vertex, count });
            }
        }
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|i| positions[i as usize]);
            (b - a).cross(&(c - a))
        };
        triangles.retain(|triangle| (f64::MIN_POSITIVE..f64::INFINITY).contains(&area(triangle).norm()));
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        let mut normals = vec![Vector3::zeros(); count];
        for triangle in &triangles {
            triangle.iter().for_each(|&i| normals[i as usize] += area(triangle));
        }
        normals.iter_mut().for_each(|normal| *normal = normal.try_normalize(0.0).unwrap_or_else(Vector3::z));
        Ok(Self { positions, normals, triangles })
    }

    /// The surface of a cylinder about the z axis whose round side is made of `sides` flat ones.
    pub fn cylinder(radius: f64, length: f64, sides: usize) -> Self {
        let end = |side: f64| {
            [(0.0, FRAC_PI_2), (radius, FRAC_PI_2), (radius, 0.0)].map(|(r, latitude)| Profile {
                radius: r,
                height: 0.5 * length * side,
                latitude: latitude * side,
            })
        };
        let [top, bottom] = [end(1.0), end(-1.0)];
        Self::round(&bottom.into_iter().chain(top.into_iter().rev()).collect::<Vec<_>>(), sides)
    }

    /// The surface, turned about the origin.
    pub fn turned(mut self, turn: &UnitQuaternion<f64>) -> Self {
        self.positions.iter_mut().chain(&mut self.normals).for_each(|vector| *vector = turn * *vector);
        self
    }

    /// The surface that an outline makes, turned about the axis.
    pub(crate) fn round(outline: &[Profile], sides: usize) -> Self {
        let mut mesh = Self::default();
        for (k, Profile { radius, height, latitude }) in outline.iter().enumerate() {
            for side in 0..=sides {
                // The first and the last side meet in the same places.
                let (sin, cos) = (TAU * (side % sides) as f64 / sides as f64).sin_cos();
                let outwards = Vector3::new(cos, sin, 0.0);
                mesh.positions.push(outwards * *radius + Vector3::z() * *height);
                mesh.normals.push(outwards * latitude.cos() + Vector3::z() * latitude.sin());
                if k > 0 && side > 0 {
                    let here = (k * (sides + 1) + side) as u32;
                    let below = here - sides as u32 - 1;
                    mesh.quad([below - 1, below, here, here - 1]);
                }
            }
        }
        mesh
    }

    pub(crate) fn of_box(half: &Vector3<f64>) -> Self {
        let mut mesh = Self::default();
        for (axis, side) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
            let normal = Vector3::ith(axis, side);
            let u = Vector3::ith((axis + 1) % 3, 1.0);
            let v = normal.cross(&u);
            let first = mesh.positions.len() as u32;
            for corner in [-u - v, u - v, u + v, v - u] {
                mesh.positions.push((corner + normal).component_mul(half));
                mesh.normals.push(normal);
            }
            mesh.quad([first, first + 1, first + 2, first + 3]);
        }
        mesh
    }

    /// Two triangles of four corners, without those that have no area.
    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        for triangle in [[a, b, c], [a, c, d]] {
            let [p, q, r] = triangle.map(|i| self.positions.get(i as usize).copied().unwrap_or_default());
            if p != q && q != r && r != p {
                self.triangles.push(triangle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyShape;

    /// Volume enclosed by the triangles, by the divergence theorem: positive where they look outwards.
    fn volume(mesh: &Mesh) -> f64 {
        let of = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            a.dot(&b.cross(&c)) / 6.0
        };
        mesh.triangles.iter().map(of).sum()
    }

    #[test]
    fn meshes_enclose_the_shapes_and_look_outwards() {
        let (radius, length) = (0.3, 0.8);
        let shapes = [
            (BodyShape::Sphere { radius }, 0.02),
            (BodyShape::Capsule { radius, length }, 0.02),
            (BodyShape::Cylinder { radius, length }, 0.01),
            (BodyShape::Box { sides: Vector3::new(0.2, 0.5, 1.1) }, 1e-12),
        ];
        for (shape, error) in shapes {
            let turn = UnitQuaternion::new(Vector3::new(1.0, -2.0, 0.5));
            for mesh in [shape.mesh(), shape.mesh().turned(&turn)] {
                let short = 1.0 - volume(&mesh) / shape.volume();
                assert!((-1e-12..error).contains(&short), "{shape:?}: {short}");
                for triangle in &mesh.triangles {
                    let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
                    let normal = (b - a).cross(&(c - a));
                    assert!(triangle.iter().all(|&i| mesh.normals[i as usize].dot(&normal) > 0.0), "{shape:?}");
                }
                assert!(mesh.normals.iter().all(|normal| (normal.norm() - 1.0).abs() < 1e-12));
            }
        }
        assert_eq!(BodyShape::Hidden.mesh(), Mesh::default());
    }
}
