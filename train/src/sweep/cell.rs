//! One cell: a training, and the measurement of what came of it.

use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::{Context, Result};
use copingnet::{Encoding, Features, GnGuess, Trained, Weights};
use cosserat::guess::{GuessFactory, InitialGuess, Members, Topology};
use cosserat::scene::Scene;
use cosserat::simulation::{Formulation, Integrator, PreconditionerKind, Settings};
use cosserat::state::Model;
use dataset::Scenario;
use evaluation::ablation::{self, FREE, GuessSavings, NetworkOutcome, PLANAR, Test};
use evaluation::guesses::{self, Plan as Starts};
use graph::{Graph, Normal, planar_normal};

use crate::course::Course;
use crate::lesson::Taught;
use crate::outcome::Outcome;
use crate::paths::with_ending;
use crate::plan::Plan;

/// Trains a cell, or goes on with it where it was cut off, and measures it; `None` where `stopped` came first. After
/// each measurement on validation scenes `report` hears of it, and of the nodes that were visited in a second.
///
/// The training's state stays: times that a busy machine has spoilt can be measured again without training.
pub(crate) fn run(
    plan: &Plan,
    taught: &Taught,
    test: &Test,
    stopped: &AtomicBool,
    report: impl FnMut(&Course<'_>, f64) -> Result<()>,
) -> Result<Option<NetworkOutcome>> {
    let mut course = Course::new(plan, taught);
    if course.state_file().exists() {
        course.resume()?;
    }
    if matches!(course.train(stopped, report)?, Outcome::Interrupted) {
        return Ok(None);
    }
    let training_s = course.seconds();
    let weights = course.checkpoint()?.weights;
    let begin = Instant::now();
    let Some(rows) = measure(plan.scenario, test, &weights, &taught.encoding, stopped)? else { return Ok(None) };
    let file = with_ending(&plan.out, ".safetensors");
    let bytes = fs::read(&file).with_context(|| format!("cannot read {}", file.display()))?;
    Ok(Some(NetworkOutcome {
        parameters: weights.values().len(),
        weights_blake3: blake3::hash(&bytes).to_hex().to_string(),
        best_epoch: course.best_row().map_or(0, |row| row.epoch),
        final_loss: course.rows.last().map_or(f64::NAN, |row| row.loss),
        training_s,
        measuring_s: begin.elapsed().as_secs_f64(),
        machine: export::machine(),
        threads: plan.threads,
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        git_revision: export::git_revision(),
        rows,
    }))
}

/// Measures the guess on held-out scenes in turns with the zero start, on the same systems; `None` where it was stopped.
fn measure(
    scenario: Scenario,
    test: &Test,
    weights: &Weights,
    encoding: &Encoding,
    stopped: &AtomicBool,
) -> Result<Option<Vec<GuessSavings>>> {
    let trained = &Trained::new(weights, encoding.clone());
    let factory = |plane: Option<Normal>| {
        move |model: &Model, members: &Members, topology: &Topology| -> Option<Box<dyn InitialGuess>> {
            Some(Box::new(GnGuess::new(trained, Graph::new(model, members, topology), plane)))
        }
    };
    let scenes = (0..test.simulations).map(|index| scenario.sample(test.seed, index).scene());
    let scenes = scenes.collect::<Result<Vec<Scene>, _>>()?;
    let planes: Vec<_> = scenes.iter().map(|scene| planar_normal(&scene.model, &scene.state)).collect();
    let are_planar = planes.iter().all(Option::is_some);
    // Features in body frames have the plane's symmetry by themselves, where there is one.
    let is_free = !are_planar || encoding.features == Features::Paper;
    // The paper's formulation, and the data sets'.
    let mut settings = Settings::default();
    (settings.step.formulation, settings.step.integrator) = (Formulation::Xpbd, Integrator::Euler);
    let is_on = || !stopped.load(Ordering::Relaxed);
    let mut measured = Vec::new();
    for (Scene { model, state, run, .. }, plane) in scenes.iter().zip(planes) {
        let (free, planar) = (factory(None), factory(plane));
        let guesses: [(bool, &str, Option<GuessFactory<'_>>); 3] =
            [(true, "zero", None), (is_free, FREE, Some(&free)), (are_planar, PLANAR, Some(&planar))];
        let guesses = guesses.into_iter().filter(|own| own.0).map(|(_, name, guess)| (name.to_owned(), guess));
        let starts = Starts {
            guesses: guesses.collect(),
            preconditioners: vec![PreconditionerKind::Raw, PreconditionerKind::BlockJacobi],
            tolerances: vec![1e-2, 1e-4],
            max_iterations: None,
            buckets: ablation::buckets(test.steps),
            is_struck: true,
        };
        measured.push(guesses::measure(model, state, run.dt, &settings, &starts, is_on)?);
        if !is_on() {
            return Ok(None);
        }
    }
    Ok(Some(ablation::savings(&measured)))
}
