//! What each stage of a scene's steps costs, and what was left out: shown.

use std::collections::BTreeMap;

use cosserat::simulation::Formulation;
use evaluation::needs::{LeftOut, Needs};
use evaluation::stages::Stages;
use report::{Bar, BarChart, Block, Cell, Charts, Conditions, Figure, Section};

use super::key::NeedsKey;
use crate::blocks::{self, table};
use crate::context::Context;
use crate::show::number;

pub(super) fn section(context: &Context, cells: &[(&NeedsKey, &Needs)]) -> Section {
    let mut conditions = context.conditions("medians of a step, stage by stage");
    if let Some((key, _)) = cells.first() {
        conditions = conditions.with("steps", key.steps.to_string());
    }
    let default: Vec<_> = cells.iter().filter(|(key, _)| is_default(key)).collect();
    let bar = |(key, needs): &&(&NeedsKey, &Needs)| {
        let values = stages(&needs.median_us).map(|(_, us)| us / needs.segments as f64).collect();
        Bar { name: key.scene.clone(), values }
    };
    let chart = |(title, touches): (&str, bool)| {
        let own = default.iter().filter(|(_, needs)| (needs.median_us.contact > 0.0) == touches);
        BarChart {
            title: title.to_owned(),
            label: "time a step and segment [us]".to_owned(),
            parts: stages(&Stages::default()).map(|(name, _)| name.to_owned()).collect(),
            bars: own.map(bar).collect(),
        }
    };
    let figure = Figure {
        id: "needs-stages".to_owned(),
        title: "What a segment costs in a step, stage by stage".to_owned(),
        caption: "Default settings.".to_owned(),
        charts: Charts::Bars([("without contacts", false), ("with contacts", true)].map(chart).to_vec()),
        conditions: conditions.clone(),
    };
    let blocks = vec![Block::Figure(figure), choices(cells, conditions.clone()), left_out(&default, conditions)];
    blocks::section(["needs", "What a scene needs", &in_words(cells)], blocks)
}

pub(super) fn claims(cells: &[(&NeedsKey, &Needs)]) -> BTreeMap<String, String> {
    let of_tree = cells.iter().filter(|(key, _)| key.scene == "tree-70" && is_default(key));
    let words =
        |needs: &Needs| format!("{} times real time with {} segments", number(real_time(needs)), needs.segments);
    of_tree.map(|(_, needs)| ("trees-real-time".to_owned(), words(needs))).collect()
}

fn is_default(key: &NeedsKey) -> bool {
    key.formulation == Formulation::default().name()
}

/// Each scene with what is chosen for it, and whether what is left out was really left out.
fn in_words(cells: &[(&NeedsKey, &Needs)]) -> String {
    let counts = || cells.iter().flat_map(|(_, needs)| &needs.left_out).map(|left_out| left_out.count);
    format!(
        "Each scene with the solver and the start that are chosen for it (`--solver auto`, the default), what each stage costs, \
         and what is left out because the scene has no use for it. By the counters {} of {} things left out were done all the \
         same.",
        counts().filter(|&count| count > 0).count(),
        counts().count()
    )
}

/// How many seconds are simulated in one.
fn real_time(needs: &Needs) -> f64 {
    1e6 * needs.dt_s / needs.median_us.total
}

/// The stages without their total.
fn stages(us: &Stages) -> impl Iterator<Item = (&'static str, f64)> {
    us.by_name().into_iter().filter(|(name, _)| *name != "total")
}

fn choices(cells: &[(&NeedsKey, &Needs)], conditions: Conditions) -> Block {
    let row = |(key, needs): &(&NeedsKey, &Needs)| {
        let Needs { solver, guess, reason, .. } = needs;
        let texts = [&key.scene, &key.formulation, solver, guess, reason].map(|text| Cell::from(text.as_str()));
        let numbers = [needs.median_us.total, real_time(needs)].map(|value| number(value).into());
        texts.into_iter().chain(numbers).collect()
    };
    let head = [
        "needs-choices",
        "What is chosen for each scene, and why",
        "The formulation is the user's: it says which problem is to be solved.",
    ];
    let headings = "scene | formulation | solver | start | why | #time a step [us] | #times real time";
    table(head, headings, cells.iter().map(row).collect(), conditions)
}

fn left_out(cells: &[&(&NeedsKey, &Needs)], conditions: Conditions) -> Block {
    let rows = cells.iter().flat_map(|(key, needs)| {
        let row = move |LeftOut { what, why, count }: &LeftOut| {
            [&key.scene, what, why, &count.to_string()].map(|text| Cell::from(text.as_str())).to_vec()
        };
        needs.left_out.iter().map(row)
    });
    let head = ["needs-left-out", "What is left out", "Default settings."];
    table(head, "scene | left out | why | #times done all the same", rows.collect(), conditions)
}
