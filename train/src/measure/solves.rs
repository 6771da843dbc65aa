//! Of linear solves: iterations of conjugate gradients relative to a zero start.

use copingnet::{Encoding, Features, GnGuess, Trained, Weights};
use cosserat::internals::jointed::linear::LinearSolver;
use cosserat::simulation::{CgParams, PreconditionerKind, SolverKind};
use dataset::{Dataset, Scenario, Split};
use rayon::prelude::*;

use super::{Columns, Measured, Pair};

/// The solves that are measured: preconditioner and tolerance.
type Cells = [(PreconditionerKind, f64); 4];

/// Of knots, raw residuals are next to all bend, whose rows are next to diagonal: at 1e-4 a zero start needs four iterations
/// and solves no stretch, so that 1e-6 stands in for it. Of trees, no raw solve converges: not to 0.1 in 200,000 iterations.
fn cells(scenario: Scenario) -> Cells {
    let [first, second] = match scenario {
        Scenario::Rod | Scenario::Helix => [(PreconditionerKind::Raw, 1e-2), (PreconditionerKind::Raw, 1e-4)],
        Scenario::Knot => [(PreconditionerKind::Raw, 1e-4), (PreconditionerKind::Raw, 1e-6)],
        Scenario::Tree => [(PreconditionerKind::Jacobi, 1e-2), (PreconditionerKind::Jacobi, 1e-4)],
    };
    [first, second, (PreconditionerKind::BlockJacobi, 1e-2), (PreconditionerKind::BlockJacobi, 1e-4)]
}

/// Every how many steps of a trajectory one is measured, at its first outer iteration, from the very first on; of shorter ones the first and
/// the last.
const EVERY: u32 = 10;

/// First steps and later ones, for each of a scenario's cells.
pub(crate) fn columns(scenario: Scenario) -> Columns {
    let short = |kind: PreconditionerKind| if kind == PreconditionerKind::BlockJacobi { "block" } else { kind.name() };
    let pair = |(kind, tolerance): (PreconditionerKind, f64)| Pair {
        head: format!("{} {tolerance:e}", short(kind)),
        name: format!("{}_{tolerance:e}", kind.name()),
        solver: kind.name(),
        tolerances: [tolerance; 2],
    };
    Columns {
        about: "cg iterations to a zero start, of step 1 / every 10th later step, planar scenes in their plane",
        parts: ["first", "later"],
        pairs: cells(scenario).into_iter().map(pair).collect(),
    }
}

/// The paper's own cell (raw at 1e-4, later steps, or what stands in for it) for its recipe; for ours the geometric mean of
/// that one and block-Jacobi at 1e-2, later steps and, with half the weight, first ones.
fn score(pairs: &[[f64; 2]], is_paper: bool) -> f64 {
    if is_paper {
        return pairs[1][1];
    }
    let mean = |part: usize| 0.5 * (pairs[1][part].ln() + pairs[2][part].ln());
    ((2.0 * mean(1) + mean(0)) / 3.0).exp()
}

/// Iterations of the zero start and of the guess, of first and of later steps.
type Counts = [[[u64; 2]; 2]; 4];

/// Measures on the first `scenes` validation trajectories, on rayon's current thread pool.
pub(crate) fn measure(dataset: &Dataset, scenes: usize, weights: &Weights, encoding: &Encoding) -> Measured {
    let trained = Trained::new(weights, encoding.clone());
    let cells = cells(dataset.manifest().config.scenario);
    let scenes = scenes.min(dataset.trajectory_count(Split::Validation));
    let counts: Vec<Counts> = (0..scenes).into_par_iter().map(|index| scene(dataset, index, cells, &trained)).collect();
    let ratio = |cell: usize, is_later: usize| {
        let sum = |guess: usize| counts.iter().map(|counts| counts[cell][is_later][guess]).sum::<u64>() as f64;
        sum(1) / sum(0).max(1.0)
    };
    let pairs: Vec<[f64; 2]> = (0..4).map(|cell| [ratio(cell, 0), ratio(cell, 1)]).collect();
    let score = score(&pairs, encoding.features == Features::Paper);
    Measured { pairs, score }
}

fn scene(dataset: &Dataset, index: usize, cells: Cells, trained: &Trained) -> Counts {
    let mut counts = Counts::default();
    let Some(trajectory) = dataset.trajectory(Split::Validation, index) else { return counts };
    let (model, members, topology) = (trajectory.model(), trajectory.members(), trajectory.topology());
    let mut guess = GnGuess::new(trained, trajectory.graph().clone(), trajectory.planar_normal());
    let mut component = trajectory.component();
    let (mut start, mut dlambda) = (component.dlambda.clone(), component.dlambda.clone());
    let solver = |(preconditioner, tolerance)| {
        SolverKind::Cg(CgParams { preconditioner, tolerance, max_iterations: None }).build(model, members, topology)
    };
    let mut solvers: Vec<Box<dyn LinearSolver>> = cells.into_iter().filter_map(|cell| solver(cell).ok()).collect();
    let every = EVERY.min(dataset.manifest().config.steps as u32 - 1).max(1);
    for sample in trajectory.samples().filter(|sample| sample.iteration() == 0 && sample.step().is_multiple_of(every)) {
        sample.restore(&mut component);
        guess.predict(&component, &mut start);
        for (solver, counts) in solvers.iter_mut().zip(&mut counts) {
            let counts = &mut counts[usize::from(sample.step() > 0)];
            counts[0] += solver.solve(&component.system, false, &mut dlambda).iterations;
            dlambda.copy_from_slice(&start);
            counts[1] += solver.solve(&component.system, true, &mut dlambda).iterations;
        }
    }
    counts
}
