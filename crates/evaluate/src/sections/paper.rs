//! What the sections on the paper's figures share.

use anyhow::Result;
use catalogue::rows;
use evaluation::paper::{CgSolver, DIRECT, Method, Motion, NamedGuess, Way};
use graph::planar_normal;
use scene::Scene;
use solver::formulation::Formulation;
use solver::linear::cg::CgParams;
use solver::linear::precondition::PreconditionerKind;
use solver::simulation::GuessFactory;
use solver::step::StepParams;

use crate::library::Guesses;

/// Seed of random scenes; the data sets have seed 0.
pub(crate) const SEED: u64 = 1;

/// A scene over so many steps.
pub(crate) fn motion(scene: &Scene, steps: usize) -> Motion<'_> {
    Motion { model: &scene.model, state: &scene.state, dt: scene.run.dt, steps }
}

/// Runs `f` with these guesses of linear solves; in a planar scene those that know nothing of planes twice.
pub(crate) fn with_guesses<T, E: Into<anyhow::Error>>(
    scene: &Scene,
    guesses: &Guesses,
    f: impl FnOnce(&[NamedGuess<'_>]) -> Result<T, E>,
) -> Result<T> {
    let plane = planar_normal(&scene.model, &scene.state);
    let rows = rows(guesses, plane.is_some());
    let of_solves: Vec<_> = rows.iter().filter(|row| row.guess_name.helps_solves()).collect();
    let factories: Vec<_> = of_solves.iter().map(|row| row.factory(plane)).collect();
    let named = of_solves.iter().zip(&factories).map(|(row, factory)| (row.name.clone(), factory as GuessFactory<'_>));
    f(&named.collect::<Vec<_>>()).map_err(Into::into)
}

/// The paper's solver, as the sections on its figures take it: formulation xpbd, conjugate gradients without a
/// preconditioner.
pub(crate) fn solver(preconditioner: PreconditionerKind, tolerance: f64) -> CgSolver {
    CgSolver {
        step: StepParams { formulation: Formulation::Xpbd, ..StepParams::DEFAULT },
        cg: CgParams { preconditioner, tolerance, ..CgParams::default() },
    }
}

/// Runs `f` with vanilla position-based dynamics (the direct solver), conjugate gradients from each of these guesses, and
/// each one's predictions in the place of all solves.
pub(crate) fn with_predictions<T, E: Into<anyhow::Error>>(
    scene: &Scene,
    guesses: &Guesses,
    solver: &CgSolver,
    f: impl FnOnce(&[Way<'_>]) -> Result<T, E>,
) -> Result<T> {
    let plane = planar_normal(&scene.model, &scene.state);
    let rows = rows(guesses, plane.is_some());
    let of_solves: Vec<_> = rows.iter().filter(|row| row.guess_name.helps_solves()).collect();
    let factories: Vec<_> = of_solves.iter().map(|row| row.factory(plane)).collect();
    let projections: Vec<_> = of_solves.iter().filter_map(|row| Some((row, row.projection(plane)?))).collect();
    let mut ways = vec![Way { name: DIRECT.to_owned(), method: Method::Solve(solver.direct(), None) }];
    for (row, factory) in of_solves.iter().zip(&factories) {
        ways.push(Way { name: row.name.clone(), method: Method::Solve(solver.settings(), Some(factory)) });
    }
    let once = StepParams { max_iterations: 1, ..solver.step };
    for (row, projection) in &projections {
        ways.push(Way { name: format!("{}, end to end", row.name), method: Method::EndToEnd(once, projection) });
    }
    f(&ways).map_err(Into::into)
}
