//! What a scene needs: the cost of each stage, and what was left out.

use std::collections::BTreeMap;

use anyhow::Result;
use evaluation::needs::{self, Needs};
use report::{Bar, BarChart, Block, Charts, Column, Figure, Section as PageSection, Table};
use serde::{Deserialize, Serialize};
use solver::formulation::Formulation;
use solver::step::StepParams;

use crate::cells::Section;
use crate::context::Context;
use crate::show::number;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    scene: String,
    formulation: String,
    steps: usize,
}

pub(crate) struct Scenes;

/// Scenes that show one need each, or several.
const SCENES: [&str; 14] = [
    "bending-rod",
    "helix",
    "slack-rod",
    "tip-mass",
    "net",
    "tree-10",
    "tree-20",
    "tree-40",
    "tree-70",
    "two-rods",
    "helix-on-plane",
    "knot",
    "net-on-sphere",
    "hair",
];

impl Section for Scenes {
    type Key = Key;
    type Value = Needs;
    const ID: &'static str = "needs";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let formulations = context.size.pick(&[Formulation::XpbdGeometric][..], &Formulation::ALL[..]);
        let steps = context.size.pick(20, 100);
        let of = |scene: &&str| {
            let scene = (*scene).to_owned();
            formulations.iter().map(move |formulation| Key {
                scene: scene.clone(),
                formulation: formulation.name().to_owned(),
                steps,
            })
        };
        Ok(SCENES.iter().flat_map(of).collect())
    }

    fn seconds(&self, key: &Key) -> f64 {
        let a_step = match (key.scene.as_str(), key.formulation.as_str()) {
            ("helix-on-plane", "newton") => 10.0,
            ("net-on-sphere", "newton") => 1.0,
            _ => 0.01,
        };
        a_step * key.steps as f64
    }

    fn measure(&mut self, _: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Needs>> {
        let scene = scene::builtin(&key.scene)?;
        let formulation = key.formulation.parse().map_err(anyhow::Error::msg)?;
        let params = StepParams { formulation, ..StepParams::DEFAULT };
        let mut is_whole = true;
        let needs = needs::measure(&scene.model, &scene.state, (scene.run.dt, key.steps), &params, |_| {
            is_whole = go_on();
            is_whole
        })?;
        Ok(is_whole.then_some(needs))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Needs)]) -> Result<PageSection> {
        let conditions = context.conditions("medians of a step, stage by stage");
        let conditions = match cells.first() {
            Some((key, _)) => conditions.with("steps", key.steps.to_string()),
            None => conditions,
        };
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
        let default = || cells.iter().filter(|(key, _)| key.formulation == Formulation::default().name());
        blocks.push(Block::Figure(Figure {
            id: "needs-stages".to_owned(),
            title: "What a segment costs in a step, stage by stage".to_owned(),
            caption: "Default settings. A stage that a scene does not need takes no time at all.".to_owned(),
            charts: Charts::Bars(
                [("without contacts", false), ("with contacts", true)]
                    .map(|(title, touches)| BarChart {
                        title: title.to_owned(),
                        label: "time a step and segment [us]".to_owned(),
                        parts: STAGES.map(str::to_owned).to_vec(),
                        bars: default()
                            .filter(|(_, needs)| (needs.median_us.contact > 0.0) == touches)
                            .map(|(key, needs)| bar(&key.scene, needs))
                            .collect(),
                    })
                    .to_vec(),
            ),
            conditions: conditions.clone(),
        }));
        blocks.push(Block::Table(choices(cells, conditions.clone())));
        blocks.push(Block::Table(left_out(&default().copied().collect::<Vec<_>>(), conditions)));
        Ok(PageSection { id: Self::ID.to_owned(), title: "What a scene needs".to_owned(), blocks })
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Needs)]) -> Result<BTreeMap<String, String>> {
        let is_largest_tree =
            |(key, _): &&(&Key, &Needs)| key.scene == "tree-70" && key.formulation == Formulation::default().name();
        let words = |(_, needs): &(&Key, &Needs)| {
            let times = 1e6 * needs.dt_s / needs.median_us.total;
            format!("{} times real time with {} segments", number(times), needs.segments)
        };
        Ok(cells
            .iter()
            .find(is_largest_tree)
            .map(|cell| ("trees-real-time".to_owned(), words(cell)))
            .into_iter()
            .collect())
    }
}

const INTRODUCTION: &str = "Each scene with the solver and the start that are chosen for it (`--solver auto`, the default), \
    what each stage costs, and what is left out because the scene has no use for it. The counters prove it: what is left \
    out was done exactly zero times.";

const STAGES: [&str; 7] = ["drag", "predict", "guess", "assemble", "solve", "update", "contact"];

fn bar(scene: &str, needs: &Needs) -> Bar {
    let us = &needs.median_us;
    let stages = [us.drag, us.predict, us.guess, us.assemble, us.solve, us.update, us.contact];
    Bar { name: scene.to_owned(), values: stages.map(|us| us / needs.segments as f64).to_vec() }
}

fn choices(cells: &[(&Key, &Needs)], conditions: report::Conditions) -> Table {
    let row = |(key, needs): &(&Key, &Needs)| {
        let simulated = 1e6 * needs.dt_s;
        vec![
            key.scene.as_str().into(),
            key.formulation.as_str().into(),
            needs.solver.as_str().into(),
            needs.guess.as_str().into(),
            needs.reason.as_str().into(),
            number(needs.median_us.total).into(),
            number(simulated / needs.median_us.total).into(),
        ]
    };
    Table {
        id: "needs-choices".to_owned(),
        title: "What is chosen for each scene, and why".to_owned(),
        caption: "The formulation is the user's: it says which problem is to be solved.".to_owned(),
        columns: vec![
            Column::text("scene"),
            Column::text("formulation"),
            Column::text("solver"),
            Column::text("start"),
            Column::text("why"),
            Column::number("time a step [us]"),
            Column::number("times real time"),
        ],
        rows: cells.iter().map(row).collect(),
        conditions,
    }
}

fn left_out(cells: &[(&Key, &Needs)], conditions: report::Conditions) -> Table {
    let rows = cells.iter().flat_map(|(key, needs)| {
        needs.left_out.iter().map(|left_out| {
            vec![
                key.scene.as_str().into(),
                left_out.what.as_str().into(),
                left_out.why.as_str().into(),
                left_out.count.to_string().into(),
            ]
        })
    });
    Table {
        id: "needs-left-out".to_owned(),
        title: "What is left out".to_owned(),
        caption: "Default settings.".to_owned(),
        columns: vec![
            Column::text("scene"),
            Column::text("left out"),
            Column::text("why"),
            Column::number("times done all the same"),
        ],
        rows: rows.collect(),
        conditions,
    }
}
