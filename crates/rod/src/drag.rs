//! The drag of the air on segments.

use nalgebra::Vector3;

use crate::{Air, Model, State, WindNow, Wrench};

impl Model {
    /// The drag of the air on a segment in `state` at `time` [s], about its centre; on a rigid body at its centre. A held segment
    /// does not yield to it: what holds it bears it.
    pub fn drag(&self, i: usize, state: &State, time: f64) -> Wrench {
        self.air.as_ref().map_or_else(Wrench::default, |air| self.drag_in(air, &air.wind.at(time), i, state))
    }

    /// [`Model::drag`] in the air's wind at one time.
    pub(crate) fn drag_in(&self, air: &Air, wind: &WindNow, i: usize, state: &State) -> Wrench {
        let segment = &self.segments[i];
        let (position, velocity, spin) = (state.positions[i], state.velocities[i], state.angular_velocities[i]);
        let mut drag = Wrench::default();
        if let Some(body) = &segment.body {
            let relative = wind.velocity(&position) - velocity;
            drag.force = relative * (0.5 * air.density * body.drag_area * relative.norm());
            return drag;
        }
        let axis = state.axis(i);
        for side in [1.0, -1.0] {
            // The Gauss points, each with half of the profile.
            let arm = axis * (side * segment.length / 12.0_f64.sqrt());
            let relative = wind.velocity(&(position + arm)) - velocity - spin.cross(&arm);
            let along = axis * relative.dot(&axis);
            let across = relative - along;
            let force = across * (air.normal_drag * across.norm()) + along * (air.tangential_drag * along.norm());
            let profile = 0.5 * air.density * segment.radius * segment.length;
            drag.add(&(force * profile), &arm, &Vector3::zeros());
        }
        drag
    }
}
