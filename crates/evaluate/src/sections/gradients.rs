//! Derivatives of runs: their cost over segments and steps.

use anyhow::Result;
use cosserat::scene::sampling::{Helix, Parameters};
use evaluation::gradients::{self, Costs};
use report::{Axis, Cell, LineChart, Section as PageSection, Series};
use serde::{Deserialize, Serialize};

use crate::blocks::{chart, figure, section, table};
use crate::cells::Section;
use crate::context::Context;
use crate::show::number;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct GradientKey {
    segments: usize,
    steps: usize,
    /// Rods of so many segments, each by itself.
    rods: usize,
    turns: usize,
}

pub(crate) struct Gradients;

/// Segments, steps and rods: first the size around which one varies.
const QUICK: [[usize; 3]; 4] = [[20, 20, 1], [40, 20, 1], [20, 40, 1], [20, 20, 2]];
const FULL: [[usize; 3]; 8] = [
    [100, 500, 1],
    [25, 500, 1],
    [50, 500, 1],
    [200, 500, 1],
    [400, 500, 1],
    [100, 125, 1],
    [100, 2000, 1],
    [100, 500, 8],
];

const INTRODUCTION: &str = "The derivative of a height at the end of a run in `newton`: with all steps kept, backwards in time \
    with respect to the first state and what is held, and with respect to every joint, segment and load besides; and forwards, \
    along one direction. With checkpoints, one each square root of the steps, the steps between them are taken once more on the way \
    back. Rods that do not touch go back on all threads. The run itself is solved to 1e-10, as derivatives need it.";

impl Section for Gradients {
    type Key = GradientKey;
    type Value = Costs;
    const ID: &'static str = "gradients";

    fn keys(&self, context: &Context) -> Result<Vec<GradientKey>> {
        let turns = context.size.pick(1, 5);
        let sizes = context.size.pick(&QUICK[..], &FULL[..]);
        Ok(sizes.iter().map(|&[segments, steps, rods]| GradientKey { segments, steps, rods, turns }).collect())
    }

    fn seconds(&self, key: &GradientKey) -> f64 {
        2e-5 * (key.segments * key.steps * key.rods * key.turns) as f64
    }

    fn measure(&mut self, _: &Context, key: &GradientKey, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Costs>> {
        let helix = Parameters::Helix(Helix { segments: key.segments, ..Helix::default() });
        Ok(gradients::measure(&gradients::beside(&helix.scene()?, key.rods), key.steps, key.turns, go_on)?)
    }

    fn show(&self, context: &Context, cells: &[(&GradientKey, &Costs)]) -> Result<PageSection> {
        let turns = cells.first().map_or(0, |(key, _)| key.turns);
        let conditions = context
            .without_networks("as the columns say; backwards without the run that is kept")
            .with("scene", "the paper's helix, of so many segments")
            .with("repetitions", format!("{turns}, in turns; the least time of each"));
        let middle = cells.first().map(|(key, _)| *key);
        let over = |x: fn(&GradientKey) -> usize, fixed: fn(&GradientKey) -> usize| {
            let is_own =
                |key: &GradientKey| middle.is_some_and(|middle| fixed(key) == fixed(middle) && key.rods == middle.rods);
            let mut own: Vec<_> =
                cells.iter().filter(|(key, _)| is_own(key)).map(|&(key, costs)| (x(key), costs)).collect();
            own.sort_by_key(|(place, _)| *place);
            own
        };
        let over_segments = over(|key| key.segments, |key| key.steps);
        let over_steps = over(|key| key.steps, |key| key.segments);
        let figure = figure(
            [
                "gradients-ratio",
                "Time of a derivative, to that of the run",
                "The run with its steps kept is one of the curves.",
            ],
            vec![ratios("segments", &over_segments), ratios("steps", &over_steps)],
            conditions.clone(),
        );
        let table = table(
            ["gradients-cost", "Time of a derivative", "Beside each time its ratio to that of the run."],
            "#segments | #steps | #rods | #run [ms] | #run, kept [ms] | #back: start and grips [ms] | #ratio | #back: everything [ms] | \
             #ratio | #the same, with checkpoints [ms] | #ratio | #run with one direction forwards [ms] | #ratio",
            cells.iter().map(|(key, costs)| row(key, costs)).collect(),
            conditions,
        );
        Ok(section([Self::ID, "Derivatives of runs", INTRODUCTION], vec![figure, table]))
    }
}

/// A time of several [ms].
type Time = fn(&Costs) -> f64;

/// What is drawn, by name.
const CURVES: [(&str, Time); 5] = [
    ("the run, kept", |costs| costs.recording_ms),
    ("back: start and grips", |costs| costs.backward_ms),
    ("back: everything", |costs| costs.backward_all_ms),
    ("back: everything, with checkpoints", |costs| costs.checkpoints_ms),
    ("forwards, one direction", |costs| costs.forward_ms),
];

fn ratios(over: &str, own: &[(usize, &Costs)]) -> LineChart {
    let series = CURVES.iter().map(|(name, of)| {
        Series::new(*name, own.iter().map(|(place, costs)| (*place as f64, of(costs) / costs.run_ms)))
    });
    chart(&format!("over {over}"), [Axis::log(over), Axis::log("time, to the run")], series.collect(), Vec::new())
}

fn row(key: &GradientKey, costs: &Costs) -> Vec<Cell> {
    let ratio = |ms: f64| number(ms / costs.run_ms);
    let sizes = [key.segments, key.steps, key.rods].map(|count| count.to_string());
    let plain = [costs.run_ms, costs.recording_ms].map(number);
    let beside = [costs.backward_ms, costs.backward_all_ms, costs.checkpoints_ms, costs.forward_ms]
        .map(|ms| [number(ms), ratio(ms)]);
    sizes.into_iter().chain(plain).chain(beside.into_iter().flatten()).map(Cell::from).collect()
}
