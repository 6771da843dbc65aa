//! Performance over the number of segments N (paper, section 4, figure on performance).
//!
//! Two readings of one simulation. On the *same systems*, those of the exact motion's first outer iterations
//! ([`crate::guesses::measure`]), each start's iterations and times differ by the start alone: the paper's ratio of iterations, its
//! ratio of inference to vanilla CG's time, and its speed-up of the constraint projection. *Whole runs* in lockstep to the
//! same tolerance ([`speedup::measure`]) give the speed-up of the entire simulation, with the error of each.
//!
//! Fischer's projection and the direct solver stand beside the guesses as rivals.

use cosserat::scene::Scene;
use cosserat::simulation::SimulationError;
use serde::{Deserialize, Serialize};

use super::speedup::{self, SceneRun, Speedup, speedups};
use super::temporal::{self, StartSeries};
use super::{CgSolver, NamedGuess, entries, saved};
use crate::guesses::{Spread, Tally};

/// Simulations of a point of the figure (paper: averaged over 50).
pub const SIMULATIONS: usize = 50;
/// Steps of each (paper: 100).
pub const STEPS: usize = 100;

/// One simulation of a point: on the same systems, zero, the guesses, Fischer's projection and the direct solver, and whole
/// runs, conjugate gradients from the same starts, then the direct solver.
pub type Simulated = (Vec<StartSeries>, SceneRun);

/// Simulates `steps` steps for either reading, `repeats` times each; after each step, `2 repeats steps` in all, `progress()`
/// says whether to go on. `None` where it said stop.
///
/// # Errors
/// If the scene or the settings are not valid.
pub fn measure(
    scene: &Scene,
    steps: usize,
    solver: &CgSolver,
    guesses: &[NamedGuess<'_>],
    repeats: usize,
    mut progress: impl FnMut() -> bool,
) -> Result<Option<Simulated>, SimulationError> {
    let systems = temporal::measure(scene, steps, solver, guesses, repeats, &mut progress)?;
    let Some(systems) = systems else { return Ok(None) };
    let runs = speedup::measure(scene, steps, &entries(solver, guesses), repeats, progress)?;
    Ok(runs.map(|runs| (systems, runs)))
}

/// A point of the figure: all simulations of one N.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// One entry a start, zero first and the direct solver last, on the same systems.
    pub starts: Vec<StartPoint>,
    /// Whole runs, one entry a start and the direct solver last.
    pub runs: Vec<Speedup>,
}

/// A start over all simulations of one N, relative to the zero start of each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartPoint {
    /// Name of the guess.
    pub name: String,
    /// Iterations of conjugate gradients, relative (black curve); zero for the direct solver.
    pub iteration_ratio: Option<Spread>,
    /// Time of the guess over that of the zero start's solves, t_infer / t_CG (purple curve).
    pub inference_ratio: Option<Spread>,
    /// Share of the projection's time saved, the guess's own time taken off (red curve).
    pub projection: Option<Spread>,
}

/// Merges the simulations of one N, which have the same guesses. The whole simulation's speed-up (pink curve) is
/// [`Speedup::total`] of the runs.
pub fn point(cells: &[Simulated]) -> Point {
    let starts = cells.first().map_or(&[][..], |(starts, _)| starts);
    let start_point = |(start, StartSeries { name, .. }): (usize, &StartSeries)| {
        let pairs = || cells.iter().filter_map(|(starts, _)| Some([starts.first()?, starts.get(start)?].map(sum)));
        let spread = |value: fn(Tally, Tally) -> f64| Spread::of(pairs().map(|[zero, own]| value(zero, own)));
        StartPoint {
            name: name.clone(),
            iteration_ratio: spread(|zero, own| own.iterations as f64 / zero.iterations as f64),
            inference_ratio: spread(|zero, own| own.guess_s / zero.solve_s),
            projection: spread(|zero, own| saved(zero.solve_s, own.solve_s + own.guess_s)),
        }
    };
    let runs: Vec<&SceneRun> = cells.iter().map(|(_, runs)| runs).collect();
    Point { starts: starts.iter().enumerate().map(start_point).collect(), runs: speedups(&runs) }
}

fn sum(series: &StartSeries) -> Tally {
    series.steps.iter().fold(Tally::default(), |sum, step| Tally {
        solves: sum.solves + step.solves,
        dropped: sum.dropped + step.dropped,
        iterations: sum.iterations + step.iterations,
        solve_s: sum.solve_s + step.solve_s,
        guess_s: sum.guess_s + step.guess_s,
    })
}

#[cfg(test)]
mod tests {
    use super::super::example::{CG, bending, quadratic, stored};
    use super::*;

    #[test]
    fn a_point_is_relative_to_the_zero_start() {
        let start = |name: &str, iterations, solve_s, guess_s| {
            let dropped = u64::from(guess_s > 0.0);
            let steps = vec![Tally { solves: 10, dropped, iterations, solve_s, guess_s }];
            StartSeries { name: name.to_owned(), steps }
        };
        let run = SceneRun { steps: 1, segments: 1, ways: Vec::new() };
        let cell = |iterations, solve_s| {
            let net = start("net", iterations, solve_s, 1.0);
            (vec![start("zero", 100, 4.0, 0.0), net, start("direct", 0, 0.4, 0.0)], run.clone())
        };
        let point = point(&[cell(50, 2.0), cell(70, 3.0), cell(20, 1.0)]);
        let net = &point.starts[1];
        assert_eq!(net.name, "net");
        assert_eq!(net.iteration_ratio.unwrap().median, 0.5);
        assert_eq!(net.inference_ratio.unwrap().median, 0.25);
        // 1 - 3/4, 1 - 4/4 and 1 - 2/4.
        assert_eq!(net.projection.unwrap(), Spread { mean: 0.25, lower: 0.125, median: 0.25, upper: 0.375 });
        assert!((point.starts[2].projection.unwrap().median - 0.9).abs() < 1e-12);
        assert_eq!(
            (point.starts[0].iteration_ratio.unwrap().mean, point.starts[0].projection.unwrap().mean),
            (1.0, 0.0)
        );
    }

    #[test]
    fn a_simulation_has_both_readings_of_all_rivals() {
        let scene = bending(6);
        let guesses = [("net".to_owned(), &quadratic as _)];
        let mut ticks = 0;
        let cell = measure(&scene, 8, &CG, &guesses, 2, || {
            ticks += 1;
            true
        });
        let cell = cell.unwrap().unwrap();
        assert_eq!(ticks, 32);
        assert_eq!(stored(&cell), cell);
        let (starts, runs) = &cell;
        let names: Vec<&str> = starts.iter().map(|start| start.name.as_str()).collect();
        assert_eq!(names, ["zero", "net", "fischer", "direct"]);
        let ways: Vec<&str> = runs.ways.iter().map(|way| way.name.as_str()).collect();
        assert_eq!(ways, ["zero", "net", "fischer", "direct"]);
        let sums: Vec<Tally> = starts.iter().map(sum).collect();
        assert!(sums.iter().take(3).all(|tally| tally.solves == 8 && tally.iterations > 0));
        assert!(sums[0].guess_s == 0.0 && sums[1].guess_s > 0.0 && sums[3].solve_s > 0.0);
        let point = point(&[cell]);
        // A smooth motion's parabola helps, and the direct solver has no linear iterations.
        assert!(point.starts[1].iteration_ratio.unwrap().median < 1.0);
        assert_eq!(point.runs[3].iteration_ratio.unwrap().median, 0.0);
        assert!(measure(&scene, 8, &CG, &guesses, 2, || false).unwrap().is_none());
    }
}
