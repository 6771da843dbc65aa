//! The model of a noodle, and predictions with it.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{
    Air, Assembly, Body, Carried, Damping, Driven, InnerDamping, Interpolation, Material, Model, Motion, Pose,
    RestShape, RodSpec, State, Wind, shape,
};
use solver::auto::choose;
use solver::simulation::{Settings, Simulation, SimulationError};
use solver::statics::{StaticParams, equilibrium};

use super::{Number, Numbers, Recording};
use crate::cable::{AIR_DENSITY, DENSITY, GRAVITY, RADIUS};
use crate::predict::step_params;

/// How finely noodles are simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    /// Segments of the noodle.
    pub segments: usize,
    /// Frames to a step.
    pub frames: usize,
}

impl Default for Resolution {
    fn default() -> Self {
        Self { segments: 20, frames: 2 }
    }
}

/// Predicts the markers of every frame to which a step comes and, evenly from those beside it, of the others: from rest under
/// gravity in the first pose of the clamp, with the way of the clamp, and nothing else of the recording.
///
/// # Errors
/// If the model is not valid.
pub fn predict(
    recording: &Recording,
    numbers: &Numbers,
    resolution: Resolution,
) -> Result<Vec<[Vector3<f64>; 2]>, SimulationError> {
    let (model, mut state) = noodle(recording, numbers, resolution.segments);
    equilibrium(&model, &mut state, &StaticParams::default())?;
    let step = step_params();
    let choice = choose(&model, &step, None);
    let mut simulation = Simulation::new(&model, &state, &Settings { step, solver: choice.solver }, None)?;
    let mut predicted = vec![markers(&model, &state, numbers)];
    let last = recording.time.len() - 1;
    let mut at = 0;
    while at < last {
        let next = (at + resolution.frames).min(last);
        simulation.step(recording.time[next] - recording.time[at])?;
        simulation.store(&mut state);
        let [before, now] = [predicted[at], markers(&model, &state, numbers)];
        let span = (next - at) as f64;
        for frame in at + 1..=next {
            let share = (frame - at) as f64 / span;
            predicted.push([0, 1].map(|k| before[k].lerp(&now[k], share)));
        }
        at = next;
    }
    Ok(predicted)
}

/// The noodle, straight in the clamp's first pose.
fn noodle(recording: &Recording, numbers: &Numbers, segments: usize) -> (Model, State) {
    let of = |number| numbers[number];
    let area = PI * RADIUS * RADIUS;
    let youngs_modulus = 4.0 * of(Number::Bending) * DENSITY / (RADIUS * RADIUS);
    let mut assembly = Assembly::new(-Vector3::z() * GRAVITY);
    assembly.damping(Damping { linear: of(Number::OuterDamping), angular: 0.0 });
    let normal_drag = of(Number::DragAcross) * DENSITY * area / (RADIUS * AIR_DENSITY);
    assembly.air(Air { density: AIR_DENSITY, normal_drag, tangential_drag: 0.0, wind: Wind::steady(Vector3::zeros()) });
    let grip = Pose { position: Vector3::zeros(), orientation: heading(numbers) };
    let motion = Arc::new(way(recording));
    let carried = Carried { grip, ..Carried::new(motion.clone()) };
    let pose = carried.at(0.0).pose;
    let direction = pose.orientation * Vector3::z();
    let tau = of(Number::InnerDamping);
    let rod = assembly.rod(&RodSpec {
        inner_damping: InnerDamping { bending: tau, twist: tau, stretch: 0.0 },
        d1: Some(pose.orientation * Vector3::x()),
        rest: RestShape::Uniform(Vector3::new(of(Number::Curvature1), of(Number::Curvature2), 0.0)),
        ..RodSpec::new(
            shape::straight(pose.position, direction, of(Number::Length), segments),
            RADIUS,
            Material { youngs_modulus, torsion_modulus: 0.5 * of(Number::Twist) * youngs_modulus, density: DENSITY },
        )
    });
    assembly.clamp_start(&rod);
    let model = assembly.model_mut();
    model.motions.push(Driven { carried, ..Driven::new(Body::Anchor(0), motion) });
    assembly.finish()
}

/// The frame of the noodle's start in the clamp's: d3 along x, d1 along y, d2 along z, turned by the headings.
fn heading(numbers: &Numbers) -> UnitQuaternion<f64> {
    let turn = UnitQuaternion::from_scaled_axis(
        Vector3::y() * numbers[Number::HeadingY] + Vector3::z() * numbers[Number::HeadingZ],
    );
    let quarter = |axis| UnitQuaternion::from_axis_angle(&axis, FRAC_PI_2);
    turn * quarter(Vector3::x_axis()) * quarter(Vector3::y_axis())
}

/// The way of the clamp.
fn way(recording: &Recording) -> Motion {
    let poses: Vec<(f64, Pose)> = recording.time.iter().copied().zip(recording.clamp.iter().copied()).collect();
    Motion::through(&poses, Interpolation::Smooth).expect("a recording is finite and its times increase")
}

/// The markers of a noodle.
fn markers(model: &Model, state: &State, numbers: &Numbers) -> [Vector3<f64>; 2] {
    [numbers[Number::Middle], 1.0].map(|share| {
        let along = share * state.len() as f64;
        let i = (along as usize).min(state.len() - 1);
        state.positions[i] + state.axis(i) * ((along - i as f64 - 0.5) * model.segments[i].length)
    })
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
