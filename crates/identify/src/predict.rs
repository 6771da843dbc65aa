//! Predictions: what is identified, simulated with the motion of its grips.

use cosserat::guess::{GuessFactory, choose};
use cosserat::simulation::{Batch, Formulation, Integrator, Settings, StepParams, Tangent};
use cosserat::state::{Model, State};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::specimen::Specimen;
use crate::specimen::SpecimenError;

/// Specimens that are simulated together: the lanes of a vector register.
pub const TOGETHER: usize = 8;

/// Fewest that move in lanes.
const IN_LANES: usize = 3;

/// The free markers of a recording over time.
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
        motion_tolerance: 1e-4,
        absolute_tolerance: 1e-6,
        ..StepParams::DEFAULT
    }
}

/// Predicts `frames` frames of each specimen, in `steps` steps from frame to frame, all on rayon's threads, with the same bits on any
/// number of them.
///
/// # Errors
/// If a model is not valid.
pub fn predict<S: Specimen>(
    specimens: &[S],
    numbers: &S::Numbers,
    frames: usize,
    steps: usize,
) -> Result<Vec<Prediction>, SpecimenError> {
    predict_each(&specimens.iter().map(|specimen| (specimen, numbers)).collect::<Vec<_>>(), frames, steps)
}

/// The same, each specimen with numbers of its own; those that stand beside each other and are alike move together.
pub fn predict_each<S: Specimen>(
    copies: &[(&S, &S::Numbers)],
    frames: usize,
    steps: usize,
) -> Result<Vec<Prediction>, SpecimenError> {
    let groups = groups(copies, |(specimen, _)| specimen.time());
    let all: Result<Vec<Vec<Prediction>>, _> =
        groups.into_par_iter().map(|group| together(group, frames, steps)).collect();
    Ok(all?.into_iter().flatten().collect())
}

/// Parts of a list that are simulated together: neighbours whose frames come at the same times, a few at once.
pub fn groups<T>(all: &[T], time: impl Fn(&T) -> &[f64]) -> Vec<&[T]> {
    let (mut groups, mut first, mut longest) = (Vec::new(), 0, 0);
    for k in 0..all.len() {
        if k - first == TOGETHER || !are_in_time(time(&all[k]), time(&all[longest])) {
            groups.push(&all[first..k]);
            (first, longest) = (k, k);
        }
        if time(&all[k]).len() > time(&all[longest]).len() {
            longest = k;
        }
    }
    groups.push(&all[first..]);
    groups.retain(|group| !group.is_empty());
    groups
}

/// Whether frames come at the same times, as far as both go.
pub fn are_in_time(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
}

/// Predicts a few specimens, whose frames come at the same times, on this thread, in one simulation.
fn together<S: Specimen>(
    copies: &[(&S, &S::Numbers)],
    frames: usize,
    steps: usize,
) -> Result<Vec<Prediction>, SpecimenError> {
    let models: Vec<(Model, State)> =
        copies.iter().map(|(specimen, numbers)| specimen.model(numbers)).collect::<Result<_, _>>()?;
    let times: Vec<&[f64]> =
        copies.iter().map(|(specimen, _)| &specimen.time()[..specimen.time().len().min(frames)]).collect();
    let mut markers: Vec<Vec<_>> = times.iter().map(|time| Vec::with_capacity(time.len())).collect();
    let mut watch = |copy: usize, model: &Model, state: &State| {
        let (specimen, numbers): (&S, &S::Numbers) = copies[copy];
        markers[copy].push(specimen.markers(numbers, model, state));
    };
    let unsolved = simulated(&models, &times, steps, &mut watch)?;
    Ok(markers.into_iter().zip(unsolved).map(|(markers, unsolved)| Prediction { markers, unsolved }).collect())
}

/// What looks on while models are simulated, and may act on them.
pub trait Watch {
    /// Acts before the steps from a frame to the next, which comes `dt` [s] later.
    ///
    /// # Errors
    /// If what it does is not possible.
    fn act(&mut self, _batch: &mut Batch, _dt: f64) -> Result<(), SpecimenError> {
        Ok(())
    }

    /// Looks at a copy, by its index, in a frame.
    fn look(&mut self, copy: usize, model: &Model, state: &State);
}

impl<F: FnMut(usize, &Model, &State)> Watch for F {
    fn look(&mut self, copy: usize, model: &Model, state: &State) {
        self(copy, model, state);
    }
}

/// Simulates models whose frames come at these `times` [s], the same as far as they go, and shows each of them in each of its frames to
/// `watch`. Returns how many steps of each were not solved.
///
/// # Errors
/// If a model is not valid, or `watch` cannot act.
pub fn simulated(
    models: &[(Model, State)],
    times: &[&[f64]],
    steps: usize,
    watch: &mut dyn Watch,
) -> Result<Vec<usize>, SpecimenError> {
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
            let interval = longest[frame] - longest[frame - 1];
            watch.act(&mut batch, interval)?;
            let dt = interval / steps as f64;
            for _ in 0..steps {
                batch.step(dt)?;
                for (copy, unsolved) in unsolved.iter_mut().enumerate() {
                    let counts = frame < times[copy].len();
                    *unsolved += usize::from(counts && !batch.status(copy).is_converged());
                }
            }
        }
        for (copy, time) in times.iter().enumerate() {
            if frame < time.len() {
                batch.store(copy, &mut state);
                watch.look(copy, &models[copy].0, &state);
            }
        }
    }
    Ok(unsolved)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_are_together_whose_frames_come_at_the_same_times() {
        let even = |frames: usize| (0..frames).map(|k| k as f64 * 0.01).collect::<Vec<f64>>();
        // As long as the second it goes with it, but not with the first.
        let mut drops = even(300);
        drops[150..].iter_mut().for_each(|time| *time += 0.01);
        let times = [vec![even(500), even(100), drops], vec![even(50); 9]].concat();
        let sizes: Vec<usize> = groups(&times, |time| time).iter().map(|group| group.len()).collect();
        assert_eq!(sizes, [2, 8, 2]);
        assert!(groups::<Vec<f64>>(&[], |time| time).is_empty());
    }
}
