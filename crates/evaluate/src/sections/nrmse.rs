//! The supplement's comparison: error of the positions over time, of guesses and of predictions alone.

mod show;

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::paper::motions::Trace;
use serde::{Deserialize, Serialize};

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{SEED, traces};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    scenario: Scenario,
    simulation: u64,
    steps: usize,
    seed: u64,
}

pub(crate) struct Nrmse;

impl Section for Nrmse {
    type Key = Key;
    type Value = Vec<Trace>;
    const ID: &'static str = "nrmse";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let steps = context.size.pick(60, 200);
        // Of helices fewer: a search of nearest neighbours takes long there.
        let simulations = [(Scenario::Rod, context.size.pick(2, 20)), (Scenario::Helix, context.size.pick(2, 5))];
        let of = |(scenario, count)| (0..count).map(move |simulation| Key { scenario, simulation, steps, seed: SEED });
        Ok(simulations.into_iter().flat_map(of).collect())
    }

    fn seconds(&self, key: &Key) -> f64 {
        (if key.scenario == Scenario::Rod { 0.004 } else { 0.5 }) * key.steps as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Trace>>> {
        let guesses = context.library.guesses(key.scenario, Learned::All)?;
        let scene = key.scenario.sample(key.seed, key.simulation).scene()?;
        traces(&scene, &guesses, 1e-6, (key.steps, &[]), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<report::Section> {
        show::section(context, cells)
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        Ok(show::claims(cells))
    }
}
