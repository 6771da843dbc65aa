//! The paper's figure on long-term stability: the rod's length, end to end against a guess in the solver.

mod show;

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::paper::stability::{self, Curve};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{motion, solver, with_predictions};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    modulus: f64,
    steps: usize,
}

pub(crate) struct LongTerm;

/// Young's moduli [Pa]: Table 1's range.
const MODULI: [f64; 5] = [1e4, 3e4, 1e5, 3e5, 1e6];

impl Section for LongTerm {
    type Key = Key;
    type Value = Vec<Curve>;
    const ID: &'static str = "long-term";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let steps = context.size.pick(200, stability::STEPS);
        let moduli = context.size.pick(&MODULI[2..3], &MODULI[..]);
        Ok(moduli.iter().map(|&modulus| Key { modulus, steps }).collect())
    }

    fn seconds(&self, key: &Key) -> f64 {
        0.003 * key.steps as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Curve>>> {
        let guesses = context.library.guesses(Scenario::Rod, Learned::Networks)?;
        let scene = stability::rod(key.modulus).scene()?;
        with_predictions(&scene, &guesses, &solver(PreconditionerKind::Raw, 1e-4), |ways| {
            stability::measure(&motion(&scene, key.steps), ways, go_on)
        })
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Vec<Curve>)]) -> Result<report::Section> {
        show::section(context, cells)
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Vec<Curve>)]) -> Result<BTreeMap<String, String>> {
        Ok(show::claims(cells))
    }
}
