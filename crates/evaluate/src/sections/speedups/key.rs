//! Of what speed-ups are measured.

use anyhow::Result;
use cosserat::scene::sampling::{Parameters, Tree};
use cosserat::scene::{self, Scene};
use serde::{Deserialize, Serialize};

/// The section's name.
pub(super) const ID: &str = "speedups";

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SpeedupsKey {
    /// Of trees, "trees-" and the number of rods.
    pub(super) scene: String,
    /// Repetition; of trees, the topology.
    pub(super) index: u64,
    pub(super) steps: usize,
    /// Of all, for times: see [`evaluation::paper::speedup::measure`].
    pub(super) repeats: usize,
    pub(super) preconditioner: String,
    pub(super) tolerance: f64,
    pub(super) seed: u64,
}

pub(super) fn scene_of(key: &SpeedupsKey) -> Result<Scene> {
    let Some(rods) = key.scene.strip_prefix("trees-") else { return Ok(scene::builtin(&key.scene)?) };
    Ok(Parameters::Tree(Tree { rods: rods.parse()?, ..Tree::sample(key.seed, key.index) }).scene()?)
}
