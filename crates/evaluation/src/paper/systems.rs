//! All starts on the same systems, step by step: those of the exact motion's first outer iterations ([`guesses::measure`]).

use solver::simulation::SimulationError;

use super::{CgSolver, DIRECT, Motion, NamedGuess, starts};
use crate::guesses::{self as measuring, Plan, Tally};

/// Of each way, its name and a tally of each step.
type ByStep = Vec<(String, Vec<Tally>)>;

/// For zero, the guesses, Fischer's projection and the direct solver (which has no iterations): its name and a tally of
/// each step. The motion is repeated, and of each time the least is taken. After each step of each repeat `progress()`
/// says whether to go on; `None` where it said stop.
pub(super) fn measure(
    motion: &Motion<'_>,
    solver: &CgSolver,
    guesses: &[NamedGuess<'_>],
    repeats: usize,
    progress: &mut impl FnMut() -> bool,
) -> Result<Option<ByStep>, SimulationError> {
    let plan = Plan {
        guesses: starts(guesses),
        preconditioners: vec![solver.cg.preconditioner],
        tolerances: vec![solver.cg.tolerance],
        max_iterations: solver.cg.max_iterations,
        buckets: (0..motion.steps).map(Some).collect(),
        is_struck: false,
    };
    let names = plan.guesses.iter().map(|(name, _)| name.clone()).chain([DIRECT.to_owned()]);
    let mut ways: ByStep = names.map(|name| (name, Vec::new())).collect();
    for _ in 0..repeats.max(1) {
        let mut go_on = true;
        let measured = measuring::measure(motion.model, motion.state, motion.dt, &solver.direct(), &plan, || {
            go_on = progress();
            go_on
        })?;
        if !go_on {
            return Ok(None);
        }
        for (way, (_, tallies)) in ways.iter_mut().enumerate() {
            take_quicker(tallies, (0..motion.steps).map(|step| measured.tally(step, way, 0)));
        }
    }
    Ok(Some(ways))
}

fn take_quicker(tallies: &mut Vec<Tally>, repeat: impl Iterator<Item = Tally>) {
    for (step, again) in repeat.enumerate() {
        match tallies.get_mut(step) {
            Some(tally) => {
                tally.solve_s = tally.solve_s.min(again.solve_s);
                tally.guess_s = tally.guess_s.min(again.guess_s);
            }
            None => tallies.push(again),
        }
    }
}

/// The sum over steps.
pub(super) fn sum(steps: &[Tally]) -> Tally {
    steps.iter().fold(Tally::default(), |sum, step| Tally {
        solves: sum.solves + step.solves,
        dropped: sum.dropped + step.dropped,
        iterations: sum.iterations + step.iterations,
        solve_s: sum.solve_s + step.solve_s,
        guess_s: sum.guess_s + step.guess_s,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_times_of_all_repeats_are_summed() {
        let tally = |solve_s, guess_s| Tally { solves: 1, dropped: 0, iterations: 7, solve_s, guess_s };
        let mut steps = Vec::new();
        take_quicker(&mut steps, [tally(4.0, 1.0), tally(2.0, 3.0)].into_iter());
        take_quicker(&mut steps, [tally(3.0, 2.0), tally(9.0, 0.5)].into_iter());
        assert_eq!(sum(&steps), Tally { solves: 2, dropped: 0, iterations: 14, solve_s: 5.0, guess_s: 1.5 });
    }
}
