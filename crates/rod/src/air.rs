//! Air about the rods, in wind or at rest.

use crate::{ModelError, Wind};

/// Air that surrounds all segments.
///
/// A segment of radius r feels, per unit of its length, the cross-flow drag of a long cylinder: `rho C_n r |v_n| v_n`
/// across and `rho C_t r |v_t| v_t` along its axis (`0.5 rho C 2r |v| v` each), where v_n and v_t are the parts of the
/// air's velocity relative to the segment's surface, taken apart (the independence principle: Hoerner, Fluid-Dynamic Drag,
/// 1965, chapter 3). Friction against the spin about the own axis, forces on end faces, lift and added mass are left out.
/// Fixed segments do not yield to it ([`crate::Model::drag`] is what their grips bear).
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
