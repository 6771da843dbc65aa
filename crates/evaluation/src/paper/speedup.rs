//! Total speed-ups (paper, section 4, "Collisions" and "Complex Scenarios"; supplement: the knot): a helix on the plane,
//! two rods, a knot, trees in wind, or any other scene, simulated in several ways.
//!
//! All ways run in lockstep to the same tolerance, and the error of each against a tight reference at the same time step
//! stands beside its times ([`compare::run`]). Speed-ups are relative to the first way of the same run; over repeated runs
//! or topologies their spread is told. What the paper does not ask is when training has paid for itself.

use cosserat::scene::Scene;
use cosserat::simulation::{SimulationError, Status};
use serde::{Deserialize, Serialize};

use super::{quickest, saved};
use crate::compare::{self, Comparison, Cost, Entry, EntryRun};
use crate::guesses::Spread;

/// Topologies of a size of trees (paper, section 4).
pub const TOPOLOGIES: usize = 30;

/// One run of one scene, in several ways.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneRun {
    /// Steps.
    pub steps: usize,
    /// Segments.
    pub segments: usize,
    /// What each way came to, in the order of the entries.
    pub ways: Vec<WaySums>,
}

/// What a way came to in one run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WaySums {
    /// Name of the way.
    pub name: String,
    /// Worst status of any step.
    pub status: String,
    /// The step in which it was given up, because its linear solver had run out of iterations.
    pub given_up: Option<usize>,
    /// Iterations and times, summed over the steps; of each step the quickest repeat.
    pub sums: Cost,
    /// Largest error of any step's positions, relative to the rods' mean length; `None` if not finite.
    pub error: Option<f64>,
}

impl WaySums {
    /// Time of the constraint projection [s]: linear solves and guesses.
    pub fn projection_s(&self) -> f64 {
        self.sums.solve_s + self.sums.guess_s
    }

    /// Whether every step reached the tolerance.
    pub fn converged(&self) -> bool {
        [Status::Converged, Status::ConvergedInSubsteps].iter().any(|status| self.status == status.name())
    }
}

/// Runs `steps` steps of the scene in all ways, `repeats` times; the first way is what the others are compared to. After
/// each step of each repeat `progress()` says whether to go on; `None` where it said stop.
///
/// # Errors
/// If the scene or an entry is not valid.
pub fn measure(
    Scene { model, state, run: scene, .. }: &Scene,
    steps: usize,
    entries: &[Entry<'_>],
    repeats: usize,
    progress: impl FnMut() -> bool,
) -> Result<Option<SceneRun>, SimulationError> {
    let run = |go_on: &mut dyn FnMut() -> bool| compare::run(model, state, scene.dt, steps, entries, |_| go_on());
    let way = |row: EntryRun| WaySums {
        name: row.name,
        status: row.status.name().to_owned(),
        given_up: row.given_up,
        sums: sum(&row.by_step),
        error: Some(row.error).filter(|error| error.is_finite()),
    };
    let quickest = quickest(repeats, progress, run, take_quicker)?;
    Ok(quickest.map(|Comparison { rows, steps, .. }| SceneRun {
        steps,
        segments: model.segments.len(),
        ways: rows.into_iter().map(way).collect(),
    }))
}

/// Takes the steps that were quicker in a repeat. They are compared as wholes, so that their parts go together.
fn take_quicker(quickest: &mut Comparison, repeat: &Comparison) {
    let rows = quickest.rows.iter_mut().zip(&repeat.rows);
    for (step, again) in rows.flat_map(|(row, again)| row.by_step.iter_mut().zip(&again.by_step)) {
        if again.total_s < step.total_s {
            *step = *again;
        }
    }
}

fn sum(steps: &[Cost]) -> Cost {
    steps.iter().fold(Cost::default(), |sum, step| Cost {
        iterations: sum.iterations + step.iterations,
        linear_iterations: sum.linear_iterations + step.linear_iterations,
        guess_s: sum.guess_s + step.guess_s,
        solve_s: sum.solve_s + step.solve_s,
        contact_s: sum.contact_s + step.contact_s,
        total_s: sum.total_s + step.total_s,
    })
}

/// A way over several runs, relative to the first way of each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Speedup {
    /// Name of the way.
    pub name: String,
    /// Runs in which some step did not reach the tolerance. Those in which the linear solver ran out of iterations are left
    /// out of what follows, as are those in which the first way's did.
    pub not_converged: usize,
    /// Share of the total time saved.
    pub total: Option<Spread>,
    /// Share of the time of linear solves and guesses saved.
    pub projection: Option<Spread>,
    /// Linear iterations, relative.
    pub iteration_ratio: Option<Spread>,
    /// Time of the contacts, of the way's own total.
    pub contact_share: Option<Spread>,
    /// Total time a step [us].
    pub step_us: Option<Spread>,
    /// Largest error of a run.
    pub error: Option<Spread>,
}

/// One entry a way, over runs that have the same ways.
pub fn speedups(runs: &[&SceneRun]) -> Vec<Speedup> {
    let ways = runs.first().map_or(&[][..], |run| &run.ways);
    let speedup = |(way, WaySums { name, .. }): (usize, &WaySums)| {
        let pairs = || runs.iter().filter_map(|run| Some((*run, run.ways.first()?, run.ways.get(way)?)));
        let spread = |value: &dyn Fn(&SceneRun, &WaySums, &WaySums) -> f64| {
            let complete = pairs().filter(|(_, base, own)| base.given_up.is_none() && own.given_up.is_none());
            Spread::of(complete.map(|(run, base, own)| value(run, base, own)))
        };
        let ratio = |own: u64, base: u64| own as f64 / base as f64;
        Speedup {
            name: name.clone(),
            not_converged: pairs().filter(|(.., own)| !own.converged()).count(),
            total: spread(&|_, base, own| saved(base.sums.total_s, own.sums.total_s)),
            projection: spread(&|_, base, own| saved(base.projection_s(), own.projection_s())),
            iteration_ratio: spread(&|_, base, own| ratio(own.sums.linear_iterations, base.sums.linear_iterations)),
            contact_share: spread(&|_, _, own| own.sums.contact_s / own.sums.total_s),
            step_us: spread(&|run, _, own| 1e6 * own.sums.total_s / run.steps as f64),
            error: spread(&|_, _, own| own.error.unwrap_or(f64::NAN)),
        }
    };
    ways.iter().enumerate().map(speedup).collect()
}

/// The number of steps after which a training of so long has paid for itself, by the time saved a step [s]; `None` for never.
pub fn break_even(training_s: f64, saved_s: f64) -> Option<u64> {
    let steps = (training_s / saved_s).ceil();
    // A number too large for a whole one becomes the largest.
    (saved_s > 0.0 && steps >= 0.0).then_some(steps as u64)
}

/// Time of a step in the way of this name [s]; `None` where the run has no such way, or it was given up.
pub fn step_s(run: &SceneRun, way: &str) -> Option<f64> {
    let own = run.ways.iter().find(|own| own.name == way && own.given_up.is_none())?;
    Some(own.sums.total_s / run.steps as f64)
}

/// Median over the runs of the time that a guess saves a step against another way [s], negative where it loses. Runs in
/// which one of the two was given up are left out.
pub fn saved_s(runs: &[&SceneRun], guess: &str, against: &str) -> Option<f64> {
    let saved = runs.iter().filter_map(|run| Some(step_s(run, against)? - step_s(run, guess)?));
    Some(Spread::of(saved)?.median)
}

#[cfg(test)]
mod tests {
    use super::super::example::{CG, bending, quadratic, stored};
    use super::*;

    fn way(name: &str, linear_iterations: u64, [guess_s, solve_s, total_s]: [f64; 3]) -> WaySums {
        WaySums {
            name: name.to_owned(),
            status: Status::Converged.name().to_owned(),
            given_up: None,
            sums: Cost { iterations: 10, linear_iterations, guess_s, solve_s, contact_s: 0.5, total_s },
            error: Some(1e-6),
        }
    }

    fn run_of(ways: Vec<WaySums>) -> SceneRun {
        SceneRun { steps: 100, segments: 5, ways }
    }

    #[test]
    fn shares_of_time_are_told_relative_to_the_first_way() {
        let run = |total: f64| run_of(vec![way("zero", 200, [0.0, 4.0, 5.0]), way("net", 100, [1.0, 2.0, total])]);
        let mut failed = run(1.0);
        failed.ways[1].given_up = Some(3);
        failed.ways[1].status = Status::OutOfIterations.name().to_owned();
        let found = speedups(&[&run(4.0), &run(3.0), &run(6.0), &failed]);
        assert_eq!(found.len(), 2);
        let net = &found[1];
        assert_eq!(net.not_converged, 1);
        // Saved 20 %, 40 % and -20 %: what was given up has no say.
        let total = net.total.unwrap();
        assert!((total.median - 0.2).abs() < 1e-12 && (total.lower - 0.0).abs() < 1e-12);
        assert!((total.upper - 0.3).abs() < 1e-12);
        assert_eq!((net.projection.unwrap().median, net.iteration_ratio.unwrap().median), (0.25, 0.5));
        assert_eq!((net.contact_share.unwrap().median, net.step_us.unwrap().median), (0.125, 4e4));
        assert_eq!((found[0].total.unwrap().mean, found[0].not_converged), (0.0, 0));
        assert!(speedups(&[]).is_empty());
    }

    #[test]
    fn a_training_pays_only_where_time_is_saved() {
        assert_eq!(break_even(3600.0, 1e-3), Some(3_600_000));
        assert_eq!(break_even(1.0, 0.3), Some(4));
        assert_eq!((break_even(1.0, 0.0), break_even(1.0, -1e-6), break_even(1.0, f64::NAN)), (None, None, None));
        assert_eq!((break_even(0.0, 1e-6), break_even(0.0, -1e-6)), (Some(0), None));
        assert_eq!(break_even(f64::NAN, 1.0), None);
    }

    #[test]
    fn a_guess_is_held_against_other_ways() {
        let way = |name: &str, total_s| way(name, 0, [0.0, 0.0, total_s]);
        let run = |net: f64| run_of(vec![way("zero", 5.0), way("net", net), way("direct", 1.0)]);
        let mut lost = run(4.0);
        lost.ways[0].given_up = Some(7);
        let runs = [&run(4.0), &run(3.0), &run(4.5), &lost];
        assert!((saved_s(&runs, "net", "zero").unwrap() - 0.01).abs() < 1e-12);
        assert!(saved_s(&runs, "net", "direct").unwrap() < 0.0);
        assert_eq!((saved_s(&runs, "another", "zero"), step_s(runs[3], "zero")), (None, None));
    }

    #[test]
    fn of_each_step_the_quickest_repeat_counts() {
        let comparison = |times: [f64; 3]| {
            let cost = |total_s: f64| Cost { iterations: 2, guess_s: 0.5 * total_s, total_s, ..Cost::default() };
            let scene = bending(3);
            let entry = Entry { name: "zero".to_owned(), settings: CG.direct(), guess: None };
            let mut comparison = compare::run(&scene.model, &scene.state, 0.02, 1, &[entry], |_| true).unwrap();
            comparison.rows[0].by_step = times.map(cost).into();
            comparison
        };
        let mut quickest = comparison([1.0, 9.0, 2.0]);
        take_quicker(&mut quickest, &comparison([2.0, 3.0, 8.0]));
        let sum = sum(&quickest.rows[0].by_step);
        assert_eq!((sum.iterations, sum.total_s, sum.guess_s), (6, 6.0, 3.0));
    }

    #[test]
    fn a_run_counts_and_can_be_stored() {
        let scene = bending(6);
        let entry = |name: &str, guess| Entry { name: name.to_owned(), settings: CG.settings(), guess };
        let entries = [entry("zero", None), entry("parabola", Some(&quadratic as _))];
        let measured = || measure(&scene, 5, &entries, 2, || true).unwrap().unwrap();
        let (run, again) = (measured(), measured());
        assert_eq!(stored(&run), run);
        assert_eq!((run.steps, run.segments), (5, 6));
        for (way, same) in run.ways.iter().zip(&again.ways) {
            assert!(way.converged() && way.error.unwrap() < 1e-4);
            assert_eq!((way.sums.linear_iterations, way.error), (same.sums.linear_iterations, same.error));
            assert!(way.projection_s() < way.sums.total_s && way.sums.linear_iterations > 5);
        }
        let mut steps = 0;
        let stopped = measure(&scene, 5, &entries, 2, || {
            steps += 1;
            steps < 2
        });
        assert!(stopped.unwrap().is_none() && steps == 2);
    }
}
