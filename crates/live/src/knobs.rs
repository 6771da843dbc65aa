//! Quantities of a model that viewers may change while it moves.

use nalgebra::Vector3;
use rod::{Air, Model, Surface, Wind};
use serde::{Deserialize, Serialize};

use crate::LiveError;

/// Air where a model has none: density [kg/m^3], drag coefficients of a long cylinder across (at Reynolds numbers of 10^3 to 10^5,
/// Hoerner 1965) and along.
const AIR: (f64, f64, f64) = (1.2, 1.2, 0.01);

/// The new value of one of the quantities.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Knob {
    /// Gravity [m/s^2].
    Gravity([f64; 3]),
    /// Wind beside the model's own [m/s].
    Wind([f64; 3]),
    /// All elastic stiffnesses, over the model's own.
    Stiffness(f64),
    /// Damping against the surroundings beside the model's own [1/s].
    Damping(f64),
    /// All coefficients of friction, over the model's own.
    Friction(f64),
}

/// All quantities as they are set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Knobs {
    /// Gravity [m/s^2].
    pub gravity: [f64; 3],
    /// Wind beside the model's own [m/s].
    pub wind: [f64; 3],
    /// Stiffnesses over the model's own.
    pub stiffness: f64,
    /// Damping beside the model's own [1/s].
    pub damping: f64,
    /// Friction over the model's own.
    pub friction: f64,
}

impl Knobs {
    /// Those of a model as it is.
    pub(crate) fn of(model: &Model) -> Self {
        Self { gravity: model.gravity.into(), wind: [0.0; 3], stiffness: 1.0, damping: 0.0, friction: 1.0 }
    }

    /// Turns one.
    ///
    /// # Errors
    /// If the value is not allowed.
    pub(crate) fn set(&mut self, knob: Knob) -> Result<(), LiveError> {
        let within = |values: &[f64], low: f64, high: f64, what: &str| {
            if values.iter().all(|x| (low..=high).contains(x)) {
                return Ok(());
            }
            Err(LiveError::refused(format!("{what} must be from {low} to {high}")))
        };
        match knob {
            Knob::Gravity(g) => within(&g, -1e3, 1e3, "gravity").map(|()| self.gravity = g),
            Knob::Wind(v) => within(&v, -100.0, 100.0, "wind").map(|()| self.wind = v),
            Knob::Stiffness(s) => within(&[s], 1e-3, 1e3, "stiffness").map(|()| self.stiffness = s),
            Knob::Damping(d) => within(&[d], 0.0, 1e3, "damping").map(|()| self.damping = d),
            Knob::Friction(f) => within(&[f], 0.0, 100.0, "friction").map(|()| self.friction = f),
        }
    }

    /// Whether the same simulation can go from these to `others`: only gravity may differ.
    pub(crate) fn differ_in_gravity_alone(&self, others: &Self) -> bool {
        Self { gravity: others.gravity, ..*self } == *others
    }

    /// The `model` with the quantities as they are set.
    ///
    /// # Errors
    /// If it has a wind that changes, and more wind is asked for.
    pub(crate) fn applied_to(&self, model: &Model) -> Result<Model, LiveError> {
        let mut model = model.clone();
        model.gravity = self.gravity.into();
        for joint in &mut model.joints {
            for compliance in [
                &mut joint.stretch_compliance,
                &mut joint.shear_compliance,
                &mut joint.shear_extra,
                &mut joint.bend_compliance,
                &mut joint.bend_extra,
                &mut joint.twist_compliance,
            ] {
                *compliance /= self.stiffness;
            }
            joint.youngs_modulus *= self.stiffness;
            joint.torsion_modulus *= self.stiffness;
        }
        model.damping.linear += self.damping;
        model.damping.angular += self.damping;
        let scale = |surface: &mut Surface| {
            surface.friction.at_rest *= self.friction;
            surface.friction.sliding *= self.friction;
        };
        model.contacts.between_segments.iter_mut().for_each(scale);
        model.contacts.obstacles.iter_mut().for_each(|obstacle| scale(&mut obstacle.surface));
        let wind = Vector3::from(self.wind);
        if wind != Vector3::zeros() {
            let (density, normal_drag, tangential_drag) = AIR;
            let air = model.air.get_or_insert_with(|| Air {
                density,
                normal_drag,
                tangential_drag,
                wind: Wind::steady(Vector3::zeros()),
            });
            if air.wind.has_gusts() || !air.wind.is_steady() {
                return Err(LiveError::refused("the wind of this scene changes over time, and is not added to"));
            }
            air.wind = Wind::steady(air.wind.velocity(&Vector3::zeros(), 0.0) + wind);
        }
        Ok(model)
    }
}
