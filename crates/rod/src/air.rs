//! Air about the rods: drag on cylinders, in wind or at rest.

use nalgebra::Vector3;

use crate::{Model, ModelError, State, Wind, WindNow, Wrench};

/// Air that surrounds all segments.
///
/// A segment of radius r feels, per unit of its length, the cross-flow drag of a long cylinder: `rho C_n r |v_n| v_n`
/// across and `rho C_t r |v_t| v_t` along its axis (`0.5 rho C 2r |v| v` each), where v_n and v_t are the parts of the
/// air's velocity relative to the segment's surface, taken apart (the independence principle: Hoerner, Fluid-Dynamic Drag,
/// 1965, chapter 3). Friction against the spin about the own axis, forces on end faces, lift and added mass are left out.
/// Fixed segments do not yield to it ([`Model::drag`] is what their grips bear).
#[derive(Clone, Debug, PartialEq)]
pub struct Air {
    /// Density rho [kg/m^3].
    pub density: f64,
    /// Drag coefficient C_n across the axis.
    pub normal_drag: f64,
    /// Drag coefficient C_t along the axis.
    pub tangential_drag: f64,
    /// How it moves.
    pub wind: Wind,
}

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

impl Air {
    pub(crate) fn validate(&self) -> Result<(), ModelError> {
        let values = [
            ("air density", self.density),
            ("normal drag", self.normal_drag),
            ("tangential drag", self.tangential_drag),
        ];
        for (quantity, value) in values {
            if !(value.is_finite() && value >= 0.0) {
                return Err(ModelError::Value { what: "model", index: 0, quantity, value, allowed: "finite and >= 0" });
            }
        }
        self.wind.validate()
    }
}
