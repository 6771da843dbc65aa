//! Rigid bodies as surfaces.

use nalgebra::Vector3;
use rod::{Mesh, Model, State};

/// A rigid body's surface.
pub(super) struct Solid {
    /// The segment that it is.
    pub(super) segment: usize,
    /// In the body's frame.
    pub(super) mesh: Mesh,
}

impl Solid {
    /// Those of a model that are not hidden.
    pub(super) fn all(model: &Model) -> Vec<Self> {
        let solid = |(segment, own): (usize, &rod::Segment)| {
            let mesh = own.body?.shape.mesh();
            (!mesh.triangles.is_empty()).then_some(Self { segment, mesh })
        };
        model.segments.iter().enumerate().filter_map(solid).collect()
    }

    /// Places of the vertices in the world [m].
    pub(super) fn places(&self, state: &State) -> impl Iterator<Item = Vector3<f64>> {
        let (position, orientation) = (state.positions[self.segment], state.orientations[self.segment]);
        self.mesh.positions.iter().map(move |place| position + orientation * place)
    }
}
