//! What a scene needs: the cost of each stage, and what was left out.

mod key;
mod show;

use std::collections::BTreeMap;

use anyhow::Result;
use cosserat::scene;
use cosserat::simulation::Formulation;
use evaluation::needs::{self, Needs};
use key::NeedsKey;
use report::Section as PageSection;

use crate::cells::Section;
use crate::context::Context;

pub(crate) struct Scenes;

/// Scenes that show one need each, or several.
const SCENES: &str = "bending-rod helix slack-rod tip-mass net tree-10 tree-20 tree-40 tree-70 two-rods helix-on-plane knot \
    net-on-sphere hair";

impl Section for Scenes {
    type Key = NeedsKey;
    type Value = Needs;
    const ID: &'static str = "needs";

    fn keys(&self, context: &Context) -> Result<Vec<NeedsKey>> {
        let formulations = context.size.pick(&[Formulation::Newton][..], &Formulation::ALL);
        let steps = context.size.pick(20, 100);
        let mut keys = Vec::new();
        for scene in SCENES.split(' ') {
            for formulation in formulations {
                // Of these `newton` takes seconds a step.
                let is_slow = matches!((scene, formulation), ("helix-on-plane" | "net-on-sphere", Formulation::Newton));
                let steps = if is_slow { steps / 10 } else { steps };
                keys.push(NeedsKey { scene: scene.to_owned(), formulation: formulation.name().to_owned(), steps });
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &NeedsKey) -> f64 {
        let a_step = match (key.scene.as_str(), key.formulation.as_str()) {
            ("helix-on-plane", "newton") => 10.0,
            ("net-on-sphere", "newton") => 1.0,
            _ => 0.01,
        };
        a_step * key.steps as f64
    }

    fn measure(&mut self, _: &Context, key: &NeedsKey, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Needs>> {
        let formulation = key.formulation.parse().map_err(anyhow::Error::msg)?;
        Ok(needs::measure(&scene::builtin(&key.scene)?, key.steps, formulation, go_on)?)
    }

    fn show(&self, context: &Context, cells: &[(&NeedsKey, &Needs)]) -> Result<PageSection> {
        Ok(show::section(context, cells))
    }

    fn claims(&self, _: &Context, cells: &[(&NeedsKey, &Needs)]) -> Result<BTreeMap<String, String>> {
        Ok(show::claims(cells))
    }
}
