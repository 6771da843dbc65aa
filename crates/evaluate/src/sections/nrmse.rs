//! The supplement's comparison: error of the positions over time, of guesses and of predictions alone.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::guesses::Spread;
use evaluation::paper::motions::{Trace, deviations};
use report::{Axis, Block, Charts, Figure, LineChart, Section as PageSection};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{FREE, SEED, is_end_to_end, solver, traces};
use crate::show::{band, join, number, of_way};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    scenario: Scenario,
    simulation: u64,
    steps: usize,
    seed: u64,
}

pub(crate) struct Nrmse;

const INTRODUCTION: &str = "The supplement's comparison: the positions' root mean square error against vanilla \
    position-based dynamics, normalised by the rods' mean length (the paper does not say by what it normalises), for the \
    network as a guess, and for the network and nearest neighbours end to end.";

impl Section for Nrmse {
    type Key = Key;
    type Value = Vec<Trace>;
    const ID: &'static str = "nrmse";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let steps = context.size.pick(60, 200);
        // Of helices fewer: a search of nearest neighbours takes long there.
        let simulations = [(Scenario::Rod, context.size.pick(2, 20)), (Scenario::Helix, context.size.pick(2, 5))];
        let of = |(scenario, count)| (0..count).map(move |simulation| Key { scenario, simulation, steps, seed: SEED });
        Ok(simulations.into_iter().flat_map(of).collect())
    }

    fn seconds(&self, key: &Key) -> f64 {
        (if key.scenario == Scenario::Rod { 0.004 } else { 0.5 }) * key.steps as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Trace>>> {
        let guesses = context.library.guesses(key.scenario, Learned::All)?;
        let scene = key.scenario.sample(key.seed, key.simulation).scene()?;
        traces(&scene, &guesses, &solver(PreconditionerKind::BlockJacobi, 1e-6), (key.steps, &[]), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<PageSection> {
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
        if let Some((key, _)) = cells.first() {
            let [rods, helices] = FREE.map(|scenario| of(cells, scenario).len());
            let charts = FREE.map(|scenario| chart(context, scenario, &of(cells, scenario)));
            blocks.push(Block::Figure(Figure {
                id: "nrmse-over-time".to_owned(),
                title: "Error of the positions over time".to_owned(),
                caption: "Medians over the simulations, with quartiles. Dashed: predictions alone, end to end."
                    .to_owned(),
                charts: Charts::Lines(charts.into_iter().collect::<Result<_>>()?),
                conditions: context
                    .conditions("none: positions are compared here")
                    .with(
                        "simulations",
                        format!("{rods} rods, {helices} helices, {} steps, seed {}", key.steps, key.seed),
                    )
                    .with(
                        "solver",
                        "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-6 from guesses",
                    ),
            }));
        }
        Ok(PageSection { id: Self::ID.to_owned(), title: "Guess against end to end".to_owned(), blocks })
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        let mut words = [String::new(), String::new()];
        for scenario in FREE {
            for way in deviations(&of(cells, scenario)).into_iter().skip(1) {
                let last = way.last_nrmse.map_or("not finite".to_owned(), |spread| number(spread.median));
                join(&mut words[usize::from(is_end_to_end(&way.name))], &format!("{scenario}, {}: {last}", way.name));
            }
        }
        let [guess, end_to_end] = words.map(|words| format!("after the last frame, {words}"));
        Ok([("nrmse-guess".to_owned(), guess), ("nrmse-end-to-end".to_owned(), end_to_end)].into())
    }
}

fn of<'a>(cells: &[(&Key, &'a Vec<Trace>)], scenario: Scenario) -> Vec<&'a Vec<Trace>> {
    cells.iter().filter(|(key, _)| key.scenario == scenario).map(|(_, traces)| *traces).collect()
}

fn chart(context: &Context, scenario: Scenario, cells: &[&Vec<Trace>]) -> Result<LineChart> {
    let ways = cells.first().map_or(&[][..], |traces| &traces[..]);
    let series = ways.iter().enumerate().skip(1).map(|(way, Trace { name, .. })| {
        let steps = cells.iter().map(|traces| traces[way].nrmse.len()).max().unwrap_or(0);
        let at = |step: usize| {
            let errors = cells.iter().filter_map(|traces| traces[way].nrmse.get(step).copied());
            (step as f64 + 1.0, Spread::of(errors))
        };
        of_way(band(name.clone(), (0..steps).map(at), 1.0))
    });
    Ok(LineChart {
        title: scenario.to_string(),
        x: Axis::linear("frame"),
        // Predictions alone may run away as far as numbers go.
        y: Axis { range: Some([1e-12, 1e3]), ..Axis::log("NRMSE") },
        series: series.collect(),
        references: vec![context.library.training_end(scenario)?],
        ..LineChart::default()
    })
}
