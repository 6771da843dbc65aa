//! Several solvers and guesses side by side on one scene.
//!
//! All run the same scene in turns, so that they share what else the machine does; each to the tolerances of its own
//! settings. The error of each against a reference at the same time step stands beside its times.

use cosserat::guess::GuessFactory;
use cosserat::simulation::{Counters, Settings, Simulation, SimulationError, Status, StepParams};
use cosserat::state::{Model, State};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::precision::metrics::position_error;
use crate::precision::reference;
use crate::stages::Stages;

/// A way to simulate the scene.
pub struct Entry<'a> {
    /// Its name in the table.
    pub name: String,
    /// Formulation, tolerances, linear solver.
    pub settings: Settings,
    /// Guess; `None` for a zero start.
    pub guess: Option<GuessFactory<'a>>,
}

/// What an entry came to.
#[derive(Clone, Debug)]
pub struct EntryRun {
    /// Name of the entry.
    pub name: String,
    /// Worst status of any step.
    pub status: Status,
    /// The step in which it was given up, because it did not converge and its linear solver had run out of iterations;
    /// `None` where it did all.
    pub given_up: Option<usize>,
    /// Connected sets of segments.
    pub sets: usize,
    /// What was done in all steps.
    pub counters: Counters,
    /// Median wall time of each stage of a step.
    pub median_us: Stages,
    /// Largest error of any step's positions against the reference: root mean square over the segments, relative to
    /// the rods' mean length. It is taken before the first contact alone: see [`Comparison::first_contact`].
    pub error: f64,
    /// What each step came to.
    pub by_step: Vec<Cost>,
}

/// What a step, or several, came to, over all connected sets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Outer iterations.
    pub iterations: u64,
    /// Iterations of the linear solver.
    pub linear_iterations: u64,
    /// Wall time of the guesses [s].
    pub guess_s: f64,
    /// Wall time of the linear solves [s].
    pub solve_s: f64,
    /// Wall time of the contacts [s].
    pub contact_s: f64,
    /// Wall time of all stages [s].
    pub total_s: f64,
}

/// All ways, and what they were measured against.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// One an entry.
    pub rows: Vec<EntryRun>,
    /// Steps done.
    pub steps: usize,
    /// Worst status of any step of the reference before its first contact; "out of iterations" where its tolerance is
    /// below rounding errors.
    pub reference_status: Status,
    /// The first step of the reference in which segments met an obstacle or each other. There it ends: a contact that one
    /// way meets a moment earlier, or beside another segment, sends the rods elsewhere, and errors tell chaos from accuracy
    /// no more.
    pub first_contact: Option<usize>,
}

/// Runs all entries step by step beside the first one's formulation, solved as [`reference::exact_settings`]. After each
/// step `progress(1)` says whether to go on.
///
/// # Errors
/// If the scene or an entry is not valid.
pub fn run(
    model: &Model,
    state: &State,
    dt: f64,
    steps: usize,
    entries: &[Entry<'_>],
    progress: impl FnMut(usize) -> bool,
) -> Result<Comparison, SimulationError> {
    let step = entries.first().map_or(StepParams::default(), |first| first.settings.step);
    run_in_turns(model, state, (dt, steps), (1, &reference::exact_settings(&step)), entries, progress)
}

/// Runs `steps` steps of `dt` [s] of all entries in turns of `turn` steps beside a reference of these settings, which runs
/// until its first contact. Short turns share what else the machine does, long ones also have the caches to themselves. After
/// each turn `progress(steps)` says whether to go on.
///
/// # Errors
/// If the scene, the reference or an entry is not valid.
pub fn run_in_turns(
    model: &Model,
    state: &State,
    (dt, steps): (f64, usize),
    (turn, reference): (usize, &Settings),
    entries: &[Entry<'_>],
    mut progress: impl FnMut(usize) -> bool,
) -> Result<Comparison, SimulationError> {
    let mut reference = Simulation::new(model, state, reference, None)?;
    let mut runs = entries.iter().map(|entry| Running::new(model, state, entry)).collect::<Result<Vec<_>, _>>()?;
    let (mut done, mut turns, mut reference_status, mut first_contact) = (0, 0, Status::Converged, None);
    let mut now = state.clone();
    while done < steps {
        let turn = turn.clamp(1, steps - done);
        let mut expected = Vec::with_capacity(turn);
        while expected.len() < turn && first_contact.is_none() {
            let status = reference.step(dt)?.status;
            if reference.counters().contact_solves > 0 {
                first_contact = Some(done + expected.len() + 1);
            } else {
                reference_status = reference_status.max(status);
                reference.store(&mut now);
                expected.push(now.positions.clone());
            }
        }
        // Each begins as often as others: what comes after the reference finds cold caches.
        for entry in 0..entries.len() {
            let run = &mut runs[(turns + entry) % entries.len()];
            for step in 0..turn {
                run.step((model, dt), expected.get(step), &mut now)?;
            }
        }
        turns += 1;
        done += turn;
        if !progress(turn) {
            break;
        }
    }
    let rows = runs.into_iter().map(|way| EntryRun { median_us: Stages::medians(&way.stages), ..way.run }).collect();
    Ok(Comparison { rows, steps: done, reference_status, first_contact })
}

/// An entry being run.
struct Running {
    simulation: Simulation,
    stages: Vec<Stages>,
    run: EntryRun,
}

impl Running {
    fn new(model: &Model, state: &State, entry: &Entry<'_>) -> Result<Self, SimulationError> {
        let simulation = Simulation::new(model, state, &entry.settings, entry.guess)?;
        let run = EntryRun {
            name: entry.name.clone(),
            status: Status::Converged,
            given_up: None,
            sets: simulation.components(),
            counters: simulation.counters(),
            median_us: Stages::default(),
            error: 0.0,
            by_step: Vec::new(),
        };
        Ok(Self { simulation, stages: Vec::new(), run })
    }

    /// A step, unless it was given up; `expected` are the reference's positions after it, where there are some.
    fn step(
        &mut self,
        (model, dt): (&Model, f64),
        expected: Option<&Vec<Vector3<f64>>>,
        found: &mut State,
    ) -> Result<(), SimulationError> {
        let Self { simulation, run, .. } = self;
        if run.given_up.is_some() {
            return Ok(());
        }
        let status = simulation.step(dt)?.status;
        let (before, after) = (run.counters, simulation.counters());
        let stages = Stages::between(&before, &after);
        (run.status, run.counters) = (run.status.max(status), after);
        run.by_step.push(Cost {
            iterations: after.iterations - before.iterations,
            linear_iterations: after.linear_iterations - before.linear_iterations,
            guess_s: 1e-6 * stages.guess,
            solve_s: 1e-6 * stages.solve,
            contact_s: 1e-6 * stages.contact,
            total_s: 1e-6 * stages.total,
        });
        self.stages.push(stages);
        if status >= Status::OutOfIterations && after.linear_failures > before.linear_failures {
            run.given_up = Some(run.by_step.len());
        }
        if let Some(expected) = expected {
            simulation.store(found);
            run.error = run.error.max(position_error(model, &found.positions, expected));
        }
        Ok(())
    }
}
