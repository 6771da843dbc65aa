//! The paper's figure on long-term stability: the rod's length, end to end against a guess in the solver.

use std::collections::BTreeMap;

use anyhow::Result;
use cosserat::scene::sampling::{Parameters, Rod};
use dataset::Scenario;
use evaluation::paper::motions::{Trace, by_way, largest};
use report::{Axis, Cell, LineChart, Section as PageSection, Series};
use serde::{Deserialize, Serialize};

use crate::blocks::{chart, figure, section, table, values};
use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{RAW, is_end_to_end, solver, traces};
use crate::show::{number, of_way};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct LongTermKey {
    modulus: f64,
    steps: usize,
}

pub(crate) struct LongTerm;

/// Young's moduli [Pa]: Table 1's range.
const MODULI: [f64; 5] = [1e4, 3e4, 1e5, 3e5, 1e6];
/// Steps of a full run: forty times those of the paper's training data.
const STEPS: usize = 2000;
/// About so many points of a curve are drawn.
const POINTS: usize = 200;

/// The figure's rod with this Young's modulus [Pa].
pub(crate) fn rod(youngs_modulus: f64) -> Parameters {
    Parameters::Rod(Rod { youngs_modulus, ..Rod::default() })
}

const INTRODUCTION: &str = "The paper's figure on long-term stability: the length of a rod where predictions take the place of \
    the constraint projection (end to end), and where they are a guess inside the solver. The paper sees the error of the \
    first grow exponentially beyond the 50 steps of its training data, and none of the second.";

impl Section for LongTerm {
    type Key = LongTermKey;
    type Value = Vec<Trace>;
    const ID: &'static str = "long-term";

    fn keys(&self, context: &Context) -> Result<Vec<LongTermKey>> {
        let steps = context.size.pick(200, STEPS);
        let moduli = context.size.pick(&MODULI[2..3], &MODULI[..]);
        Ok(moduli.iter().map(|&modulus| LongTermKey { modulus, steps }).collect())
    }

    fn seconds(&self, key: &LongTermKey) -> f64 {
        0.003 * key.steps as f64
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &LongTermKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Vec<Trace>>> {
        let guesses = context.library.guesses(Scenario::Rod, Learned::Networks)?;
        traces(&rod(key.modulus).scene()?, &guesses, &solver(RAW, 1e-4)?, (key.steps, &[]), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&LongTermKey, &Vec<Trace>)]) -> Result<PageSection> {
        let steps = cells.first().map_or(0, |(key, _)| key.steps);
        let conditions = context
            .conditions("none: lengths are measured here")
            .with("scene", format!("the paper's rod, 30 segments, 4 m, level; {steps} steps of 0.02 s"))
            .with("solver", "formulation xpbd; direct, and raw conjugate gradients to 1e-4 from guesses");
        let charts = cells.iter().map(|(key, traces)| lengths(context, key, traces)).collect::<Result<_>>()?;
        let length = figure(
            [
                "long-term-length",
                "Length of a rod over time",
                "Relative change of the length, |l / l0 - 1|. Dashed: predictions alone, end to end; solid: a solver. A \
                 curve that ends early stopped being finite.",
            ],
            charts,
            conditions.clone(),
        );
        let worst = table(
            [
                "long-term-worst",
                "The worst of all moduli",
                "A rod has failed when its length has changed by more than one per cent.",
            ],
            "way | #largest change of length | #largest gap [segment lengths] | #failed | #first step beyond 1 % | \
             #first step not finite",
            by_way(&values(cells)).iter().map(|way| row(way)).collect(),
            conditions,
        );
        Ok(section([Self::ID, "Long-term stability", INTRODUCTION], vec![length, worst]))
    }

    fn claims(&self, _: &Context, cells: &[(&LongTermKey, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        let ways = by_way(&values(cells));
        let claim = |(id, end_to_end): (&str, bool)| {
            let is_own = |name: &str| name.starts_with("gn") && is_end_to_end(name) == end_to_end;
            let own = ways.iter().filter(|way| is_own(&way[0].name));
            let words = own.map(|way| format!("{} {}", way[0].name, number(largest(way, length_change))));
            (id.to_owned(), format!("largest |l / l0 - 1|: {}", words.collect::<Vec<_>>().join("; ")))
        };
        Ok([("stability-end-to-end", true), ("stability-guess", false)].map(claim).into())
    }
}

/// The largest relative change of the length.
fn length_change(trace: &Trace) -> f64 {
    trace.length_changes().fold(0.0, f64::max)
}

fn lengths(context: &Context, key: &LongTermKey, traces: &[Trace]) -> Result<LineChart> {
    let every = key.steps.div_ceil(POINTS).max(1);
    let series = traces.iter().map(|trace| {
        let changes = trace.length_changes().enumerate().step_by(every);
        of_way(Series::new(&trace.name, changes.map(|(step, change)| (step as f64, change))))
    });
    // Predictions alone may run away as far as numbers go.
    let y = Axis { range: Some([1e-10, 1e3]), ..Axis::log("|l / l0 - 1|") };
    let title = format!("Y = {} Pa", number(key.modulus));
    let trained = context.library.training_end(Scenario::Rod)?;
    Ok(chart(&title, [Axis::linear("step"), y], series.collect(), vec![trained]))
}

fn row(way: &[&Trace]) -> Vec<Cell> {
    let first = |step: fn(&Trace) -> Option<usize>| {
        let first = way.iter().filter_map(|trace| step(trace)).min();
        first.map_or(Cell::muted("never"), |step| step.to_string().into())
    };
    let failed = way.iter().filter(|trace| trace.left_limit().or(trace.stopped).is_some()).count();
    vec![
        way[0].name.as_str().into(),
        number(largest(way, length_change)).into(),
        number(largest(way, |trace| trace.largest_gap)).into(),
        format!("{failed} of {}", way.len()).into(),
        first(Trace::left_limit),
        first(|trace| trace.stopped),
    ]
}
