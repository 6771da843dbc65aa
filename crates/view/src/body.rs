//! Rigid bodies as they stand in a run's JSON.

use rod::{Mesh, Model};
use serde::{Deserialize, Serialize};

use crate::DecodeError;

/// The surfaces of a model's rigid bodies; bodies of the same shape share one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Bodies {
    /// Segments that are rigid bodies.
    segment: Vec<usize>,
    /// Which of the surfaces each has.
    surface: Vec<usize>,
    surfaces: Vec<Surface>,
}

/// Triangles in the frame of what they are of; none where nothing is to be seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Surface {
    /// Places [m] and unit normals of the vertices, three numbers each.
    positions: Vec<f32>,
    normals: Vec<f32>,
    /// Vertices of each triangle.
    triangles: Vec<u32>,
}

impl From<&Mesh> for Surface {
    fn from(mesh: &Mesh) -> Self {
        let floats = |vectors: &[nalgebra::Vector3<f64>]| {
            vectors.iter().flat_map(|v| [v.x as f32, v.y as f32, v.z as f32]).collect()
        };
        Self {
            positions: floats(&mesh.positions),
            normals: floats(&mesh.normals),
            triangles: mesh.triangles.as_flattened().to_vec(),
        }
    }
}

impl Surface {
    /// Whether its triangles are triangles of its vertices.
    pub(crate) fn fits(&self) -> bool {
        let Surface { positions, normals, triangles } = self;
        let vertices = positions.len() / 3;
        positions.len() == 3 * vertices
            && normals.len() == positions.len()
            && positions.iter().chain(normals).all(|x| x.is_finite())
            && triangles.len().is_multiple_of(3)
            && triangles.iter().all(|&vertex| (vertex as usize) < vertices)
    }
}

impl Bodies {
    /// Those of `model`.
    pub(crate) fn new(model: &Model) -> Self {
        let mut bodies = Self::default();
        let mut shapes = Vec::new();
        for (segment, own) in model.segments.iter().enumerate() {
            let Some(body) = &own.body else { continue };
            let known = shapes.iter().position(|shape| *shape == body.shape);
            bodies.segment.push(segment);
            bodies.surface.push(known.unwrap_or(shapes.len()));
            if known.is_none() {
                shapes.push(body.shape.clone());
                bodies.surfaces.push(Surface::from(&body.shape.mesh()));
            }
        }
        bodies
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.segment.is_empty()
    }

    /// Checks that they are bodies of a run of so many `segments`.
    pub(crate) fn validate(&self, segments: usize) -> Result<(), DecodeError> {
        let is_known = self.segment.len() == self.surface.len()
            && self.segment.iter().all(|&segment| segment < segments)
            && self.surface.iter().all(|&surface| surface < self.surfaces.len());
        if is_known && self.surfaces.iter().all(Surface::fits) {
            return Ok(());
        }
        Err(DecodeError::new("bodies", "each must be a segment with a surface of triangles"))
    }
}
