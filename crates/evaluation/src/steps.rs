//! Starts of whole steps: outer iterations and time from each, over many simulations.
//!
//! All starts run the same scene, in turns of some steps, so that they share the machine's moods but not its caches; each
//! to the same tolerance of the same residual, which no start changes.
//! Their motions are the same but for what the tolerance allows: the error of each, against a reference solved tightly,
//! stands beside its iterations. Times are of whole steps, what the guess does and learns included.

use std::time::Duration;

use rod::{Model, State};
use serde::Serialize;
use solver::counters::Counters;
use solver::simulation::{GuessFactory, Settings, Simulation, SimulationError};

use crate::guesses::Spread;
use crate::precision::metrics::position_error;

/// Steps of a turn.
const TURN: usize = 10;

/// What one start came to in one simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Steps.
    pub steps: u64,
    /// Outer iterations.
    pub iterations: u64,
    /// Steps done again in halves.
    pub retries: u64,
    /// Starts that were dropped, those included whose step was done again from the prediction.
    pub dropped: u64,
    /// Steps that did not converge, or whose numbers were not finite.
    pub failed: u64,
    /// Largest error of any step's positions: root mean square over the segments, relative to the rods' mean length.
    pub error: f64,
    /// Time of the steps.
    pub time: Duration,
    /// Time of the guess, which is part of it.
    pub guess_time: Duration,
}

impl Tally {
    fn new(steps: u64, counters: &Counters, error: f64) -> Self {
        Self {
            steps,
            iterations: counters.iterations,
            retries: counters.retries,
            dropped: counters.guesses_dropped,
            failed: counters.not_converged + counters.non_finite,
            error,
            time: counters.times.total(),
            guess_time: counters.times.guess,
        }
    }
}

/// Simulates a scene from every start, for so many steps of `dt` [s], in turns; after each turn of as many steps
/// `progress(steps)` says whether to go on.
///
/// # Errors
/// If the scene or the settings are not valid.
pub fn measure(
    model: &Model,
    state: &State,
    (dt, steps): (f64, usize),
    settings: &Settings,
    starts: &[Option<GuessFactory<'_>>],
    mut progress: impl FnMut(usize) -> bool,
) -> Result<Vec<Tally>, SimulationError> {
    let new = |&start: &Option<GuessFactory<'_>>| Simulation::new(model, state, settings, start);
    let mut simulations = starts.iter().map(new).collect::<Result<Vec<_>, _>>()?;
    let mut exact = *settings;
    exact.step.relative_tolerance = 1e-3 * settings.step.relative_tolerance.min(1e-6);
    exact.step.absolute_tolerance = exact.step.relative_tolerance;
    let mut reference = Simulation::new(model, state, &exact, None)?;
    let (mut expected, mut found) = (vec![state.clone(); TURN.min(steps)], state.clone());
    let mut errors = vec![0.0_f64; starts.len()];
    let mut done = 0;
    while done < steps {
        let turn = &mut expected[..TURN.min(steps - done)];
        for state in turn.iter_mut() {
            reference.step(dt)?;
            reference.store(state);
        }
        for (simulation, error) in simulations.iter_mut().zip(&mut errors) {
            for state in turn.iter() {
                simulation.step(dt)?;
                simulation.store(&mut found);
                *error = error.max(position_error(model, &found.positions, &state.positions));
            }
        }
        done += turn.len();
        if !progress(turn.len()) {
            break;
        }
    }
    let done = done as u64;
    let tally = |(simulation, error): (&Simulation, f64)| Tally::new(done, &simulation.counters(), error);
    Ok(simulations.iter().zip(errors).map(tally).collect())
}

/// A start on one kind of scenes, at one time step and tolerance.
#[derive(Clone, Debug, Serialize)]
pub struct Cell {
    /// Start.
    pub guess: String,
    /// Whether it has learned before the first step.
    pub is_learned: bool,
    /// Outer iterations a step.
    pub iterations: Option<Spread>,
    /// The same, relative to the start without learning that needs the fewest (in the median).
    pub iteration_ratio: Option<Spread>,
    /// Time a step [us].
    pub time_us: Option<Spread>,
    /// The same, relative to the start without learning that takes the least (in the median).
    pub time_ratio: Option<Spread>,
    /// Part of the time that is the guess's own [us].
    pub guess_us: Option<Spread>,
    /// Steps done again in halves, of all steps.
    pub retried: f64,
    /// Starts that were dropped, of all steps, those included whose step was done again from the prediction.
    pub dropped: f64,
    /// Steps that did not converge, of all.
    pub failed: f64,
    /// Largest position error of a simulation, relative to the rods' length.
    pub error: Option<Spread>,
}

/// One cell a start, from the tallies of each simulation (one a start). `learned` says which starts are.
pub fn cells(starts: &[(String, bool)], simulations: &[Vec<Tally>]) -> Vec<Cell> {
    let per_step = |tally: &Tally, value: f64| value / tally.steps as f64;
    let iterations = |tally: &Tally| per_step(tally, tally.iterations as f64);
    let time = |tally: &Tally| per_step(tally, 1e6 * tally.time.as_secs_f64());
    let spread = |start: usize, value: &dyn Fn(&Tally) -> f64| {
        Spread::of(simulations.iter().map(|tallies| value(&tallies[start])))
    };
    let best = |value: &dyn Fn(&Tally) -> f64| {
        let median = |start: usize| spread(start, value).map_or(f64::INFINITY, |spread| spread.median);
        let plain = (0..starts.len()).filter(|&start| !starts[start].1);
        plain.min_by(|&a, &b| median(a).total_cmp(&median(b)))
    };
    let ratio = |start: usize, best: Option<usize>, value: &dyn Fn(&Tally) -> f64| {
        let of = |tallies: &Vec<Tally>| best.map_or(f64::NAN, |best| value(&tallies[start]) / value(&tallies[best]));
        Spread::of(simulations.iter().map(of))
    };
    let (fewest, fastest) = (best(&iterations), best(&time));
    let share = |start: usize, count: fn(&Tally) -> u64| {
        let sum = |count: fn(&Tally) -> u64| simulations.iter().map(|tallies| count(&tallies[start])).sum::<u64>();
        sum(count) as f64 / sum(|tally| tally.steps).max(1) as f64
    };
    let cell = |(start, (guess, is_learned)): (usize, &(String, bool))| Cell {
        guess: guess.clone(),
        is_learned: *is_learned,
        iterations: spread(start, &iterations),
        iteration_ratio: ratio(start, fewest, &iterations),
        time_us: spread(start, &time),
        time_ratio: ratio(start, fastest, &time),
        guess_us: spread(start, &|tally| per_step(tally, 1e6 * tally.guess_time.as_secs_f64())),
        retried: share(start, |tally| tally.retries),
        dropped: share(start, |tally| tally.dropped),
        failed: share(start, |tally| tally.failed),
        error: spread(start, &|tally| tally.error),
    };
    starts.iter().enumerate().map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_to_the_best_start_without_learning() {
        let tally = |iterations: u64, ms: u64| Tally {
            steps: 10,
            iterations,
            time: Duration::from_millis(ms),
            ..Tally::default()
        };
        let starts = [("zero", false), ("parabola", false), ("net", true)].map(|(name, is)| (name.to_owned(), is));
        // The parabola needs fewer iterations, but more time.
        let simulations = vec![vec![tally(40, 4), tally(20, 5), tally(10, 3)]; 3];
        let cells = cells(&starts, &simulations);
        let median = |spread: Option<Spread>| spread.unwrap().median;
        assert_eq!(cells.iter().map(|cell| median(cell.iterations)).collect::<Vec<_>>(), [4.0, 2.0, 1.0]);
        assert_eq!(cells.iter().map(|cell| median(cell.iteration_ratio)).collect::<Vec<_>>(), [2.0, 1.0, 0.5]);
        assert_eq!(cells.iter().map(|cell| median(cell.time_us)).collect::<Vec<_>>(), [400.0, 500.0, 300.0]);
        assert_eq!(cells.iter().map(|cell| median(cell.time_ratio)).collect::<Vec<_>>(), [1.0, 1.25, 0.75]);
    }
}
