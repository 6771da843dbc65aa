//! The charts of the figure on long-term stability, and what they say to the paper's claims.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::paper::stability::{self, Curve, Worst};
use report::{Axis, Block, Cell, Charts, Figure, LineChart, Section as PageSection, Series, Table};

use super::{Key, LongTerm};
use crate::cells::Section as _;
use crate::context::Context;
use crate::sections::paper::is_end_to_end;
use crate::show::{columns, number, of_way};

const INTRODUCTION: &str = "The paper's figure on long-term stability: the length of a rod where predictions take the place of \
    the constraint projection (end to end), and where they are a guess inside the solver. The paper sees the error of the \
    first grow exponentially beyond the 50 steps of its training data, and none of the second.";

pub(super) fn section(context: &Context, cells: &[(&Key, &Vec<Curve>)]) -> Result<PageSection> {
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
    if let Some((key, _)) = cells.first() {
        let conditions = context
            .conditions("none: lengths are measured here")
            .with("scene", format!("the paper's rod, 30 segments, 4 m, level; {} steps of 0.02 s", key.steps))
            .with("solver", "formulation xpbd; direct, and raw conjugate gradients to 1e-4 from guesses");
        let trained = context.library.training_end(Scenario::Rod)?;
        let chart = |(key, curves): &(&Key, &Vec<Curve>)| {
            let series = curves.iter().map(|curve| {
                let change = |(&step, ratio): (&usize, &f64)| (step as f64, (ratio - 1.0).abs());
                of_way(Series::new(&curve.name, curve.steps.iter().zip(&curve.ratios).map(change)))
            });
            LineChart {
                title: format!("Y = {} Pa", number(key.modulus)),
                x: Axis::linear("step"),
                // Predictions alone may run away as far as numbers go.
                y: Axis { range: Some([1e-10, 1e3]), ..Axis::log("|l / l0 - 1|") },
                series: series.collect(),
                references: vec![trained.clone()],
                ..LineChart::default()
            }
        };
        blocks.push(Block::Figure(Figure {
            id: "long-term-length".to_owned(),
            title: "Length of a rod over time".to_owned(),
            caption: "Relative change of the length, |l / l0 - 1|. Dashed: predictions alone, end to end; solid: a solver. A \
                      curve that ends early stopped being finite."
                .to_owned(),
            charts: Charts::Lines(cells.iter().map(chart).collect()),
            conditions: conditions.clone(),
        }));
        blocks.push(Block::Table(table(&worst(cells), cells.len(), conditions)));
    }
    Ok(PageSection { id: LongTerm::ID.to_owned(), title: "Long-term stability".to_owned(), blocks })
}

pub(super) fn claims(cells: &[(&Key, &Vec<Curve>)]) -> BTreeMap<String, String> {
    let worst = worst(cells);
    let of = |end_to_end: bool| {
        let own = worst.iter().filter(|way| way.name.starts_with("gn") && is_end_to_end(&way.name) == end_to_end);
        let words = own.map(|way| format!("{} {}", way.name, number(way.largest_change)));
        format!("largest |l / l0 - 1|: {}", words.collect::<Vec<_>>().join("; "))
    };
    [("stability-end-to-end", of(true)), ("stability-guess", of(false))]
        .map(|(id, words)| (id.to_owned(), words))
        .into()
}

fn worst(cells: &[(&Key, &Vec<Curve>)]) -> Vec<Worst> {
    stability::worst(&cells.iter().map(|(_, curves)| curves.to_vec()).collect::<Vec<_>>())
}

const COLUMNS: [&str; 6] = [
    "way",
    "#largest change of length",
    "#largest gap [segment lengths]",
    "#failed",
    "#first step beyond 1 %",
    "#first step not finite",
];

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
        columns: columns(&COLUMNS),
        rows: worst.iter().map(row).collect(),
        conditions,
    }
}
