//! Scenes drawn at random, held against laws of mechanics.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use laws::{Failure, campaign};
use report::{Cell, Section as PageSection};
use serde::{Deserialize, Serialize};

use crate::blocks::{section, table};
use crate::cells::Section;
use crate::context::Context;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct LawsKey {
    seed: u64,
    first: u64,
    count: u64,
}

/// What some scenes came to.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    scenes: u64,
    steps: u64,
    unsolved_scenes: u64,
    unsolved_steps: u64,
    contacts: u64,
    /// Number of the scene, law, and how it is broken.
    broken: Vec<(u64, String, String)>,
}

pub(crate) struct Laws;

impl Section for Laws {
    type Key = LawsKey;
    type Value = Value;
    const ID: &'static str = "laws";

    fn keys(&self, context: &Context) -> Result<Vec<LawsKey>> {
        let [scenes, count] = context.size.pick([50, 50], [10_000, 500]);
        let firsts = (0..scenes).step_by(usize::try_from(count)?);
        Ok(firsts.map(|first| LawsKey { seed: 77, first, count }).collect())
    }

    fn seconds(&self, key: &LawsKey) -> f64 {
        0.15 * key.count as f64
    }

    fn measure(&mut self, _: &Context, key: &LawsKey, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        let broken = Mutex::new(Vec::new());
        let mut found = laws::Found::default();
        // In parts, between which the caller is asked.
        for first in (key.first..key.first + key.count).step_by(50) {
            let tell = |failures: &[Failure]| {
                let mut broken = broken.lock().unwrap_or_else(PoisonError::into_inner);
                broken.extend(
                    failures
                        .iter()
                        .map(|failure| (failure.index, failure.drawn.law.to_string(), failure.drawn.to_string())),
                );
                true
            };
            found = found.and(campaign(key.seed, first..(first + 50).min(key.first + key.count), &tell));
            if !go_on() {
                return Ok(None);
            }
        }
        let mut broken = broken.into_inner().unwrap_or_else(PoisonError::into_inner);
        broken.sort();
        let laws::Found { scenes, steps, unsolved_scenes, unsolved_steps, contacts, .. } = found;
        Ok(Some(Value { scenes, steps, unsolved_scenes, unsolved_steps, contacts, broken }))
    }

    fn show(&self, context: &Context, cells: &[(&LawsKey, &Value)]) -> Result<PageSection> {
        let sum = |of: fn(&Value) -> u64| cells.iter().map(|(_, value)| of(value)).sum::<u64>();
        let broken = || cells.iter().flat_map(|(_, value)| &value.broken);
        let mut by_law: BTreeMap<&str, Vec<String>> =
            laws::Law::ALL.iter().map(|law| (law.name(), Vec::new())).collect();
        for (scene, law, _) in broken() {
            by_law.entry(law).or_default().push(scene.to_string());
        }
        let scenes_run = sum(|value| value.scenes);
        let seed = cells.first().map_or(0, |(key, _)| key.seed);
        let conditions = context
            .without_networks("none: laws are checked")
            .with("scenes", format!("{scenes_run} of seed {seed}, {} steps", sum(|value| value.steps)));
        let row = |(law, scenes): (&str, Vec<String>)| {
            let count = scenes.len().to_string();
            let which = if scenes.is_empty() { Cell::muted("-") } else { scenes.join(", ").into() };
            let count = if scenes.is_empty() { count.into() } else { Cell::strong(count) };
            vec![law.into(), count, scenes_run.to_string().into(), which]
        };
        let head = [
            "laws-broken",
            "Laws that random scenes break",
            "Each law by the number of scenes in which a step breaks it without a status that says so. `evaluate random --seed 77 --first N \
             --count 1` shows scene N.",
        ];
        let laws =
            table(head, "law | #scenes | #of | which", by_law.into_iter().map(row).collect(), conditions.clone());
        let words =
            broken().map(|(scene, law, how)| vec![scene.to_string().into(), law.as_str().into(), how.as_str().into()]);
        let head = ["laws-scenes", "How they break them", ""];
        let mut blocks = vec![laws];
        if broken().next().is_some() {
            blocks.push(table(head, "#scene | law | how", words.collect(), conditions));
        }
        let introduction = format!(
            "Scenes drawn at random from the documented features, each run held against laws of mechanics step by step: of {scenes_run} scenes \
             with {} steps and {} contact forces {} break a law; {} steps in {} scenes were not solved, as their status says.",
            sum(|value| value.steps),
            sum(|value| value.contacts),
            broken().map(|(scene, ..)| scene).collect::<std::collections::BTreeSet<_>>().len(),
            sum(|value| value.unsolved_steps),
            sum(|value| value.unsolved_scenes)
        );
        Ok(section([Self::ID, "Random scenes", &introduction], blocks))
    }
}
