//! The supplement's comparison: error of the positions over time, of guesses and of predictions alone.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::guesses::Spread;
use evaluation::paper::motions::{self, Trace};
use report::{Axis, Block, Charts, Figure, LineChart, LineStyle, Reference, Section as PageSection, Series};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{SEED, motion, solver, with_predictions};
use crate::show::{band, number};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    scenario: Scenario,
    simulation: u64,
    steps: usize,
    seed: u64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    traces: Vec<Trace>,
}

pub(crate) struct Nrmse;

/// Frames of the training data.
const TRAINED: f64 = 50.0;

impl Section for Nrmse {
    type Key = Key;
    type Value = Value;
    const ID: &'static str = "nrmse";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let steps = context.size.pick(60, 200);
        // Where nearest neighbours are lost among helices, a search takes a hundred times as long.
        let simulations = [(Scenario::Rod, context.size.pick(2, 20)), (Scenario::Helix, context.size.pick(2, 5))];
        let of = |(scenario, count)| (0..count).map(move |simulation| Key { scenario, simulation, steps, seed: SEED });
        Ok(simulations.into_iter().flat_map(of).collect())
    }

    fn seconds(&self, key: &Key) -> f64 {
        (if key.scenario == Scenario::Rod { 0.004 } else { 0.5 }) * key.steps as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        let guesses = context.library.guesses(key.scenario, Learned::All)?;
        let scene = key.scenario.sample(key.seed, key.simulation).scene()?;
        let solver = solver(PreconditionerKind::BlockJacobi, 1e-6);
        let traces = with_predictions(&scene, &guesses, &solver, |ways| {
            motions::measure(&motion(&scene, key.steps), &[], ways, go_on)
        })?;
        // Where each tip was is not shown here.
        let thin = |trace: Trace| Trace { tip: Vec::new(), ..trace };
        Ok(traces.map(|traces| Value { traces: traces.into_iter().map(thin).collect() }))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Value)]) -> Result<PageSection> {
        let mut charts = Vec::new();
        for scenario in [Scenario::Rod, Scenario::Helix] {
            let own = cells.iter().filter(|(key, _)| key.scenario == scenario);
            charts.push(chart(scenario, &own.map(|(_, value)| *value).collect::<Vec<_>>()));
        }
        let Some((key, _)) = cells.first() else { return Ok(page(Vec::new())) };
        let count = |scenario| cells.iter().filter(|(key, _)| key.scenario == scenario).count();
        let [rods, helices] = [Scenario::Rod, Scenario::Helix].map(count);
        let figure = Figure {
            id: "nrmse-over-time".to_owned(),
            title: "Error of the positions over time".to_owned(),
            caption: "Medians over the simulations, with quartiles. Dashed: predictions alone, end to end.".to_owned(),
            charts: Charts::Lines(charts),
            conditions: context
                .conditions("none: positions are compared here")
                .with("simulations", format!("{rods} rods, {helices} helices, {} steps, seed {}", key.steps, key.seed))
                .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-6 from guesses"),
        };
        Ok(page(vec![Block::Paragraph(INTRODUCTION.to_owned()), Block::Figure(figure)]))
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Value)]) -> Result<BTreeMap<String, String>> {
        let mut words = [Vec::new(), Vec::new()];
        for scenario in [Scenario::Rod, Scenario::Helix] {
            let own = cells.iter().filter(|(key, _)| key.scenario == scenario);
            let all: Vec<_> = own.map(|(_, value)| value.traces.clone()).collect();
            for way in motions::agreement(&all).into_iter().skip(1) {
                let last = way.last_nrmse.map_or("not finite".to_owned(), |spread| number(spread.median));
                let is_end_to_end = way.name.ends_with("end to end");
                words[usize::from(is_end_to_end)].push(format!("{scenario}, {}: {last}", way.name));
            }
        }
        let [guess, end_to_end] = words.map(|words| format!("after the last frame, {}", words.join("; ")));
        Ok([("nrmse-guess".to_owned(), guess), ("nrmse-end-to-end".to_owned(), end_to_end)].into())
    }
}

fn page(blocks: Vec<Block>) -> PageSection {
    PageSection { id: Nrmse::ID.to_owned(), title: "Guess against end to end".to_owned(), blocks }
}

const INTRODUCTION: &str = "The supplement's comparison: the positions' root mean square error against vanilla \
    position-based dynamics, normalised by the rods' mean length (the paper does not say by what it normalises), for the \
    network as a guess, and for the network and nearest neighbours end to end.";

fn chart(scenario: Scenario, cells: &[&Value]) -> LineChart {
    let ways = cells.first().map_or(&[][..], |cell| &cell.traces[..]);
    let series = ways.iter().enumerate().skip(1).map(|(way, Trace { name, .. })| {
        let steps = cells.iter().map(|cell| cell.traces[way].nrmse.len()).max().unwrap_or(0);
        let at = |step: usize| {
            let errors = cells.iter().filter_map(|cell| cell.traces[way].nrmse.get(step).copied());
            (step as f64 + 1.0, Spread::of(errors))
        };
        let style = if name.ends_with("end to end") { LineStyle::Dashed } else { LineStyle::Solid };
        Series { style, markers: false, ..band(name.clone(), (0..steps).map(at), 1.0) }
    });
    LineChart {
        title: scenario.to_string(),
        x: Axis::linear("frame"),
        // Predictions alone may run away as far as numbers go.
        y: Axis { range: Some([1e-12, 1e3]), ..Axis::log("NRMSE") },
        series: series.collect(),
        references: vec![Reference::Vertical { x: TRAINED, label: "training data end".to_owned() }],
        ..LineChart::default()
    }
}
