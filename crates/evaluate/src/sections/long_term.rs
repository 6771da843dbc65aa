//! The paper's figure on long-term stability: the rod's length, end to end against a guess in the solver.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::paper::stability::{self, Curve, Worst};
use report::{
    Axis, Block, Cell, Charts, Column, Figure, LineChart, LineStyle, Reference, Section as PageSection, Series, Table,
};
use scene::sampling::{Parameters, Rod};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{motion, solver, with_predictions};
use crate::show::number;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    modulus: f64,
    steps: usize,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    curves: Vec<Curve>,
}

pub(crate) struct LongTerm;

/// Frames of the training data.
const TRAINED: f64 = 50.0;
/// Young's moduli [Pa]: Table 1's range.
const MODULI: [f64; 5] = [1e4, 3e4, 1e5, 3e5, 1e6];

impl Section for LongTerm {
    type Key = Key;
    type Value = Value;
    const ID: &'static str = "long-term";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let steps = context.size.pick(200, stability::STEPS);
        let moduli = context.size.pick(&MODULI[2..3], &MODULI[..]);
        Ok(moduli.iter().map(|&modulus| Key { modulus, steps }).collect())
    }

    fn seconds(&self, key: &Key) -> f64 {
        0.003 * key.steps as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        let guesses = context.library.guesses(Scenario::Rod, Learned::Networks)?;
        // The paper's: 30 segments, 4 m, level.
        let scene = Parameters::Rod(Rod { youngs_modulus: key.modulus, ..Rod::default() }).scene()?;
        let curves = with_predictions(&scene, &guesses, &paper_solver(), |ways| {
            stability::measure(&motion(&scene, key.steps), ways, go_on)
        })?;
        Ok(curves.map(|curves| Value { curves }))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Value)]) -> Result<PageSection> {
        let Some((key, _)) = cells.first() else { return Ok(page(Vec::new())) };
        let conditions = context
            .conditions("none: lengths are measured here")
            .with("scene", format!("the paper's rod, 30 segments, 4 m, level; {} steps of 0.02 s", key.steps))
            .with("solver", "formulation xpbd; direct, and raw conjugate gradients to 1e-4 from guesses");
        let figure = Figure {
            id: "long-term-length".to_owned(),
            title: "Length of a rod over time".to_owned(),
            caption: "Relative change of the length, |l / l0 - 1|. Dashed: predictions alone, end to end; solid: a solver. A \
                      curve that ends early stopped being finite."
                .to_owned(),
            charts: Charts::Lines(cells.iter().map(|(key, value)| chart(key, value)).collect()),
            conditions: conditions.clone(),
        };
        let all: Vec<_> = cells.iter().map(|(_, value)| value.curves.clone()).collect();
        let table = table(&stability::worst(&all), cells.len(), conditions);
        Ok(page(vec![Block::Paragraph(INTRODUCTION.to_owned()), Block::Figure(figure), Block::Table(table)]))
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Value)]) -> Result<BTreeMap<String, String>> {
        let all: Vec<_> = cells.iter().map(|(_, value)| value.curves.clone()).collect();
        let worst = stability::worst(&all);
        let of = |is: &dyn Fn(&str) -> bool| {
            let own = worst.iter().filter(|way| is(&way.name));
            own.map(|way| format!("{} {}", way.name, number(way.largest_change))).collect::<Vec<_>>().join("; ")
        };
        let end_to_end = of(&|name| name.starts_with("gn") && name.ends_with("end to end"));
        let guess = of(&|name| name.starts_with("gn") && !name.ends_with("end to end"));
        let words = |what: String| format!("largest |l / l0 - 1|: {what}");
        Ok([("stability-end-to-end", end_to_end), ("stability-guess", guess)]
            .map(|(id, what)| (id.to_owned(), words(what)))
            .into())
    }
}

fn page(blocks: Vec<Block>) -> PageSection {
    PageSection { id: LongTerm::ID.to_owned(), title: "Long-term stability".to_owned(), blocks }
}

fn paper_solver() -> evaluation::paper::CgSolver {
    solver(PreconditionerKind::Raw, 1e-4)
}

const INTRODUCTION: &str = "The paper's figure on long-term stability: where predictions take the place of the constraint \
    projection (end to end), errors gather and the rod's length changes; where they are a guess inside the solver, it does \
    not. The paper sees the error grow exponentially beyond the 50 steps of its training data.";

fn chart(key: &Key, value: &Value) -> LineChart {
    let series = value.curves.iter().map(|curve| {
        let points = curve.steps.iter().zip(&curve.ratios).map(|(&step, &ratio)| (step as f64, (ratio - 1.0).abs()));
        let style = if curve.name.ends_with("end to end") { LineStyle::Dashed } else { LineStyle::Solid };
        Series { style, markers: false, ..Series::new(curve.name.clone(), points) }
    });
    LineChart {
        title: format!("Y = {} Pa", number(key.modulus)),
        x: Axis::linear("step"),
        // Predictions alone may run away as far as numbers go.
        y: Axis { range: Some([1e-10, 1e3]), ..Axis::log("|l / l0 - 1|") },
        series: series.collect(),
        references: vec![Reference::Vertical { x: TRAINED, label: "training data end".to_owned() }],
        ..LineChart::default()
    }
}

fn table(worst: &[Worst], scenes: usize, conditions: report::Conditions) -> Table {
    let step = |step: Option<usize>| step.map_or(Cell::muted("never"), |step| step.to_string().into());
    let row = |way: &Worst| {
        vec![
            way.name.as_str().into(),
            number(way.largest_change).into(),
            number(way.largest_gap).into(),
            format!("{} of {scenes}", way.failed).into(),
            step(way.left_limit),
            step(way.stopped),
        ]
    };
    Table {
        id: "long-term-worst".to_owned(),
        title: "The worst of all moduli".to_owned(),
        caption: "A rod has failed when its length has changed by more than one per cent.".to_owned(),
        columns: vec![
            Column::text("way"),
            Column::number("largest change of length"),
            Column::number("largest gap [segment lengths]"),
            Column::number("failed"),
            Column::number("first step beyond 1 %"),
            Column::number("first step not finite"),
        ],
        rows: worst.iter().map(row).collect(),
        conditions,
    }
}
