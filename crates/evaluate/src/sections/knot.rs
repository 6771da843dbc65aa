//! The supplement's knot: pulled tight by a solver, from a guess, and by predictions alone.

mod show;

use std::collections::BTreeMap;

use anyhow::Result;
use evaluation::paper::motions::Trace;
use serde::{Deserialize, Serialize};

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::traces;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    steps: usize,
    frames: Vec<usize>,
}

pub(crate) struct Knot;

impl Section for Knot {
    type Key = Key;
    type Value = Vec<Trace>;
    const ID: &'static str = "knot";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let (steps, every) = context.size.pick((40, 20), (480, 96));
        Ok(vec![Key { steps, frames: (0..=steps).step_by(every).collect() }])
    }

    fn seconds(&self, key: &Key) -> f64 {
        0.1 * key.steps as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Trace>>> {
        let scene = scene::builtin("knot")?;
        let guesses = context.library.for_scene(&scene, Learned::Networks)?;
        traces(&scene, &guesses, 1e-8, (key.steps, &key.frames), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<report::Section> {
        Ok(show::section(context, cells))
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        Ok(show::claims(cells))
    }
}
