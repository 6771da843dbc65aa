//! A scene to be simulated, and the motions that errors are measured against.

use cosserat::guess::GuessKind;
use cosserat::scene::Scene;
use cosserat::simulation::{Formulation, Integrator, Settings, Simulation, SimulationError, Status, StepParams};
use cosserat::state::{Model, State};
use nalgebra::Vector3;

use super::metrics::position_error;

/// How many steps of a run errors are measured at, about.
const SAMPLES: usize = 10;

/// Outer tolerance of an exact reference.
pub const TOLERANCE: f64 = 1e-12;

/// Contacts' tolerance of an exact reference, relative to the smaller radius; where segments can touch, the rods' own
/// constraints go no further down than a hundredth of it.
pub const CONTACT_TOLERANCE: f64 = 1e-7;

/// Direct solves of the same formulation to [`TOLERANCE`] and [`CONTACT_TOLERANCE`], without substeps, which would be
/// another motion.
pub fn exact_settings(step: &StepParams) -> Settings {
    let step = StepParams {
        relative_tolerance: TOLERANCE,
        motion_tolerance: TOLERANCE,
        absolute_tolerance: TOLERANCE,
        contact_tolerance: CONTACT_TOLERANCE,
        max_iterations: 200,
        max_halvings: 0,
        ..*step
    };
    Settings { step, ..Settings::default() }
}

/// A scene, for how long it is run, and what its errors are measured against.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The scene; steps are its own.
    pub scene: Scene,
    /// Number of steps.
    pub steps: usize,
    /// Steps, from 1, after which errors are measured: about ten.
    pub samples: Vec<usize>,
    /// References at the same time step, one a formulation.
    pub exact: Vec<Reference>,
    /// The converged reference, where there is one.
    pub converged: Option<Reference>,
}

impl Problem {
    /// A problem with exact references of `formulations`, the first of which says by its contacts where the samples lie,
    /// and a converged one where there are `refined` scenes ([`scene::parse_refined`]), coarsest first: at least two, the
    /// uncut one possibly among them, tell how far it is converged. After each step of each reference `go_on()` says
    /// whether to go on; `None` if not.
    ///
    /// # Errors
    /// If a scene is not valid.
    pub fn new(
        scene: Scene,
        steps: usize,
        formulations: &[Formulation],
        refined: &[Scene],
        mut go_on: impl FnMut() -> bool,
    ) -> Result<Option<Self>, SimulationError> {
        let integrator = Integrator::Euler;
        let mut exact = Vec::with_capacity(formulations.len());
        for &formulation in formulations {
            let settings = exact_settings(&StepParams { formulation, integrator, ..StepParams::default() });
            let (course, how) = ((scene.run.dt, steps, 1), (&settings, GuessKind::Zero));
            let reference = Reference::of_all_steps(&scene, course, how, |state| state.positions.clone(), &mut go_on)?;
            let Some(reference) = reference else { return Ok(None) };
            exact.push(reference);
        }
        let samples = sample_steps(steps, exact.first().and_then(|exact| exact.first_contact));
        exact.iter_mut().for_each(|exact| exact.keep(&samples));
        let mut problem = Self { scene, steps, samples, exact, converged: None };
        for finer in refined {
            let Some(reference) = problem.refined(finer, &mut go_on)? else { return Ok(None) };
            problem.converged = Some(reference);
        }
        Ok(Some(problem))
    }

    /// The next converged reference after the one that there is.
    ///
    /// Segments are cut into k parts and time steps into k^2, formulation `newton`, direct solves. What is left are the
    /// errors of implicit Euler, O(1/k^2), and of the segments' length: O(1/k) where whole segments are clamped or rods
    /// branch, O(1/k^2) elsewhere. With contacts there is nothing to converge to after the first.
    fn refined(&self, finer: &Scene, go_on: &mut impl FnMut() -> bool) -> Result<Option<Reference>, SimulationError> {
        // Far below what the time steps leave.
        let [relative_tolerance, absolute_tolerance, contact_tolerance] = [1e-8, 1e-8, 1e-4];
        let step =
            StepParams { formulation: Formulation::Newton, integrator: Integrator::Euler, ..StepParams::default() };
        let step = StepParams {
            relative_tolerance,
            motion_tolerance: relative_tolerance,
            absolute_tolerance,
            contact_tolerance,
            ..step
        };
        let how = (&Settings { step, ..Settings::default() }, GuessKind::StepQuadratic);
        let parts = finer.model.segments.len() / self.scene.model.segments.len().max(1);
        let course = (self.scene.run.dt, self.steps, parts * parts);
        let reference =
            Reference::of_all_steps(finer, course, how, |state| centres(&finer.model, state, parts), go_on)?;
        let Some(mut reference) = reference else { return Ok(None) };
        reference.keep(&self.samples);
        if let Some(last) = &self.converged {
            let frames = last.frames.iter().zip(&reference.frames);
            let difference = frames.map(|(a, b)| position_error(&self.scene.model, a, b)).collect();
            reference.differences = [&last.differences[..], &[difference]].concat();
            reference.status = reference.status.max(last.status);
        }
        Ok(Some(reference))
    }

    /// The reference of the same formulation, if there is one.
    pub fn exact(&self, formulation: Formulation) -> Option<&Reference> {
        self.exact.iter().find(|exact| exact.formulation == formulation)
    }

    /// How many of the samples come before the first contact in any of the references.
    pub fn samples_before_contact(&self) -> usize {
        let first = self.exact.iter().chain(&self.converged).filter_map(|reference| reference.first_contact).min();
        self.samples.iter().take_while(|&&step| first.is_none_or(|first| step < first)).count()
    }
}

/// The steps, from 1 to `steps`, after which errors are measured: evenly spread, up to the last; where there is a first
/// contact within the run half of them before it, up to the last step without, and half from it on.
fn sample_steps(steps: usize, first_contact: Option<usize>) -> Vec<usize> {
    let spread = |after: usize, until: usize, count: usize| {
        let count = count.min(until - after);
        (1..=count).map(move |k| after + ((until - after) * k).div_ceil(count))
    };
    match first_contact {
        Some(first) if first > 1 && first <= steps => {
            spread(0, first - 1, SAMPLES / 2).chain(spread(first - 1, steps, SAMPLES / 2)).collect()
        }
        _ => spread(0, steps, SAMPLES).collect(),
    }
}

/// A motion that errors are measured against: an exact one, or a converged one.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Formulation.
    pub formulation: Formulation,
    /// Worst status of any step; [`Status::OutOfIterations`] where a tolerance is below rounding errors, or contacts do not
    /// settle to theirs: then errors below the contacts' tolerance of the ways say nothing.
    pub status: Status,
    /// First step of the problem's, from 1, in which segments met an obstacle or each other.
    pub first_contact: Option<usize>,
    /// Centres of the problem's segments [m] at each of its samples.
    pub frames: Vec<Vec<Vector3<f64>>>,
    /// Of a converged one the position errors of each run but the last against the next one, at each sample.
    pub differences: Vec<Vec<f64>>,
}

impl Reference {
    /// The frames are those of all `steps` of `dt` [s], each done in so many `parts`. `None` where `go_on()` says so after one.
    fn of_all_steps(
        Scene { model, state, .. }: &Scene,
        (dt, steps, parts): (f64, usize, usize),
        (settings, guess): (&Settings, GuessKind),
        centres: impl Fn(&State) -> Vec<Vector3<f64>>,
        go_on: &mut impl FnMut() -> bool,
    ) -> Result<Option<Self>, SimulationError> {
        let guess = |model: &_, members: &_, topology: &_| guess.build(model, members, topology);
        let mut simulation = Simulation::new(model, state, settings, Some(&guess))?;
        let (mut status, mut first_contact, mut frames) = (Status::Converged, None, Vec::with_capacity(steps));
        let mut now = state.clone();
        for step in 1..=steps {
            for _ in 0..parts {
                status = status.max(simulation.step(dt / parts as f64)?.status);
            }
            if first_contact.is_none() && simulation.counters().contact_solves > 0 {
                first_contact = Some(step);
            }
            simulation.store(&mut now);
            frames.push(centres(&now));
            if !go_on() {
                return Ok(None);
            }
        }
        let formulation = settings.step.formulation;
        Ok(Some(Self { formulation, status, first_contact, frames, differences: Vec::new() }))
    }

    /// Leaves out all frames but those after these steps, from 1.
    fn keep(&mut self, samples: &[usize]) {
        self.frames = samples.iter().map(|&step| std::mem::take(&mut self.frames[step - 1])).collect();
    }

    /// Estimate of a converged motion's own position error at each sample: how far the next coarser one is from it.
    ///
    /// Where a refinement by two halves the error (order 1/k) this is the error itself, where it divides it by four three
    /// times as much. Where [`Reference::differences`] do not fall from run to run it is no estimate, but says that the motion
    /// is not converged.
    pub fn error(&self) -> &[f64] {
        self.differences.last().map_or(&[], Vec::as_slice)
    }
}

/// What the centres of the uncut segments would be [m], of a model whose segments are cut into so many `parts`: a segment is
/// the chord between two places in the material, so that its centre is halfway between the ends of its parts.
///
/// At the start this is where the uncut scene has them, for curved rods, too, whose parts do not lie on the chord.
fn centres(model: &Model, state: &State, parts: usize) -> Vec<Vector3<f64>> {
    let end = |i: usize, side: f64| state.positions[i] + state.axis(i) * (side * model.segments[i].length);
    let chord = |first: usize| 0.5 * (end(first, -0.5) + end(first + parts - 1, 0.5));
    (0..model.segments.len()).step_by(parts).map(chord).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_reach_to_the_end_and_to_the_first_contact() {
        assert_eq!(sample_steps(100, None), [10, 20, 30, 40, 50, 60, 70, 80, 90, 100]);
        assert_eq!(sample_steps(3, None), [1, 2, 3]);
        assert!(sample_steps(0, None).is_empty());
        assert_eq!(sample_steps(100, Some(51)), [10, 20, 30, 40, 50, 60, 70, 80, 90, 100]);
        assert_eq!(sample_steps(12, Some(3)), [1, 2, 4, 6, 8, 10, 12]);
        assert_eq!(sample_steps(20, Some(1)), [2, 4, 6, 8, 10, 12, 14, 16, 18, 20]);
        assert_eq!(sample_steps(20, Some(20)).last(), Some(&20));
        assert_eq!(sample_steps(20, Some(21)), sample_steps(20, None));
    }
}
