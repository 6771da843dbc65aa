//! What counts: the iterations of conjugate gradients that a network's guess saves on validation scenes.

use copingnet::{Encoding, GnGuess, Trained, Weights};
use dataset::{Dataset, Split};
use rayon::prelude::*;
use solver::linear::LinearSolver;
use solver::linear::cg::CgParams;
use solver::linear::precondition::PreconditionerKind;
use solver::linear::solvers::SolverKind;

/// The solves that are measured: preconditioner and tolerance.
pub(crate) const CELLS: [(PreconditionerKind, f64); 4] = [
    (PreconditionerKind::Raw, 1e-2),
    (PreconditionerKind::Raw, 1e-4),
    (PreconditionerKind::BlockJacobi, 1e-2),
    (PreconditionerKind::BlockJacobi, 1e-4),
];

/// Every how many steps of a trajectory one is measured, at its first outer iteration, from the very first on.
const EVERY: u32 = 10;

/// Iteration ratios to the zero start, first steps and later ones apart; sums over scenes divided by sums.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Measured {
    /// Of the first step. `[cells]`
    pub(crate) first: [f64; CELLS.len()],
    /// Of the later ones. `[cells]`
    pub(crate) later: [f64; CELLS.len()],
}

impl Measured {
    /// By what weights are chosen, the less the better: the paper's own cell (raw at 1e-4, later steps) for its recipe;
    /// for ours the geometric mean of raw at 1e-4 and block-Jacobi at 1e-2, later steps and, with half the weight, first
    /// ones.
    pub(crate) fn score(&self, is_paper: bool) -> f64 {
        if is_paper {
            return self.later[1];
        }
        let mean = |cells: &[f64; CELLS.len()]| 0.5 * (cells[1].ln() + cells[2].ln());
        ((2.0 * mean(&self.later) + mean(&self.first)) / 3.0).exp()
    }
}

/// Iterations of the zero start and of the guess, of first and of later steps.
type Counts = [[[u64; 2]; 2]; CELLS.len()];

/// Measures on the first `scenes` validation trajectories, on rayon's current thread pool.
pub(crate) fn measure(dataset: &Dataset, scenes: usize, weights: &Weights, encoding: &Encoding) -> Measured {
    let trained = Trained::new(weights, encoding.clone());
    let scenes = scenes.min(dataset.trajectory_count(Split::Validation));
    let counts: Vec<Counts> = (0..scenes).into_par_iter().map(|index| scene(dataset, index, &trained)).collect();
    let ratio = |cell: usize, is_later: usize| {
        let sum = |guess: usize| counts.iter().map(|counts| counts[cell][is_later][guess]).sum::<u64>() as f64;
        sum(1) / sum(0).max(1.0)
    };
    Measured { first: std::array::from_fn(|cell| ratio(cell, 0)), later: std::array::from_fn(|cell| ratio(cell, 1)) }
}

fn scene(dataset: &Dataset, index: usize, trained: &Trained) -> Counts {
    let mut counts = Counts::default();
    let Some(trajectory) = dataset.trajectory(Split::Validation, index) else { return counts };
    let (model, members, topology) = (trajectory.model(), trajectory.members(), trajectory.topology());
    let mut guess = GnGuess::new(trained, trajectory.graph().clone(), trajectory.planar_normal());
    let mut component = trajectory.component();
    let (mut start, mut dlambda) = (component.dlambda.clone(), component.dlambda.clone());
    let solver = |(preconditioner, tolerance)| {
        SolverKind::Cg(CgParams { preconditioner, tolerance, max_iterations: None }).build(model, members, topology)
    };
    let mut solvers: Vec<Box<dyn LinearSolver>> = CELLS.into_iter().filter_map(|cell| solver(cell).ok()).collect();
    for sample in trajectory.samples().filter(|sample| sample.iteration() == 0 && sample.step().is_multiple_of(EVERY)) {
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
