//! The supplement's dynamic results (a) to (g): a guess must not change the motion.

mod show;

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use dataset::Scenario;
use evaluation::paper::motions::Trace;
use scene::sampling::{Parameters, supplement};
use serde::{Deserialize, Serialize};

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::traces;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    figure: String,
    place: usize,
    steps: usize,
}

pub(crate) struct Dynamics;

/// Frames whose centrelines are drawn.
const FRAMES: [usize; 5] = [0, 10, 20, 35, 50];

impl Section for Dynamics {
    type Key = Key;
    type Value = Vec<Trace>;
    const ID: &'static str = "dynamics";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let figures = supplement().into_iter().flat_map(|(figure, scenes)| {
            let scenes = context.size.pick(1, scenes.len());
            (0..scenes).map(move |place| (figure, place))
        });
        Ok(figures.map(|(figure, place)| Key { figure: figure.to_string(), place, steps: 100 }).collect())
    }

    fn seconds(&self, _: &Key) -> f64 {
        0.5
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Trace>>> {
        let parameters = parameters(key).context("a figure that the supplement does not have")?;
        let guesses = context.library.guesses(scenario_of(parameters), Learned::Networks)?;
        traces(&parameters.scene()?, &guesses, 1e-8, (key.steps, &FRAMES), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<report::Section> {
        Ok(show::section(context, cells))
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        Ok(show::claims(cells))
    }
}

fn scenario_of(parameters: Parameters) -> Scenario {
    if matches!(parameters, Parameters::Rod(_)) { Scenario::Rod } else { Scenario::Helix }
}

fn parameters(key: &Key) -> Option<Parameters> {
    let (_, scenes) = supplement().into_iter().find(|(figure, _)| key.figure.starts_with(*figure))?;
    scenes.get(key.place).copied()
}
