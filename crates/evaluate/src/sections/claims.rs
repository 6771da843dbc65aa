//! The paper says, we measure: every number of the paper beside ours.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use catalogue::{GuessName, LearnedName, Recipe};
use dataset::{Config, Scenario};
use evaluation::paper::claims;
use report::{Block, Cell, Column, Conditions, Section as PageSection, Table};
use scene::sampling::Tree;

use crate::context::Context;
use crate::library::Learned;

/// The section, from what the other sections measured.
pub(crate) fn section(context: &Context, measured: BTreeMap<String, String>) -> Result<PageSection> {
    let mut supplied = settings(context)?;
    supplied.extend(measured);
    let rows = claims::table(&supplied)?;
    let missing = rows.iter().filter(|row| row.ours.is_none()).count();
    let cells = rows.iter().map(|row| {
        let ours = row.ours.as_deref().map_or_else(|| Cell::muted("not measured"), Cell::from);
        let reading = row.reading.clone().or_else(|| row.at.as_ref().map(|at| format!("from {at}")));
        vec![
            row.what.as_str().into(),
            row.paper.as_str().into(),
            ours,
            row.place.as_str().into(),
            reading.unwrap_or_default().into(),
            row.why.clone().filter(|_| row.ours.is_some()).unwrap_or_default().into(),
        ]
    });
    let table = Table {
        id: "claims-table".to_owned(),
        title: "The paper says, we measure".to_owned(),
        caption:
            "Every number that the paper gives, settings first. Conditions of what is measured stand with the figures."
                .to_owned(),
        columns: ["what", "paper", "here", "where in the paper", "how it is read", "why it differs"]
            .map(Column::text)
            .to_vec(),
        rows: cells.collect(),
        conditions: Conditions::new("numbers of the paper", rows.len().to_string())
            .with("not measured here", missing.to_string()),
    };
    let blocks = vec![Block::Paragraph(INTRODUCTION.to_owned()), Block::Table(table)];
    Ok(PageSection { id: "claims".to_owned(), title: "The paper and we".to_owned(), blocks })
}

const INTRODUCTION: &str = "The paper leaves open what decides most of these numbers: the tolerance of its conjugate \
    gradients, their preconditioner, the rods' radius and density. Where ours differ, the reason is nearly always one of \
    three: its gains are had in one cell alone, raw units at a tolerance of 1e-4 and beyond the first steps; our vanilla \
    solver is faster, so that inference weighs more; and its rival is conjugate gradients from zero, while a direct solver, \
    or Fischer's projection, is faster than both.";

/// Settings that belong to networks and data sets.
fn settings(context: &Context) -> Result<BTreeMap<String, String>> {
    let name = GuessName::Learned(LearnedName::Network(Recipe::Paper));
    let networks = context.library.guesses(Scenario::Rod, Learned::Networks)?;
    let network = networks.iter().find(|(own, _)| *own == name).and_then(|(_, guess)| guess.network());
    let network = network.context("no network for rods is built in")?;
    let (sizes, training) = (network.sizes(), &network.card().training);
    let [knot, tree] = [Scenario::Knot, Scenario::Tree].map(Config::table_1);
    let mut nodes = 0;
    for index in 0..tree.train_trajectories as u64 {
        nodes += Scenario::Tree.sample(tree.seed, index).scene()?.model.segments.len();
    }
    let settings = [
        ("network-blocks", sizes.gn_blocks.to_string()),
        ("network-layers", sizes.mlp_layers.to_string()),
        ("network-width", sizes.width.to_string()),
        ("network-output", "[-1, 1] by tanh, times recorded norms".to_owned()),
        ("training-loss", if training.loss == "mse" { "MSE(V) + MSE(E)".to_owned() } else { training.loss.clone() }),
        ("training-rate", format!("{}, {}", training.learning_rate, training.schedule)),
        ("training-machine", format!("a processor, {} threads, {}", training.threads, training.backend)),
        ("trees-training", tree.train_trajectories.to_string()),
        ("trees-training-rods", Tree::default().rods.to_string()),
        ("trees-training-nodes", format!("{:.0}", nodes as f64 / tree.train_trajectories as f64)),
        ("knot-training", knot.train_trajectories.to_string()),
        ("knot-training-frames", knot.steps.to_string()),
    ];
    let mut settings: BTreeMap<String, String> =
        settings.into_iter().map(|(id, value)| (id.to_owned(), value)).collect();
    for scenario in [Scenario::Rod, Scenario::Helix] {
        let networks = context.library.guesses(scenario, Learned::Networks)?;
        let own = networks.iter().find(|(own, _)| *own == name).and_then(|(_, guess)| guess.network());
        if let Some(network) = own {
            let training = &network.card().training;
            let before =
                if training.command.contains("--from") { ", on from an earlier training's weights" } else { "" };
            let took = format!("{:.0} minutes{before}", training.seconds / 60.0);
            settings.insert(format!("training-hours-{scenario}"), took);
        }
    }
    Ok(settings)
}
