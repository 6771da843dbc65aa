//! The paper's total speed-ups: collisions, the knot, trees in wind.

mod key;
mod show;

use std::collections::BTreeMap;

use anyhow::Result;
use evaluation::paper::entries;
use evaluation::paper::speedup::{self, SceneRun};

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{BLOCK_JACOBI, RAW, SEED, solver, with_guesses};
use crate::ways::cap;
use key::{SpeedupsKey, scene_of};

pub(crate) struct Speedups;

/// The paper's scenes, and for how many steps they are run.
const SCENES: [(&str, [usize; 2]); 3] = [("helix-on-plane", [14, 30]), ("two-rods", [20, 100]), ("knot", [20, 100])];

/// Rods of the trees.
const TREES: [usize; 4] = [10, 20, 40, 70];

/// Conjugate gradients as the paper may have run them, and as one would run them.
const SOLVERS: [(&str, f64); 2] = [(RAW, 1e-4), (BLOCK_JACOBI, 1e-4)];

impl Section for Speedups {
    type Key = SpeedupsKey;
    type Value = SceneRun;
    const ID: &'static str = key::ID;

    fn keys(&self, context: &Context) -> Result<Vec<SpeedupsKey>> {
        let size = context.size;
        let mut keys = Vec::new();
        for (preconditioner, tolerance) in SOLVERS {
            let mut add = |scene: String, runs: u64, steps: usize, repeats: usize| {
                keys.extend((0..runs).map(|index| {
                    let (scene, preconditioner) = (scene.clone(), preconditioner.to_owned());
                    SpeedupsKey { scene, index, steps, repeats, preconditioner, tolerance, seed: SEED }
                }));
            };
            let repeats = size.pick(1, 2);
            for (scene, [quick, full]) in SCENES {
                add(scene.to_owned(), size.pick(1, 5), size.pick(quick, full), repeats);
            }
            // In raw units a step takes most iterations; thirty topologies say more than repeated times.
            let steps = if preconditioner == RAW { 5 } else { 10 };
            for rods in TREES {
                add(format!("trees-{rods}"), size.pick(1, speedup::TOPOLOGIES as u64), size.pick(1, steps), 1);
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &SpeedupsKey) -> f64 {
        let rods = key.scene.strip_prefix("trees-").and_then(|rods| rods.parse().ok());
        let a_step = rods.map_or(0.05, |rods: f64| 0.05 * rods);
        a_step * (key.steps * key.repeats) as f64
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &SpeedupsKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<SceneRun>> {
        let scene = scene_of(key)?;
        let guesses = context.library.for_scene(&scene, Learned::Networks)?;
        let mut solver = solver(&key.preconditioner, key.tolerance)?;
        solver.cg.max_iterations = cap(&scene);
        // Where conjugate gradients run out, halved steps would take their time to show the same.
        solver.step.max_halvings = 0;
        with_guesses(&scene, &guesses, |named| {
            speedup::measure(&scene, key.steps, &entries(&solver, named), key.repeats, go_on)
        })
    }

    fn show(&self, context: &Context, cells: &[(&SpeedupsKey, &SceneRun)]) -> Result<report::Section> {
        show::section(context, cells)
    }

    fn claims(&self, _: &Context, cells: &[(&SpeedupsKey, &SceneRun)]) -> Result<BTreeMap<String, String>> {
        Ok(show::claims(cells))
    }
}
