//! Newton's method in a step: the positive matrix and the exact tangent side by side.

use cosserat::guess::{self, Members, Topology};
use cosserat::scene::Scene;
use cosserat::simulation::{Formulation, Integrator, Settings, Simulation, SimulationError, StepParams, Tangent};
use cosserat::state::{Model, State};
use serde::{Deserialize, Serialize};

use crate::compare::{self, Entry};
use crate::precision::reference;

/// What is measured; the first is what the others are held against.
const TANGENTS: [Tangent; 3] = [Tangent::Positive, Tangent::Exact, Tangent::Auto];
/// Steps of one way before the next has its turn.
const TURN: usize = 10;

/// What one matrix came to on a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ending {
    /// Name of the [`Tangent`].
    pub tangent: String,
    /// Start of steps, the one that is chosen for the scene.
    pub guess: String,
    /// Worst status of any step.
    pub status: String,
    /// Outer iterations a step, over all connected sets.
    pub iterations: f64,
    /// Mean wall time of a step [us]: what hard steps take is what the matrices differ by.
    pub step_us: f64,
    /// The residual after 1, 2, ... iterations of the step in the middle of the run, from the prediction: gaps in segment lengths,
    /// angles in radians.
    pub left: Vec<f64>,
}

/// Runs so many steps of a scene with each matrix in turns, to these tolerances. After each turn `progress(steps)` says whether
/// to go on; `None` if not.
///
/// # Errors
/// If the scene is not valid, or has no exact tangent.
pub fn measure(
    Scene { model, state, run, .. }: &Scene,
    steps: usize,
    mut progress: impl FnMut(usize) -> bool,
) -> Result<Option<Vec<Ending>>, SimulationError> {
    let ways = TANGENTS.map(|tangent| {
        let step = StepParams {
            formulation: Formulation::Newton,
            integrator: Integrator::Euler,
            tangent,
            ..StepParams::DEFAULT
        };
        (step, guess::choose(model, &step, None))
    });
    let builds = ways.each_ref().map(|(_, choice)| {
        |model: &Model, members: &Members, topology: &Topology| choice.build_guess(model, members, topology)
    });
    let entries: Vec<_> = ways
        .iter()
        .zip(&builds)
        .map(|((step, choice), build)| Entry {
            name: step.tangent.name().to_owned(),
            settings: Settings { step: *step, solver: choice.solver },
            guess: Some(build),
        })
        .collect();
    let exact = reference::exact_settings(&ways[0].0);
    let mut done = 0;
    let comparison = compare::run_in_turns(model, state, (run.dt, steps), (TURN, &exact), &entries, |count| {
        done += count;
        progress(count)
    })?;
    if done < steps {
        return Ok(None);
    }
    let ending = |(row, (step, choice)): (&compare::EntryRun, &(StepParams, guess::Choice))| {
        Ok(Ending {
            tangent: row.name.clone(),
            guess: choice.guess.to_string(),
            status: row.status.name().to_owned(),
            iterations: row.counters.iterations as f64 / steps as f64,
            step_us: row.by_step.iter().map(|cost| 1e6 * cost.total_s).sum::<f64>() / steps as f64,
            left: left(model, state, &Settings { step: *step, solver: choice.solver }, run.dt, steps / 2)?,
        })
    };
    comparison.rows.iter().zip(&ways).map(ending).collect::<Result<_, SimulationError>>().map(Some)
}

/// Most iterations that [`left`] looks at.
const ITERATIONS: usize = 12;

/// See [`Ending::left`]; of the step after so many.
fn left(model: &Model, state: &State, settings: &Settings, dt: f64, steps: usize) -> Result<Vec<f64>, SimulationError> {
    let mut simulation = Simulation::new(model, state, settings, None)?;
    for _ in 0..steps {
        simulation.step(dt)?;
    }
    let mut start = state.clone();
    simulation.store(&mut start);
    let after = |max_iterations| {
        // A cap on the iterations, and nothing else that ends them.
        let step = StepParams {
            relative_tolerance: 0.0,
            motion_tolerance: 0.0,
            absolute_tolerance: 0.0,
            max_halvings: 0,
            max_iterations,
            ..settings.step
        };
        let mut once = Simulation::new(model, &start, &Settings { step, ..*settings }, None)?;
        once.step(dt)?;
        let counters = once.counters();
        Ok(counters.worst_stretch.max(counters.worst_bend).max(counters.worst_momentum))
    };
    (1..=ITERATIONS).map(after).collect()
}
