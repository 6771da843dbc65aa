//! Error against run time over the time step: formulations and integrators, each with default tolerances.
//!
//! A [`Problem`] is a scene over a fixed time, with what its runs are held against: a run with 32 times as many steps, or a
//! value that theory gives ([`cases`]). [`run`] simulates it with one time step and gives a [`Point`].
//!
//! **Errors** against a refined run are the largest of eight samples, evenly spread over the time: of positions
//! ([`position_error`]), and of what joints transmit, root mean square relative to that of the refined run. The segments stay
//! as they are, so that the error is that of the time step and of the tolerances alone. **Times** are those of all stages of a
//! step, per simulated second, of one thread without the time in which it did not run.
//!
//! This module knows nothing of how results are shown.

pub mod cases;

use cases::Frame;
use cosserat::guess;
use cosserat::scene::{self, Scene};
use cosserat::simulation::{Formulation, Integrator, Settings, Simulation, SimulationError, Status, StepParams};
use cosserat::state::JointForce;
use serde::{Deserialize, Serialize};

use crate::benchmark::BenchmarkError;
use crate::guesses::Spread;
use crate::precision::metrics::position_error;
use crate::precision::run::timed;

/// What runs are held against.
#[derive(Clone, Debug)]
enum Against {
    /// A refined run at each sample.
    Refined(Vec<Frame>),
    /// What theory says: the error of the last frame.
    Theory(cases::Error),
}

/// A run.
struct Simulated {
    /// At each sample.
    frames: Vec<Frame>,
    /// Worst status of any step.
    status: Status,
    /// Wall time per simulated second [s/s].
    time: f64,
    /// Iterations a step and connected set.
    iterations: f64,
}

/// A scene over a fixed time.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The scene; its time step is the unit of a run's.
    pub scene: Scene,
    /// Names of the errors, with what they are relative to.
    pub errors: Vec<&'static str>,
    /// Errors of a run with half as many steps as the refined one: below them nothing can be told apart; empty against theory.
    pub floor: Vec<f64>,
    /// Steps at the scene's time step.
    steps: usize,
    against: Against,
}

/// What a run came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Time step [s].
    pub dt: f64,
    /// Worst status of any step.
    pub status: String,
    /// Whether each step met its tolerances.
    pub is_solved: bool,
    /// Iterations a step and connected set.
    pub iterations: f64,
    /// Wall time per simulated second [s/s].
    pub time: Option<Spread>,
    /// Errors, in the order of [`Problem::errors`].
    pub errors: Vec<f64>,
}

/// The settings of a formulation with an integrator: all but these two as `simulate` has them by default.
pub fn settings(formulation: Formulation, integrator: Integrator) -> Settings {
    let step = StepParams { formulation, integrator, ..StepParams::default() };
    Settings { step, ..Settings::default() }
}

impl Problem {
    /// A builtin scene over so many of its steps, a multiple of 32, beside a refined run. `None` where `go_on()` says so.
    ///
    /// # Errors
    /// If the scene cannot be simulated.
    pub fn refined(name: &str, steps: usize, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Self>, BenchmarkError> {
        let errors = vec!["positions, to the rods' mean length", "forces of joints, to their root mean square"];
        let scene = scene::builtin(name)?;
        let against = Against::Refined(Vec::new());
        let mut problem = Self { scene, errors, floor: Vec::new(), steps, against };
        let settings = settings(Formulation::Newton, Integrator::Bdf2);
        let step = StepParams { relative_tolerance: 1e-9, motion_tolerance: 1e-9, ..settings.step };
        let settings = Settings { step, ..settings };
        let Some(refined) = problem.simulate(&settings, 32.0, go_on)? else { return Ok(None) };
        problem.against = Against::Refined(refined.frames);
        let Some(coarser) = problem.simulate(&settings, 16.0, go_on)? else { return Ok(None) };
        problem.floor = problem.errors_of(&coarser.frames);
        Ok(Some(problem))
    }

    /// A case with a right value.
    ///
    /// # Errors
    /// If its scene is not valid.
    pub fn theory(case: &cases::Case) -> Result<Self, BenchmarkError> {
        let scene = (case.scene)()?;
        let (steps, against) = (scene.run.steps, Against::Theory(case.error));
        Ok(Self { scene, errors: vec![case.quantity], floor: Vec::new(), steps, against })
    }

    /// Runs it with so many steps for each of the scene's: a power of two, from 1/4 on.
    fn simulate(
        &self,
        settings: &Settings,
        substeps: f64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Simulated>, SimulationError> {
        let Scene { model, state, run, .. } = &self.scene;
        let choice = guess::choose(model, &settings.step, Some(settings.solver));
        let start = |model: &_, members: &_, topology: &_| choice.build_guess(model, members, topology);
        let mut simulation = Simulation::new(model, state, settings, Some(&start))?;
        let steps = (self.steps as f64 * substeps).round() as usize;
        let dt = run.dt / substeps;
        let (mut status, mut time, mut frames) = (Status::Converged, 0.0, Vec::new());
        for step in 1..=steps {
            let (of_step, took) = timed(&mut simulation, dt)?;
            status = status.max(of_step);
            time += took;
            // Eight samples.
            if (8 * step).is_multiple_of(steps) {
                let mut frame = Frame { state: state.clone(), forces: vec![JointForce::default(); model.joints.len()] };
                simulation.store(&mut frame.state);
                simulation.store_joint_forces(&mut frame.forces);
                frames.push(frame);
            }
            if !go_on() {
                return Ok(None);
            }
            if status == Status::NonFinite {
                break;
            }
        }
        let counters = simulation.counters();
        let iterations = counters.iterations as f64 / (steps * simulation.components()).max(1) as f64;
        Ok(Some(Simulated { frames, status, time: time / (self.steps as f64 * run.dt), iterations }))
    }

    fn errors_of(&self, frames: &[Frame]) -> Vec<f64> {
        match &self.against {
            Against::Theory(error) => {
                vec![frames.last().map_or(f64::NAN, |last| error(&self.scene, last))]
            }
            Against::Refined(right) => {
                let pairs = || right.iter().zip(frames);
                let worst = |errors: Vec<f64>| errors.into_iter().fold(0.0, f64::max);
                let model = &self.scene.model;
                let positions =
                    pairs().map(|(right, own)| position_error(model, &own.state.positions, &right.state.positions));
                let forces = pairs().map(|(right, own)| {
                    let square = |forces: &mut dyn Iterator<Item = f64>| forces.sum::<f64>().sqrt();
                    let all = square(&mut right.forces.iter().map(|f| f.force.norm_squared()));
                    let both = right.forces.iter().zip(&own.forces);
                    square(&mut both.map(|(a, b)| (a.force - b.force).norm_squared())) / all
                });
                [positions.collect(), forces.collect()].map(worst).to_vec()
            }
        }
    }
}

/// Runs a problem with these settings and so many steps for each of the scene's (a power of two, from 1/4 on), several times.
/// `None` where `go_on()` says so.
///
/// # Errors
/// If the settings do not fit the model.
pub fn run(
    problem: &Problem,
    settings: &Settings,
    substeps: f64,
    repetitions: usize,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Option<Point>, SimulationError> {
    let (mut times, mut point) = (Vec::new(), None);
    for _ in 0..repetitions.max(1) {
        let Some(simulated) = problem.simulate(settings, substeps, go_on)? else { return Ok(None) };
        let Simulated { frames, status, time, iterations } = simulated;
        times.push(time);
        point.get_or_insert_with(|| Point {
            dt: problem.scene.run.dt / substeps,
            status: status.name().to_owned(),
            is_solved: status.is_converged(),
            iterations,
            time: None,
            errors: problem.errors_of(&frames),
        });
    }
    Ok(point.map(|point| Point { time: Spread::of(times.iter().copied()), ..point }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions: the default is of second order, Euler's rule of first. (Forces hold fast waves that no such step resolves.)
    #[test]
    fn errors_fall_by_the_order_of_the_integrator() {
        let problem = Problem::refined("bending-rod", 32, &mut || true).unwrap().unwrap();
        let error = |integrator, substeps| {
            let settings = settings(Formulation::Newton, integrator);
            run(&problem, &settings, substeps, 1, &mut || true).unwrap().unwrap().errors[0]
        };
        for (integrator, least, most) in [(Integrator::Bdf2, 3.0, 5.5), (Integrator::Euler, 1.6, 2.6)] {
            let [coarse, fine] = [1.0, 2.0].map(|substeps| error(integrator, substeps));
            assert!((least..most).contains(&(coarse / fine)), "{integrator}: {coarse:e}, {fine:e}");
        }
    }

    /// Every case comes to its right value with the defaults at its own time step.
    #[test]
    fn cases_come_to_their_right_values() {
        for case in cases::cases().iter().filter(|case| !case.is_long) {
            let problem = Problem::theory(case).unwrap();
            let point = run(&problem, &Settings::default(), 1.0, 1, &mut || true).unwrap().unwrap();
            assert!(point.is_solved && point.errors[0] < 0.02, "{}: {point:?}", case.name);
        }
    }
}
