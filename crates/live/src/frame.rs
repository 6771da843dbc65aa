//! A frame as it goes to the page: little-endian numbers.
//!
//! Four 32-bit integers: segments, obstacles, hands, steps. Then seven 64-bit floats: time [s], simulated seconds a second (NaN where
//! that is not known), energy [J], iterations a step and set, first and last time that one can go to [s], time that a step takes [s].
//! Then 32-bit floats: seven a segment (position, orientation x, y, z, w), four a segment (curvature, tension, residual, speed; NaN
//! where not known), seven an obstacle (its pivot, its turn), six a hand (what it holds, where it is).

use nalgebra::Vector3;
use rod::{JointForce, Model, Pose, State};

/// What a frame says beside the state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facts {
    pub(crate) steps: u64,
    pub(crate) time: f64,
    pub(crate) speed: f64,
    pub(crate) energy: f64,
    pub(crate) iterations: f64,
    pub(crate) times: [f64; 2],
    pub(crate) step_s: f64,
}

/// The bytes of a frame.
pub(crate) fn bytes(
    model: &Model,
    state: &State,
    forces: &[JointForce],
    hands: impl ExactSizeIterator<Item = [Vector3<f64>; 2]>,
    facts: &Facts,
) -> Vec<u8> {
    let obstacles = &model.contacts.obstacles;
    let (segments, floats) = (model.segments.len(), 11 * model.segments.len() + 7 * obstacles.len() + 6 * hands.len());
    let mut out = Vec::with_capacity(16 + 56 + 4 * floats);
    for count in [segments, obstacles.len(), hands.len(), facts.steps as usize] {
        out.extend_from_slice(&(count as u32).to_le_bytes());
    }
    let Facts { time, speed, energy, iterations, times: [first, last], step_s, .. } = *facts;
    for number in [time, speed, energy, iterations, first, last, step_s] {
        out.extend_from_slice(&number.to_le_bytes());
    }
    let mut put = |number: f64| out.extend_from_slice(&(number as f32).to_le_bytes());
    let pose = |put: &mut dyn FnMut(f64), Pose { position, orientation }: &Pose| {
        position.iter().chain(orientation.coords.iter()).for_each(|&x| put(x));
    };
    for (&position, &orientation) in state.positions.iter().zip(&state.orientations) {
        pose(&mut put, &Pose { position, orientation });
    }
    for values in view::channel_values(model, state, forces) {
        values.iter().for_each(|value| put(value.unwrap_or(f64::NAN)));
    }
    for obstacle in obstacles {
        pose(&mut put, &obstacle.at(time).pose);
    }
    for places in hands {
        places.iter().flatten().for_each(|&x| put(x));
    }
    out
}
