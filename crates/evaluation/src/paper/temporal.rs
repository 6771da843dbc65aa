//! Iterations and times over the steps of a simulation (paper, section 4, figure on temporal evolution).
//!
//! At each step all starts are held against each other on the same system, the first outer iteration's of the exact
//! motion ([`crate::guesses::measure`]). The paper's curves are relative to a zero start, which is its dashed horizontal line at 1.

use cosserat::scene::Scene;
use cosserat::scene::sampling::{Family, Helix, Parameters, Rod};
use cosserat::simulation::SimulationError;
use serde::{Deserialize, Serialize};

use super::{CgSolver, DIRECT, NamedGuess, quickest, starts};
use crate::guesses::{self, Plan, Spread, Tally};

/// Simulations of the figure (paper: averaged over 20).
pub const SIMULATIONS: usize = 20;
/// Frames over which curves are smoothed (paper: 10).
pub const WINDOW: usize = 10;

/// The figure's rod: 3 m, else the defaults.
pub fn rod() -> Parameters {
    Parameters::Rod(Rod { length: 3.0, ..Rod::default() })
}

/// The figure's helix.
pub fn helix() -> Parameters {
    Parameters::Helix(Helix::default())
}

/// Simulation `index` of the figure. The first is the figure's scene. Twenty times that would be twenty times the same, so
/// that the others keep its N and its modulus, and draw the rest from Table 1. Other families are drawn altogether.
pub fn sample(family: Family, seed: u64, index: u64) -> Parameters {
    match (Parameters::sample(family, seed, index), index) {
        (Parameters::Rod(_), 0) => rod(),
        (Parameters::Helix(_), 0) => helix(),
        (Parameters::Rod(drawn), _) => {
            let Rod { segments, youngs_modulus, .. } = Rod::default();
            Parameters::Rod(Rod { segments, youngs_modulus, ..drawn })
        }
        (Parameters::Helix(drawn), _) => {
            let Helix { segments, torsion_modulus, .. } = Helix::default();
            Parameters::Helix(Helix { segments, torsion_modulus, ..drawn })
        }
        (other, _) => other,
    }
}

/// A start in all steps of a simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartSeries {
    /// Name of the guess.
    pub name: String,
    /// Iterations of conjugate gradients and times, by step.
    pub steps: Vec<Tally>,
}

/// Simulates `steps` steps and measures, `repeats` times, of which the least times count: a series for each start, zero, the
/// guesses, Fischer's projection, and the direct solver, which has no iterations. After each step of each repeat
/// `progress()` says whether to go on; `None` where it said stop.
///
/// # Errors
/// If the scene or the settings are not valid.
pub fn measure(
    scene: &Scene,
    steps: usize,
    solver: &CgSolver,
    named: &[NamedGuess<'_>],
    repeats: usize,
    progress: impl FnMut() -> bool,
) -> Result<Option<Vec<StartSeries>>, SimulationError> {
    let plan = Plan {
        guesses: starts(named),
        preconditioners: vec![solver.cg.preconditioner],
        tolerances: vec![solver.cg.tolerance],
        max_iterations: solver.cg.max_iterations,
        buckets: (0..steps).map(Some).collect(),
        is_struck: false,
    };
    let run = |go_on: &mut dyn FnMut() -> bool| {
        let measured = guesses::measure(&scene.model, &scene.state, scene.run.dt, &solver.direct(), &plan, go_on)?;
        let names = plan.guesses.iter().map(|(name, _)| name.as_str()).chain([DIRECT]);
        let series = |(way, name): (usize, &str)| StartSeries {
            name: name.to_owned(),
            steps: (0..steps).map(|step| measured.tally(step, way, 0)).collect(),
        };
        Ok(names.enumerate().map(series).collect::<Vec<_>>())
    };
    quickest(repeats, progress, run, |run, repeat| take_quicker(run, repeat))
}

/// Takes of each time the least of a run and its repeat.
fn take_quicker(run: &mut [StartSeries], repeat: &[StartSeries]) {
    let steps = run.iter_mut().zip(repeat).flat_map(|(own, again)| own.steps.iter_mut().zip(&again.steps));
    for (step, again) in steps {
        step.solve_s = step.solve_s.min(again.solve_s);
        step.guess_s = step.guess_s.min(again.guess_s);
    }
}

/// A curve of the figure, by step: a value of a start, by its place, over all simulations, relative to that of the zero start
/// of each; `None` where there is nothing to compare to.
///
/// Sums over a window of so many frames about the step (see [`WINDOW`]) are compared; at the ends, the window is cut. Then
/// mean and quartiles are taken over the simulations.
pub fn curve(
    cells: &[&Vec<StartSeries>],
    start: usize,
    window: usize,
    value: impl Fn(&Tally) -> f64,
) -> Vec<Option<Spread>> {
    let values = |series: &StartSeries| series.steps.iter().map(&value).collect::<Vec<_>>();
    let of_cell = |cell: &&Vec<StartSeries>| Some(ratios(&values(cell.get(start)?), &values(cell.first()?), window));
    let ratios: Vec<Vec<f64>> = cells.iter().filter_map(of_cell).collect();
    let steps = ratios.iter().map(Vec::len).max().unwrap_or(0);
    (0..steps).map(|step| Spread::of(ratios.iter().filter_map(|ratios| ratios.get(step).copied()))).collect()
}

/// Sums over windows, relative to those of `zero`.
fn ratios(own: &[f64], zero: &[f64], window: usize) -> Vec<f64> {
    let before = window / 2;
    let ratio = |step: usize| {
        let range = step.saturating_sub(before)..(step + window.max(1) - before).min(own.len());
        own[range.clone()].iter().sum::<f64>() / zero[range].iter().sum::<f64>()
    };
    (0..own.len()).map(ratio).collect()
}

#[cfg(test)]
mod tests {
    use super::super::example::{CG, bending, quadratic, stored};
    use super::*;

    #[test]
    fn windows_are_centred_and_cut_at_the_ends() {
        let own: Vec<f64> = (0..6).map(f64::from).collect();
        // Window 4: two steps before, this one and one after.
        assert_eq!(ratios(&own, &[1.0; 6], 4), [0.5, 1.0, 1.5, 2.5, 3.5, 4.0]);
        assert_eq!(ratios(&own, &[2.0; 6], 1), [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]);
        assert_eq!(ratios(&own, &[1.0; 6], 0), own);
    }

    #[test]
    fn curves_are_relative_to_zero_with_quartiles_over_simulations() {
        let series = |name: &str, iterations: u64| StartSeries {
            name: name.to_owned(),
            steps: vec![Tally { iterations, solve_s: iterations as f64 * 1e-6, ..Tally::default() }; 3],
        };
        let cells: Vec<Vec<StartSeries>> = [10, 20, 30].map(|n| vec![series("zero", 40), series("net", n)]).into();
        let cells: Vec<_> = cells.iter().collect();
        let iterations = |start| curve(&cells, start, WINDOW, |step| step.iterations as f64);
        let expected = Spread { mean: 0.5, lower: 0.375, median: 0.5, upper: 0.625 };
        assert_eq!(iterations(1), [Some(expected); 3]);
        let time = curve(&cells, 1, WINDOW, |step| step.solve_s + step.guess_s);
        assert!((time[1].unwrap().upper - 0.625).abs() < 1e-12);
        assert_eq!(iterations(0)[2].unwrap().mean, 1.0);
        assert!(iterations(2).is_empty());
    }

    #[test]
    fn samples_keep_n_and_modulus() {
        assert_eq!((sample(Family::Rod, 7, 0), sample(Family::Helix, 7, 0)), (rod(), helix()));
        for index in 1..20 {
            let Parameters::Rod(p) = sample(Family::Rod, 7, index) else { panic!("a rod") };
            assert_eq!((p.segments, p.youngs_modulus, p.length), (30, 1e5, Rod::sample(7, index).length));
            let Parameters::Helix(p) = sample(Family::Helix, 7, index) else { panic!("a helix") };
            assert_eq!((p.segments, p.torsion_modulus, p.winding), (60, 1e5, Helix::sample(7, index).winding));
        }
    }

    #[test]
    fn the_least_times_of_all_repeats_count() {
        let tally = |solve_s, guess_s| Tally { solves: 1, dropped: 0, iterations: 7, solve_s, guess_s };
        let run = |steps: [Tally; 2]| vec![StartSeries { name: String::new(), steps: steps.into() }];
        let mut quickest = run([tally(4.0, 1.0), tally(2.0, 3.0)]);
        take_quicker(&mut quickest, &run([tally(3.0, 2.0), tally(9.0, 0.5)]));
        assert_eq!(quickest, run([tally(3.0, 1.0), tally(2.0, 0.5)]));
    }

    #[test]
    fn every_step_of_every_start_is_told() {
        let scene = bending(6);
        let guesses = [("net".to_owned(), &quadratic as _)];
        let cell = measure(&scene, 12, &CG, &guesses, 2, || true).unwrap().unwrap();
        assert_eq!(stored(&cell), cell);
        let names: Vec<&str> = cell.iter().map(|series| series.name.as_str()).collect();
        assert_eq!(names, ["zero", "net", "fischer", "direct"]);
        let is_told = |step: &Tally| step.solves == 1 && step.solve_s + step.guess_s > 0.0;
        assert!(cell.iter().all(|series| series.steps.len() == 12 && series.steps.iter().all(is_told)));
        // Nothing is known before the first step, and the parabola helps later.
        assert_eq!(cell[1].steps[0].iterations, cell[0].steps[0].iterations);
        let last = |start| curve(&[&cell], start, 1, |step| step.iterations as f64)[11].unwrap().mean;
        assert!(last(1) < 1.0 && last(3) == 0.0);
    }
}
