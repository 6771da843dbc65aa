//! The supplement's comparison: error of the positions over time, of guesses and of predictions alone.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::guesses::Spread;
use evaluation::paper::motions::{Trace, by_way, last_nrmse};
use report::{Axis, LineChart, Section as PageSection};
use serde::{Deserialize, Serialize};

use crate::blocks::{chart, figure, groups, section, values};
use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{BLOCK_JACOBI, FREE, SEED, is_end_to_end, solver, traces};
use crate::show::{band, join, number, of_way};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct NrmseKey {
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
    type Key = NrmseKey;
    type Value = Vec<Trace>;
    const ID: &'static str = "nrmse";

    fn keys(&self, context: &Context) -> Result<Vec<NrmseKey>> {
        let steps = context.size.pick(60, 200);
        // Of helices fewer: a search of nearest neighbours takes long there.
        let simulations = [(Scenario::Rod, context.size.pick(2, 20)), (Scenario::Helix, context.size.pick(2, 5))];
        let of =
            |(scenario, count)| (0..count).map(move |simulation| NrmseKey { scenario, simulation, steps, seed: SEED });
        Ok(simulations.into_iter().flat_map(of).collect())
    }

    fn seconds(&self, key: &NrmseKey) -> f64 {
        (if key.scenario == Scenario::Rod { 0.004 } else { 0.5 }) * key.steps as f64
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &NrmseKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Vec<Trace>>> {
        let guesses = context.library.guesses(key.scenario, Learned::All)?;
        let scene = key.scenario.sample(key.seed, key.simulation).scene()?;
        traces(&scene, &guesses, &solver(BLOCK_JACOBI, 1e-6)?, (key.steps, &[]), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&NrmseKey, &Vec<Trace>)]) -> Result<PageSection> {
        let of_scenarios = groups(cells, |key| key.scenario).into_iter();
        let charts = of_scenarios.map(|(scenario, own)| errors(context, scenario, &values(&own)));
        let [rods, helices] = FREE.map(|scenario| cells.iter().filter(|(key, _)| key.scenario == scenario).count());
        let steps = cells.first().map_or(0, |(key, _)| key.steps);
        let conditions = context
            .conditions("none: positions are compared here")
            .with("simulations", format!("{rods} rods, {helices} helices, {steps} steps, seed {SEED}"))
            .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-6 from guesses");
        let head = [
            "nrmse-over-time",
            "Error of the positions over time",
            "Medians over the simulations, with quartiles. Dashed: predictions alone, end to end.",
        ];
        let figure = figure(head, charts.collect::<Result<_>>()?, conditions);
        Ok(section([Self::ID, "Guess against end to end", INTRODUCTION], vec![figure]))
    }

    fn claims(&self, _: &Context, cells: &[(&NrmseKey, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        let mut words = [String::new(), String::new()];
        for (scenario, own) in groups(cells, |key| key.scenario) {
            for way in by_way(&values(&own)).into_iter().skip(1) {
                let name = &way[0].name;
                let last = last_nrmse(&way).map_or("not finite".to_owned(), |spread| number(spread.median));
                join(&mut words[usize::from(is_end_to_end(name))], &format!("{scenario}, {name}: {last}"));
            }
        }
        let [guess, end_to_end] = words.map(|words| format!("after the last frame, {words}"));
        Ok([("nrmse-guess".to_owned(), guess), ("nrmse-end-to-end".to_owned(), end_to_end)].into())
    }
}

fn errors(context: &Context, scenario: Scenario, cells: &[&Vec<Trace>]) -> Result<LineChart> {
    let series = by_way(cells).into_iter().skip(1).map(|way| {
        let steps = way.iter().map(|trace| trace.nrmse.len()).max().unwrap_or(0);
        let at = |step: usize| {
            (step as f64 + 1.0, Spread::of(way.iter().filter_map(|trace| trace.nrmse.get(step).copied())))
        };
        of_way(band(&way[0].name, (0..steps).map(at), 1.0))
    });
    // Predictions alone may run away as far as numbers go.
    let y = Axis { range: Some([1e-12, 1e3]), ..Axis::log("NRMSE") };
    let trained = context.library.training_end(scenario)?;
    Ok(chart(scenario.name(), [Axis::linear("frame"), y], series.collect(), vec![trained]))
}
