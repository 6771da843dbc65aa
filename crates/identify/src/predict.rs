//! Predictions: cables simulated with the motion of their grips.

use nalgebra::Vector3;
use rayon::prelude::*;
use rod::{Model, State};
use solver::auto::choose;
use solver::batch::Batch;
use solver::formulation::{Formulation, Tangent};
use solver::integrator::Integrator;
use solver::simulation::{GuessFactory, Settings, SimulationError};
use solver::step::{Status, StepParams};

use crate::cable::Cable;
use crate::parameter::Parameters;

/// Cables that are simulated together: the lanes of a vector register.
pub const TOGETHER: usize = 8;

/// The free markers of a cable over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Positions [m]: `markers[frame][marker]`, without those in the grips.
    pub markers: Vec<Vec<Vector3<f64>>>,
    /// Steps that did not converge, or where it went on from anything but numbers.
    pub unsolved: usize,
}

/// How steps are solved: `newton` to a residual that is far below what markers can tell, BDF2.
pub fn step_params() -> StepParams {
    StepParams {
        formulation: Formulation::Newton,
        integrator: Integrator::Bdf2,
        tangent: Tangent::Positive,
        relative_tolerance: 1e-4,
        absolute_tolerance: 1e-6,
        ..StepParams::DEFAULT
    }
}

/// Predicts `frames` frames of each cable, all on rayon's threads, with the same bits on any number of them.
///
/// # Errors
/// If a model is not valid.
pub fn predict(
    cables: &[Cable],
    parameters: &Parameters,
    frames: usize,
    steps: usize,
) -> Result<Vec<Prediction>, SimulationError> {
    let chunks: Result<Vec<_>, _> =
        cables.par_chunks(TOGETHER).map(|cables| together(cables, parameters, frames, steps)).collect();
    Ok(chunks?.into_iter().flatten().collect())
}

/// Predicts a few cables in one simulation, on this thread.
pub(crate) fn together(
    cables: &[Cable],
    parameters: &Parameters,
    frames: usize,
    steps: usize,
) -> Result<Vec<Prediction>, SimulationError> {
    let models: Vec<(Model, State)> = cables.iter().map(|cable| cable.model(parameters)).collect();
    let step = step_params();
    let copies: Vec<_> = models.iter().map(|(model, state)| (model, state)).collect();
    let Some((first, _)) = models.first() else { return Ok(Vec::new()) };
    let choice = choose(first, &step, None);
    let guess: GuessFactory<'_> = &|model, members, topology| {
        if cables.len() < 3 { choice.build_guess(model, members, topology) } else { None }
    };
    let mut batch = Batch::new(&copies, &Settings { step, solver: choice.solver }, Some(guess))?;
    let mut predictions: Vec<_> =
        cables.iter().map(|cable| Prediction { markers: Vec::with_capacity(frames.min(cable.time.len())), unsolved: 0 }).collect();
    let mut state = State::default();
    let most = cables.iter().map(|cable| cable.time.len()).max().unwrap_or(0).min(frames);
    for frame in 0..most {
        if frame > 0 {
            let times: Vec<_> = cables.iter().filter_map(|cable| Some(cable.time.get(frame)? - cable.time[frame - 1])).collect();
            let dt = times[0] / steps as f64;
            for _ in 0..steps {
                batch.step(dt)?;
                for (copy, prediction) in predictions.iter_mut().enumerate() {
                    prediction.unsolved += usize::from(batch.status(copy) != Status::Converged);
                }
            }
        }
        for (copy, (cable, prediction)) in cables.iter().zip(&mut predictions).enumerate() {
            if frame < cable.time.len() {
                batch.store(copy, &mut state);
                prediction.markers.push(cable.marker_nodes().map(|node| end_of(&models[copy].0, &state, node)).collect());
            }
        }
    }
    Ok(predictions)
}

/// Where the segment before a node ends.
fn end_of(model: &Model, state: &State, node: usize) -> Vector3<f64> {
    let segment = node - 1;
    state.positions[segment] + state.axis(segment) * (0.5 * model.segments[segment].length)
}
