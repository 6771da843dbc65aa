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

/// Fewest cables that move in lanes.
const IN_LANES: usize = 3;

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

/// Predicts a few cables on this thread, in one simulation if their frames come at the same times.
pub(crate) fn together(
    cables: &[Cable],
    parameters: &Parameters,
    frames: usize,
    steps: usize,
) -> Result<Vec<Prediction>, SimulationError> {
    let longest = cables.iter().max_by_key(|cable| cable.time.len());
    let in_time = |with: &Cable| {
        let own = |cable: &Cable| cable.time.iter().zip(&with.time).all(|(a, b)| (a - b).abs() < 1e-9);
        cables.iter().all(own)
    };
    if !longest.is_none_or(in_time) {
        let alone = cables.iter().map(|cable| together(std::slice::from_ref(cable), parameters, frames, steps));
        return Ok(alone.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect());
    }
    let mut markers: Vec<Vec<_>> =
        cables.iter().map(|cable| Vec::with_capacity(frames.min(cable.time.len()))).collect();
    let models: Vec<(Model, State)> = cables.iter().map(|cable| cable.model(parameters)).collect();
    let times: Vec<&[f64]> = cables.iter().map(|cable| &cable.time[..cable.time.len().min(frames)]).collect();
    let unsolved = simulated(&models, &times, steps, &mut |copy, model, state| {
        markers[copy].push(cables[copy].marker_nodes().map(|node| end_of(model, state, node)).collect());
    })?;
    Ok(markers.into_iter().zip(unsolved).map(|(markers, unsolved)| Prediction { markers, unsolved }).collect())
}

/// Simulates models whose frames come at these `times` [s], the same as far as they go, and shows each of them in each frame to
/// `watch`, with its index. Returns how many steps of each were not solved.
pub(crate) fn simulated(
    models: &[(Model, State)],
    times: &[&[f64]],
    steps: usize,
    watch: &mut dyn FnMut(usize, &Model, &State),
) -> Result<Vec<usize>, SimulationError> {
    let copies: Vec<_> = models.iter().map(|(model, state)| (model, state)).collect();
    let (Some((first, _)), Some(longest)) = (models.first(), times.iter().max_by_key(|time| time.len())) else {
        return Ok(Vec::new());
    };
    let step = step_params();
    let choice = choose(first, &step, None);
    // In lanes nothing has a start of its own.
    let guess: GuessFactory<'_> = &|model, members, topology| choice.build_guess(model, members, topology);
    let guess = (models.len() < IN_LANES).then_some(guess);
    let mut batch = Batch::new(&copies, &Settings { step, solver: choice.solver }, guess)?;
    let mut unsolved = vec![0; models.len()];
    let mut state = State::default();
    for frame in 0..longest.len() {
        if frame > 0 {
            let dt = (longest[frame] - longest[frame - 1]) / steps as f64;
            for _ in 0..steps {
                batch.step(dt)?;
                for (copy, unsolved) in unsolved.iter_mut().enumerate() {
                    let counts = frame < times[copy].len();
                    *unsolved += usize::from(counts && batch.status(copy) > Status::ConvergedInSubsteps);
                }
            }
        }
        for (copy, time) in times.iter().enumerate() {
            if frame < time.len() {
                batch.store(copy, &mut state);
                watch(copy, &models[copy].0, &state);
            }
        }
    }
    Ok(unsolved)
}

/// Where the segment before a node ends.
pub(crate) fn end_of(model: &Model, state: &State, node: usize) -> Vector3<f64> {
    let segment = node - 1;
    state.positions[segment] + state.axis(segment) * (0.5 * model.segments[segment].length)
}
