//! What the sections on the paper's figures share.

use anyhow::Result;
use catalogue::rows;
use cosserat::guess::GuessFactory;
use cosserat::scene::{self, Scene};
use cosserat::simulation::{CgParams, Formulation, Integrator, PreconditionerKind, Simulation, StepParams};
use dataset::Scenario;
use evaluation::paper::motions::{self, Trace};
use evaluation::paper::{CgSolver, DIRECT, NamedGuess};
use graph::planar_normal;

use crate::library::Guesses;

/// Seed of random scenes; the data sets have seed 0.
pub(crate) const SEED: u64 = 1;
/// No preconditioner, as the paper may have had it.
pub(crate) const RAW: &str = PreconditionerKind::Raw.name();
/// The strongest preconditioner of ours.
pub(crate) const BLOCK_JACOBI: &str = PreconditionerKind::BlockJacobi.name();
/// Scenes of Table 1, which move freely.
pub(crate) const FREE: [Scenario; 2] = [Scenario::Rod, Scenario::Helix];
/// The paper's network as it is, and restricted to the plane of a scene that has one: two guesses, always both told.
pub(crate) const PAPER_GUESSES: [&str; 2] = ["gn", "gn, planar"];
/// Frames of the paper's training data, at which it parts its figures.
pub(crate) const PAPER_FRAMES: usize = scene::sampling::STEPS;

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

/// The paper's solver: formulation xpbd, conjugate gradients with the preconditioner of this name.
pub(crate) fn solver(preconditioner: &str, tolerance: f64) -> Result<CgSolver> {
    let preconditioner = preconditioner.parse().map_err(anyhow::Error::msg)?;
    Ok(CgSolver {
        step: StepParams { formulation: Formulation::Xpbd, integrator: Integrator::Euler, ..StepParams::DEFAULT },
        cg: CgParams { preconditioner, tolerance, ..CgParams::default() },
    })
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
    let (model, state) = (&scene.model, &scene.state);
    let plane = planar_normal(model, state);
    let rows = rows(guesses, plane.is_some());
    let of_solves = || rows.iter().filter(|row| row.guess_name.helps_solves());
    let mut ways = vec![(DIRECT.to_owned(), Simulation::new(model, state, &solver.direct(), None)?)];
    for row in of_solves() {
        let simulation = Simulation::new(model, state, &solver.settings(), Some(&row.factory(plane)))?;
        ways.push((row.name.clone(), simulation));
    }
    let once = StepParams { max_iterations: 1, ..solver.step };
    for row in of_solves() {
        if let Some(projection) = row.projection(plane) {
            let simulation = Simulation::end_to_end(model, state, &once, &projection)?;
            ways.push((format!("{}, end to end", row.name), simulation));
        }
    }
    Ok(motions::measure(scene, steps, frames, ways, go_on)?)
}
