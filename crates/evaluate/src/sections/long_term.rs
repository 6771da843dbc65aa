//! The paper's figure on long-term stability: the rod's length, end to end against a guess in the solver.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::paper::motions::{Deviation, Trace, deviations};
use report::{Axis, Block, Cell, Charts, Figure, LineChart, Section as PageSection, Series, Table};
use scene::sampling::{Parameters, Rod};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{is_end_to_end, solver, traces};
use crate::show::{columns, number, of_way};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    modulus: f64,
    steps: usize,
}

pub(crate) struct LongTerm;

/// Young's moduli [Pa]: Table 1's range.
const MODULI: [f64; 5] = [1e4, 3e4, 1e5, 3e5, 1e6];
/// Steps of a full run: forty times the training data.
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
    type Key = Key;
    type Value = Vec<Trace>;
    const ID: &'static str = "long-term";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let steps = context.size.pick(200, STEPS);
        let moduli = context.size.pick(&MODULI[2..3], &MODULI[..]);
        Ok(moduli.iter().map(|&modulus| Key { modulus, steps }).collect())
    }

    fn seconds(&self, key: &Key) -> f64 {
        0.003 * key.steps as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Trace>>> {
        let guesses = context.library.guesses(Scenario::Rod, Learned::Networks)?;
        let solver = solver(PreconditionerKind::Raw, 1e-4);
        traces(&rod(key.modulus).scene()?, &guesses, &solver, (key.steps, &[]), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<PageSection> {
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
        if let Some((key, _)) = cells.first() {
            let conditions = context
                .conditions("none: lengths are measured here")
                .with("scene", format!("the paper's rod, 30 segments, 4 m, level; {} steps of 0.02 s", key.steps))
                .with("solver", "formulation xpbd; direct, and raw conjugate gradients to 1e-4 from guesses");
            let charts = cells.iter().map(|(key, traces)| chart(context, key, traces)).collect::<Result<_>>()?;
            blocks.push(Block::Figure(Figure {
                id: "long-term-length".to_owned(),
                title: "Length of a rod over time".to_owned(),
                caption:
                    "Relative change of the length, |l / l0 - 1|. Dashed: predictions alone, end to end; solid: a solver. A \
                     curve that ends early stopped being finite."
                        .to_owned(),
                charts: Charts::Lines(charts),
                conditions: conditions.clone(),
            }));
            blocks.push(Block::Table(Table {
                id: "long-term-worst".to_owned(),
                title: "The worst of all moduli".to_owned(),
                caption: "A rod has failed when its length has changed by more than one per cent.".to_owned(),
                columns: columns(&[
                    "way",
                    "#largest change of length",
                    "#largest gap [segment lengths]",
                    "#failed",
                    "#first step beyond 1 %",
                    "#first step not finite",
                ]),
                rows: worst(cells).iter().map(row).collect(),
                conditions,
            }));
        }
        Ok(PageSection { id: Self::ID.to_owned(), title: "Long-term stability".to_owned(), blocks })
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        let worst = worst(cells);
        let of = |end_to_end: bool| {
            let own = worst.iter().filter(|way| way.name.starts_with("gn") && is_end_to_end(&way.name) == end_to_end);
            let words = own.map(|way| format!("{} {}", way.name, number(way.length_change)));
            format!("largest |l / l0 - 1|: {}", words.collect::<Vec<_>>().join("; "))
        };
        let claims = [("stability-end-to-end", of(true)), ("stability-guess", of(false))];
        Ok(claims.map(|(id, words)| (id.to_owned(), words)).into())
    }
}

fn worst(cells: &[(&Key, &Vec<Trace>)]) -> Vec<Deviation> {
    deviations(&cells.iter().map(|(_, traces)| *traces).collect::<Vec<_>>())
}

fn chart(context: &Context, key: &Key, traces: &[Trace]) -> Result<LineChart> {
    let every = key.steps.div_ceil(POINTS).max(1);
    let series = traces.iter().map(|trace| {
        let changes = trace.lengths.iter().enumerate().step_by(every);
        of_way(Series::new(&trace.name, changes.map(|(step, ratio)| (step as f64, (ratio - 1.0).abs()))))
    });
    Ok(LineChart {
        title: format!("Y = {} Pa", number(key.modulus)),
        x: Axis::linear("step"),
        // Predictions alone may run away as far as numbers go.
        y: Axis { range: Some([1e-10, 1e3]), ..Axis::log("|l / l0 - 1|") },
        series: series.collect(),
        references: vec![context.library.training_end(Scenario::Rod)?],
        ..LineChart::default()
    })
}

fn row(way: &Deviation) -> Vec<Cell> {
    let first = |steps: &[usize]| steps.iter().min().map_or(Cell::muted("never"), |step| step.to_string().into());
    vec![
        way.name.as_str().into(),
        number(way.length_change).into(),
        number(way.largest_gap).into(),
        format!("{} of {}", way.failed, way.scenes).into(),
        first(&way.left_limit),
        first(&way.stopped),
    ]
}
