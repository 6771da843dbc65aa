//! The model of a noodle.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use cosserat::assembly::{Air, Assembly, Damping, InnerDamping, Material, RestShape, RodSpec, Wind, shape};
use cosserat::motion::{Carried, Driven, Interpolation, KeyframeError, Motion};
use cosserat::state::{Body, Model, Pose, State};
use cosserat::statics::{StaticParams, equilibrium};
use nalgebra::{UnitQuaternion, Vector3};

use super::{MARKERS, NoodleRecording, Number, Numbers};
use crate::cable::{AIR_DENSITY, DENSITY, GRAVITY, RADIUS};
use crate::specimen::Specimen;
use crate::specimen::SpecimenError;

/// What a prediction may know of a recording: the way of its clamp. It begins at rest under gravity in the clamp's first pose.
#[derive(Clone, Debug)]
pub struct Noodle {
    time: Vec<f64>,
    way: Arc<Motion>,
    /// Segments of the noodle.
    pub(crate) segments: usize,
}

impl Noodle {
    /// The noodle of a recording, with so many segments.
    ///
    /// # Errors
    /// If the poses of the clamp make no motion.
    pub fn new(recording: &NoodleRecording, segments: usize) -> Result<Self, KeyframeError> {
        let way = Arc::new(Motion::through(&recording.clamp, Interpolation::Smooth)?);
        Ok(Self { time: recording.recording.time.clone(), way, segments })
    }

    /// Pose of the clamp at a time [s].
    pub fn clamp(&self, time: f64) -> Pose {
        self.way.at(time).pose
    }

    /// How the clamp holds the noodle's start.
    pub(crate) fn grip(&self, numbers: &Numbers) -> Carried {
        let grip = Pose { position: Vector3::zeros(), orientation: heading(numbers) };
        Carried { grip, ..Carried::new(self.way.clone()) }
    }

    /// What it is made of.
    pub(super) fn material(numbers: &Numbers) -> Material {
        let youngs_modulus = 4.0 * numbers[Number::Bending] * DENSITY / (RADIUS * RADIUS);
        Material { youngs_modulus, torsion_modulus: 0.5 * numbers[Number::Twist] * youngs_modulus, density: DENSITY }
    }

    /// The noodle, straight in the clamp's first pose.
    pub(super) fn straight(&self, numbers: &Numbers) -> (Model, State) {
        let of = |number| numbers[number];
        let area = PI * RADIUS * RADIUS;
        let mut assembly = Assembly::new(-Vector3::z() * GRAVITY);
        assembly.damping(Damping { linear: of(Number::OuterDamping), angular: 0.0 });
        let normal_drag = of(Number::DragAcross) * DENSITY * area / (RADIUS * AIR_DENSITY);
        let wind = Wind::steady(Vector3::zeros());
        assembly.air(Air { density: AIR_DENSITY, normal_drag, tangential_drag: 0.0, wind });
        let carried = self.grip(numbers);
        let pose = carried.at(0.0).pose;
        let direction = pose.orientation * Vector3::z();
        let tau = of(Number::InnerDamping);
        let rod = assembly.rod(&RodSpec {
            inner_damping: InnerDamping { bending: tau, twist: tau, stretch: 0.0 },
            d1: Some(pose.orientation * Vector3::x()),
            rest: RestShape::Uniform(Vector3::new(of(Number::Curvature1), of(Number::Curvature2), 0.0)),
            ..RodSpec::new(
                shape::straight(pose.position, direction, of(Number::Length), self.segments),
                RADIUS,
                Self::material(numbers),
            )
        });
        assembly.clamp_start(&rod);
        let model = assembly.model_mut();
        model.motions.push(Driven { carried, ..Driven::new(Body::Anchor(0), self.way.clone()) });
        assembly.finish()
    }
}

impl Specimen for Noodle {
    type Numbers = Numbers;

    fn time(&self) -> &[f64] {
        &self.time
    }

    fn free(&self) -> Vec<usize> {
        (1..MARKERS).collect()
    }

    fn model(&self, numbers: &Numbers) -> Result<(Model, State), SpecimenError> {
        let (model, mut state) = self.straight(numbers);
        equilibrium(&model, &mut state, &StaticParams::default())?;
        Ok((model, state))
    }

    fn markers(&self, numbers: &Numbers, model: &Model, state: &State) -> Vec<Vector3<f64>> {
        let at = |share: f64| {
            let along = share * state.len() as f64;
            let i = (along as usize).min(state.len() - 1);
            state.positions[i] + state.axis(i) * ((along - i as f64 - 0.5) * model.segments[i].length)
        };
        [numbers[Number::Middle], 1.0].map(at).to_vec()
    }
}

/// The frame of the noodle's start in the clamp's: d3 along x, d1 along y, d2 along z, turned by the headings.
fn heading(numbers: &Numbers) -> UnitQuaternion<f64> {
    let turn = UnitQuaternion::from_scaled_axis(
        Vector3::y() * numbers[Number::HeadingY] + Vector3::z() * numbers[Number::HeadingZ],
    );
    let quarter = |axis| UnitQuaternion::from_axis_angle(&axis, FRAC_PI_2);
    turn * quarter(Vector3::x_axis()) * quarter(Vector3::y_axis())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_noodle_leaves_along_x_of_its_clamp() {
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| heading(&Numbers::start(1.0)) * axis);
        for (found, expected) in axes.iter().zip([Vector3::y(), Vector3::z(), Vector3::x()]) {
            assert!((found - expected).norm() < 1e-12, "{axes:?}");
        }
    }
}
