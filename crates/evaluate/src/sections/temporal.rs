//! The paper's figure on temporal evolution: iterations over the frames.

mod show;

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::paper::temporal::{self, StartSeries};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{FREE, SEED, motion, solver_of, with_guesses};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    scenario: Scenario,
    simulation: u64,
    steps: usize,
    /// Of all, for times: see [`temporal::measure`].
    repeats: usize,
    preconditioner: String,
    tolerance: f64,
    seed: u64,
}

pub(crate) struct Temporal;

/// The solvers whose iterations are counted, the paper's first.
const SOLVERS: [(PreconditionerKind, f64); 2] =
    [(PreconditionerKind::Raw, 1e-4), (PreconditionerKind::BlockJacobi, 1e-2)];

/// Steps of a full simulation: four times the paper's training data's.
const STEPS: usize = 200;

impl Section for Temporal {
    type Key = Key;
    type Value = Vec<StartSeries>;
    const ID: &'static str = "temporal";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let (steps, repeats) = (context.size.pick(40, STEPS), context.size.pick(1, 3));
        let mut keys = Vec::new();
        for scenario in FREE {
            for (preconditioner, tolerance) in SOLVERS {
                for simulation in 0..context.size.pick(2, temporal::SIMULATIONS as u64) {
                    let preconditioner = preconditioner.to_string();
                    keys.push(Key { scenario, simulation, steps, repeats, preconditioner, tolerance, seed: SEED });
                }
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &Key) -> f64 {
        (if key.scenario == Scenario::Rod { 0.004 } else { 0.01 }) * (key.steps * key.repeats) as f64
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &Key,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Vec<StartSeries>>> {
        let guesses = context.library.guesses(key.scenario, Learned::All)?;
        let scene = temporal::sample(key.scenario.family(), key.seed, key.simulation).scene()?;
        let solver = solver_of(&key.preconditioner, key.tolerance)?;
        with_guesses(&scene, &guesses, |named| {
            temporal::measure(&motion(&scene, key.steps), &solver, named, key.repeats, go_on)
        })
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Vec<StartSeries>)]) -> Result<report::Section> {
        show::section(context, cells)
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Vec<StartSeries>)]) -> Result<BTreeMap<String, String>> {
        Ok(show::claims(cells))
    }
}
