//! Points of the rods of sliding joints.

use nalgebra::Vector3;

use super::{Centreline, Share, SlidingJoint};
use crate::{Model, State};

impl SlidingJoint {
    /// The centreline of its rod.
    pub fn centreline(&self, model: &Model) -> Centreline {
        Centreline::new(model.segments[self.segments.clone()].iter().map(|segment| segment.length))
    }

    /// Where the rod's centreline is at a distance from its start [m].
    pub fn point(&self, model: &Model, state: &State, distance: f64) -> Vector3<f64> {
        let share = |Share { segment, position, axis }: Share| {
            let segment = self.segments.start + segment;
            state.positions[segment] * position[0] + state.orientations[segment] * Vector3::z() * axis[0]
        };
        self.centreline(model).at(distance).into_iter().map(share).sum()
    }
}
