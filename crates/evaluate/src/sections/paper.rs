//! What the sections on the paper's figures share.

use anyhow::Result;
use catalogue::rows;
use dataset::Scenario;
use evaluation::paper::motions::{self, Method, NamedMethod, Trace};
use evaluation::paper::{CgSolver, DIRECT, Motion, NamedGuess};
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
/// Scenes of Table 1, which move freely.
pub(crate) const FREE: [Scenario; 2] = [Scenario::Rod, Scenario::Helix];
/// The paper's network as it is, and restricted to the plane of a scene that has one: two guesses, always both told.
pub(crate) const PAPER_GUESSES: [&str; 2] = ["gn", "gn, planar"];
/// Frames of the paper's training data, at which it parts its figures.
pub(crate) const PAPER_FRAMES: usize = scene::sampling::STEPS;

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

/// The paper's solver: formulation xpbd, conjugate gradients with this preconditioner.
pub(crate) fn solver(preconditioner: PreconditionerKind, tolerance: f64) -> CgSolver {
    CgSolver {
        step: StepParams { formulation: Formulation::Xpbd, ..StepParams::DEFAULT },
        cg: CgParams { preconditioner, tolerance, ..CgParams::default() },
    }
}

/// The same of a cell, whose preconditioner is a name.
pub(crate) fn solver_of(preconditioner: &str, tolerance: f64) -> Result<CgSolver> {
    Ok(solver(preconditioner.parse().map_err(anyhow::Error::msg)?, tolerance))
}

/// The same in words.
pub(crate) fn solver_words(preconditioner: &str, tolerance: impl std::fmt::Display) -> String {
    format!("conjugate gradients, {preconditioner}, tolerance {tolerance}, formulation xpbd")
}

/// Whether a way is predictions in the place of all solves, as [`traces`] names it.
pub(crate) fn is_end_to_end(name: &str) -> bool {
    name.ends_with("end to end")
}

/// The motions of a scene over so many steps, with snapshots at these frames: of vanilla position-based dynamics (the
/// direct solver), of conjugate gradients from each of these guesses, and of each one's predictions in the place of all
/// solves.
pub(crate) fn traces(
    scene: &Scene,
    guesses: &Guesses,
    solver: &CgSolver,
    (steps, frames): (usize, &[usize]),
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Option<Vec<Trace>>> {
    let plane = planar_normal(&scene.model, &scene.state);
    let rows = rows(guesses, plane.is_some());
    let predictions = rows.iter().filter(|row| row.guess_name.helps_solves());
    let predictions: Vec<_> =
        predictions.filter_map(|row| Some((format!("{}, end to end", row.name), row.projection(plane)?))).collect();
    let once = StepParams { max_iterations: 1, ..solver.step };
    with_guesses(scene, guesses, |named| {
        let mut ways: Vec<NamedMethod<'_>> = vec![(DIRECT.to_owned(), Method::Solve(solver.direct(), None))];
        for (name, guess) in named {
            ways.push((name.clone(), Method::Solve(solver.settings(), Some(*guess))));
        }
        ways.extend(predictions.iter().map(|(name, method)| (name.clone(), Method::EndToEnd(once, method))));
        motions::measure(&motion(scene, steps), frames, &ways, go_on)
    })
}
