//! Several solvers and guesses side by side on one scene.

use std::time::Duration;

use rod::{Model, State};
use serde::{Deserialize, Serialize};
use solver::counters::{Counters, StageTimes};
use solver::simulation::{GuessFactory, Settings, Simulation, SimulationError};
use solver::step::{Status, StepParams};

use crate::precision::metrics::position_error;
use crate::precision::reference;

/// A way to simulate the scene.
pub struct Entry<'a> {
    /// Its name in the table.
    pub name: String,
    /// Formulation, tolerances, linear solver.
    pub settings: Settings,
    /// Guess; `None` for a zero start.
    pub guess: Option<GuessFactory<'a>>,
}

/// What a way came to.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the entry.
    pub name: String,
    /// Worst status of any step.
    pub status: &'static str,
    /// The step in which it was given up, because it did not converge and its linear solver had run out of iterations;
    /// `None` where it did all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub given_up: Option<usize>,
    /// Outer iterations per step and connected set.
    pub iterations_per_step: f64,
    /// Iterations of the linear solver per outer iteration; 0 for direct solvers.
    pub linear_iterations_per_solve: f64,
    /// Median outer iterations of a step, summed over connected sets.
    pub outer_median: f64,
    /// Median iterations of the linear solver in a step, summed over connected sets.
    pub linear_median: f64,
    /// Median wall time of a step [us]: wind and drag.
    pub drag_us: f64,
    /// Median wall time of a step [us]: prediction and velocities.
    pub predict_us: f64,
    /// Median wall time of a step [us]: guesses.
    pub guess_us: f64,
    /// Median wall time of a step [us]: constraints, Jacobians, mass matrices.
    pub assemble_us: f64,
    /// Median wall time of a step [us]: linear solves.
    pub solve_us: f64,
    /// Median wall time of a step [us]: update of multipliers and poses.
    pub update_us: f64,
    /// Median wall time of a step [us]: contacts.
    pub contact_us: f64,
    /// Median wall time of a step [us]: all stages.
    pub total_us: f64,
    /// Largest error of any step's positions against the reference: root mean square over the segments, relative to
    /// the rods' mean length. It is taken before the first contact alone: see [`Comparison::first_contact`].
    pub error: f64,
    /// What each step came to.
    #[serde(skip)]
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
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// One row an entry.
    pub rows: Vec<Row>,
    /// Steps done.
    pub steps: usize,
    /// Worst status of any step of the reference before its first contact; "out of iterations" where its tolerance is below rounding errors.
    pub reference_status: &'static str,
    /// The first step of the reference in which segments met an obstacle or each other. There it ends: a contact that one
    /// way meets a moment earlier, or beside another segment, sends the rods elsewhere, and errors tell chaos from accuracy
    /// no more.
    pub first_contact: Option<usize>,
}

/// Runs all entries in lockstep, so that they share the machine's moods, beside a reference: the first entry's
/// formulation, solved as [`reference::exact_settings`] until its first contact. After each step `progress(step)` says whether to go on.
///
/// # Errors
/// If the scene or an entry is not valid.
pub fn run(
    model: &Model,
    state: &State,
    dt: f64,
    steps: usize,
    entries: &[Entry<'_>],
    mut progress: impl FnMut(usize) -> bool,
) -> Result<Comparison, SimulationError> {
    let step = entries.first().map_or(StepParams::default(), |first| first.settings.step);
    let exact = reference::exact_settings(&step);
    let mut reference = Simulation::new(model, state, &exact, None)?;
    let mut runs = Vec::new();
    for entry in entries {
        runs.push(Run {
            simulation: Simulation::new(model, state, &entry.settings, entry.guess)?,
            status: Status::Converged,
            given_up: None,
            error: 0.0,
            costs: Vec::with_capacity(steps),
        });
    }
    let (mut expected, mut found) = (state.clone(), state.clone());
    let (mut done, mut reference_status, mut first_contact) = (0, Status::Converged, None);
    while done < steps {
        if first_contact.is_none() {
            let status = reference.step(dt)?.status;
            if reference.counters().contact_solves > 0 {
                first_contact = Some(done + 1);
            } else {
                reference_status = reference_status.max(status);
                reference.store(&mut expected);
            }
        }
        for run in runs.iter_mut().filter(|run| run.given_up.is_none()) {
            let before = run.simulation.counters();
            let status = run.simulation.step(dt)?.status;
            let after = run.simulation.counters();
            run.status = run.status.max(status);
            run.costs.push(between(&before, &after));
            if status >= Status::OutOfIterations && after.linear_failures > before.linear_failures {
                run.given_up = Some(done + 1);
            }
            if first_contact.is_some() {
                continue;
            }
            run.simulation.store(&mut found);
            run.error = run.error.max(position_error(model, &found.positions, &expected.positions));
        }
        done += 1;
        if !progress(done) {
            break;
        }
    }
    let rows = entries.iter().zip(&runs).map(|(entry, run)| run.row(entry, done)).collect();
    Ok(Comparison { rows, steps: done, reference_status: reference_status.name(), first_contact })
}

struct Run {
    simulation: Simulation,
    status: Status,
    given_up: Option<usize>,
    error: f64,
    /// Of each step, the times of the seven stages and their sum [us], then its outer and its linear iterations.
    costs: Vec<[f64; 10]>,
}

impl Run {
    fn row(&self, entry: &Entry<'_>, steps: usize) -> Row {
        let counters = self.simulation.counters();
        let solves = (self.given_up.unwrap_or(steps) * self.simulation.components()).max(1);
        let [
            drag_us,
            predict_us,
            guess_us,
            assemble_us,
            solve_us,
            update_us,
            contact_us,
            total_us,
            outer_median,
            linear_median,
        ] = std::array::from_fn(|k| median(self.costs.iter().map(|costs| costs[k]).collect()));
        Row {
            name: entry.name.clone(),
            status: self.status.name(),
            given_up: self.given_up,
            iterations_per_step: counters.iterations as f64 / solves as f64,
            linear_iterations_per_solve: counters.linear_iterations as f64 / counters.iterations.max(1) as f64,
            outer_median,
            linear_median,
            drag_us,
            predict_us,
            guess_us,
            assemble_us,
            solve_us,
            update_us,
            contact_us,
            total_us,
            error: self.error,
            by_step: self.costs.iter().map(cost).collect(),
        }
    }
}

/// What a step cost, by two readings: see [`Run::costs`].
pub(crate) fn between(before: &Counters, after: &Counters) -> [f64; 10] {
    let us = |time: fn(&StageTimes) -> Duration| (time(&after.times) - time(&before.times)).as_secs_f64() * 1e6;
    let count = |count: fn(&Counters) -> u64| (count(after) - count(before)) as f64;
    [
        us(|times| times.drag),
        us(|times| times.predict),
        us(|times| times.guess),
        us(|times| times.assemble),
        us(|times| times.solve),
        us(|times| times.update),
        us(|times| times.contact),
        us(StageTimes::total),
        count(|counters| counters.iterations),
        count(|counters| counters.linear_iterations),
    ]
}

/// A step's costs that are told one by one.
fn cost(&[_, _, guess_us, _, solve_us, _, contact_us, total_us, iterations, linear_iterations]: &[f64; 10]) -> Cost {
    Cost {
        // Whole numbers, exact in an f64.
        iterations: iterations as u64,
        linear_iterations: linear_iterations as u64,
        guess_s: 1e-6 * guess_us,
        solve_s: 1e-6 * solve_us,
        contact_s: 1e-6 * contact_us,
        total_s: 1e-6 * total_us,
    }
}

/// Median; zero where there is nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
