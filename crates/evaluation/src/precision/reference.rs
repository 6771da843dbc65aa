//! What errors are measured against.

use nalgebra::Vector3;
use rod::{Model, State};
use solver::formulation::Formulation;
use solver::guess::GuessKind;
use solver::simulation::{Settings, Simulation, SimulationError};
use solver::step::{Status, StepParams};

use super::metrics::position_error;
use super::problem::Problem;

/// Outer tolerance of an exact reference.
pub const TOLERANCE: f64 = 1e-12;

/// Contacts' tolerance of an exact reference, relative to the smaller radius; where segments can touch, the rods' own
/// constraints go no further down than a hundredth of it.
pub const CONTACT_TOLERANCE: f64 = 1e-7;

/// Cap on an exact reference's outer iterations.
const ITERATIONS: usize = 200;

/// Outer tolerance of a converged reference: far below what its time steps leave.
const CONVERGED_TOLERANCE: f64 = 1e-8;

/// Contacts' tolerance of a converged reference.
const CONVERGED_CONTACT_TOLERANCE: f64 = 1e-4;

/// Direct solves of the same formulation to [`TOLERANCE`] and [`CONTACT_TOLERANCE`], without substeps, which would be
/// another motion.
pub fn exact_settings(step: &StepParams) -> Settings {
    let step = StepParams {
        relative_tolerance: TOLERANCE,
        absolute_tolerance: TOLERANCE,
        contact_tolerance: CONTACT_TOLERANCE,
        max_iterations: ITERATIONS,
        max_halvings: 0,
        ..*step
    };
    Settings { step, ..Settings::default() }
}

/// The motion of one formulation at the problem's time step, solved as [`exact_settings`].
#[derive(Clone, Debug, PartialEq)]
pub struct Exact {
    /// Formulation.
    pub formulation: Formulation,
    /// Worst status of any step; [`Status::OutOfIterations`] where a tolerance is below rounding errors, or contacts do not
    /// settle to theirs: then errors below the contacts' tolerance of the ways say nothing.
    pub status: Status,
    /// First step, from 1, in which segments met an obstacle or each other.
    pub first_contact: Option<usize>,
    /// Centres of the segments [m] at each of the problem's samples.
    pub frames: Vec<Vec<Vector3<f64>>>,
}

impl Exact {
    /// Simulates `steps` steps of `dt` [s]; the frames are those of all steps. `None` where `go_on()` says so after one.
    pub(super) fn of_all_steps(
        model: &Model,
        state: &State,
        (dt, steps): (f64, usize),
        formulation: Formulation,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<Option<Self>, SimulationError> {
        let settings = exact_settings(&StepParams { formulation, ..StepParams::default() });
        let mut simulation = Simulation::new(model, state, &settings, None)?;
        let mut exact = Self { formulation, status: Status::Converged, first_contact: None, frames: Vec::new() };
        let mut now = state.clone();
        for step in 1..=steps {
            exact.status = exact.status.max(simulation.step(dt)?.status);
            if exact.first_contact.is_none() && simulation.counters().contact_solves > 0 {
                exact.first_contact = Some(step);
            }
            simulation.store(&mut now);
            exact.frames.push(now.positions.clone());
            if !go_on() {
                return Ok(None);
            }
        }
        Ok(Some(exact))
    }
}

/// A scene with every segment cut into `factor` parts: part j of segment i is segment `factor * i + j`.
#[derive(Clone, Debug)]
pub struct Refined {
    /// Number of parts of a segment; at least 1.
    pub factor: usize,
    /// Model.
    pub model: Model,
    /// First state.
    pub state: State,
}

impl Refined {
    /// What the centres of the uncut segments would be [m]: a segment is the chord between two places in the material,
    /// so that its centre is halfway between the ends of its parts.
    ///
    /// At the start this is where the uncut scene has them, for curved rods, too, whose parts do not lie on the chord.
    fn centres(&self, state: &State) -> Vec<Vector3<f64>> {
        let end = |i: usize, side: f64| state.positions[i] + state.axis(i) * (side * self.model.segments[i].length);
        let chord = |first: usize| 0.5 * (end(first, -0.5) + end(first + self.factor - 1, 0.5));
        (0..self.model.segments.len()).step_by(self.factor).map(chord).collect()
    }
}

/// A motion that is converged in time step and segment length, as far as [`Converged::error`] says.
///
/// Segments are cut into k parts and time steps into k^2, formulation `newton`, direct solves. What is left are the
/// errors of implicit Euler, O(1/k^2), and of the segments' length: O(1/k) where whole segments are clamped or rods branch,
/// O(1/k^2) elsewhere. With contacts there is nothing to converge to after the first.
#[derive(Clone, Debug, PartialEq)]
pub struct Converged {
    /// Parts of a segment, in each run; those of the reference come last.
    pub factors: Vec<usize>,
    /// Worst status of any step of any run.
    pub status: String,
    /// First step of the problem's, from 1, in which the reference had contacts.
    pub first_contact: Option<usize>,
    /// Centres of the uncut segments [m] at each of the problem's samples.
    pub frames: Vec<Vec<Vector3<f64>>>,
    /// Position errors of each run but the last against the next one, at each sample.
    pub differences: Vec<Vec<f64>>,
}

impl Converged {
    /// Estimate of the reference's own position error at each sample: how far the next coarser one is from it.
    ///
    /// Where a refinement by two halves the error (order 1/k) this is the error itself, where it divides it by four three
    /// times as much. Where [`Converged::differences`] do not fall from run to run it is no estimate, but says that the motion
    /// is not converged.
    pub fn error(&self) -> &[f64] {
        self.differences.last().map_or(&[], Vec::as_slice)
    }

    /// Runs a problem's refined scenes, coarsest first; at least two, the uncut one possibly among them, tell how far it is
    /// converged. After each step of the problem's in each run `go_on()` says whether to go on; `None` if not.
    ///
    /// # Errors
    /// If a refined scene is not valid.
    pub fn new(
        problem: &Problem,
        refined: &[Refined],
        mut go_on: impl FnMut() -> bool,
    ) -> Result<Option<Self>, SimulationError> {
        let Problem { model, dt, samples, .. } = problem;
        let step = StepParams {
            formulation: Formulation::Newton,
            relative_tolerance: CONVERGED_TOLERANCE,
            absolute_tolerance: CONVERGED_TOLERANCE,
            contact_tolerance: CONVERGED_CONTACT_TOLERANCE,
            ..StepParams::default()
        };
        let settings = Settings { step, ..Settings::default() };
        let mut status = Status::Converged;
        let (mut frames, mut first_contact, mut differences) = (Vec::new(), None, Vec::new());
        for scene in refined {
            let (mut now, mut finer) = (scene.state.clone(), Vec::with_capacity(samples.len()));
            let guess = |model: &_, members: &_, topology: &_| GuessKind::StepQuadratic.build(model, members, topology);
            let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, Some(&guess))?;
            first_contact = None;
            let parts = scene.factor * scene.factor;
            for step in 1..=samples.last().copied().unwrap_or(0) {
                for _ in 0..parts {
                    status = status.max(simulation.step(*dt / parts as f64)?.status);
                }
                if first_contact.is_none() && simulation.counters().contact_solves > 0 {
                    first_contact = Some(step);
                }
                if samples.contains(&step) {
                    simulation.store(&mut now);
                    finer.push(scene.centres(&now));
                }
                if !go_on() {
                    return Ok(None);
                }
            }
            let coarser = std::mem::replace(&mut frames, finer);
            if !coarser.is_empty() {
                differences.push(coarser.iter().zip(&frames).map(|(a, b)| position_error(model, a, b)).collect());
            }
        }
        let factors = refined.iter().map(|scene| scene.factor).collect();
        Ok(Some(Self { factors, status: status.name().to_owned(), first_contact, frames, differences }))
    }
}
