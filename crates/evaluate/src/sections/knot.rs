//! The supplement's knot: pulled tight by a solver, from a guess, and by predictions alone.

use std::collections::BTreeMap;

use anyhow::Result;
use evaluation::knot::determinant;
use evaluation::paper::motions::{self, Snapshot, Trace};
use nalgebra::Vector3;
use report::{Aspect, Axis, Block, Cell, Charts, Column, Figure, LineChart, Section as PageSection, Series, Table};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{motion, solver, with_predictions};
use crate::show::number;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    steps: usize,
    frames: Vec<usize>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    traces: Vec<Trace>,
}

pub(crate) struct Knot;

impl Section for Knot {
    type Key = Key;
    type Value = Value;
    const ID: &'static str = "knot";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let (steps, every) = context.size.pick((40, 20), (480, 96));
        Ok(vec![Key { steps, frames: (0..=steps).step_by(every).collect() }])
    }

    fn seconds(&self, key: &Key) -> f64 {
        0.1 * key.steps as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        let scene = scene::builtin("knot")?;
        let guesses = context.library.for_scene(&scene, Learned::Networks)?;
        let solver = solver(PreconditionerKind::BlockJacobi, 1e-8);
        let traces = with_predictions(&scene, &guesses, &solver, |ways| {
            motions::measure(&motion(&scene, key.steps), &key.frames, ways, go_on)
        })?;
        Ok(traces.map(|traces| Value { traces }))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Value)]) -> Result<PageSection> {
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
        for (key, value) in cells {
            let conditions = context
                .conditions("none: positions are compared here")
                .with("scene", format!("knot, {} steps of 0.02 s", key.steps))
                .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-8 from guesses");
            blocks.push(Block::Figure(Figure {
                id: "knot-frames".to_owned(),
                title: "A knot is pulled tight".to_owned(),
                caption: "Seen along z. The solver's rope keeps its knot; predictions alone are drawn as long as they are finite."
                    .to_owned(),
                charts: Charts::Lines(key.frames.iter().map(|&step| chart(value, step)).collect()),
                conditions: conditions.clone(),
            }));
            blocks.push(Block::Table(Table {
                id: "knot-ways".to_owned(),
                title: "What became of the knot".to_owned(),
                caption: "The determinant is 3 for a trefoil knot and 1 where nothing is knotted. Distances relative to the rope's \
                          length."
                    .to_owned(),
                columns: vec![
                    Column::text("way"),
                    Column::number("determinant at the end"),
                    Column::number("error at the end (NRMSE)"),
                    Column::number("largest distance of any segment"),
                    Column::number("first step not finite"),
                ],
                rows: value.traces.iter().map(row).collect(),
                conditions,
            }));
        }
        Ok(PageSection { id: Self::ID.to_owned(), title: "The knot".to_owned(), blocks })
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Value)]) -> Result<BTreeMap<String, String>> {
        let words = |(key, value): &(&Key, &Value)| {
            let of_way = |trace: &Trace| format!("{}: determinant {}", trace.name, last_determinant(trace));
            let ways = value.traces.iter().filter(|trace| !trace.name.ends_with("end to end")).map(of_way);
            format!("after {} steps, {}", key.steps, ways.collect::<Vec<_>>().join("; "))
        };
        Ok(cells.iter().map(|cell| ("knot-kept".to_owned(), words(cell))).collect())
    }
}

const INTRODUCTION: &str = "The supplement's knot: the ends of a loosely knotted rope are pulled apart. The paper draws the \
    motion of its network end to end (red) over vanilla position-based dynamics (blue).";

fn chart(value: &Value, step: usize) -> LineChart {
    let shown = |trace: &&Trace| trace.name == "direct" || trace.name == "gn, end to end";
    let series = value.traces.iter().filter(shown).flat_map(|trace| {
        let own = trace.snapshots.iter().filter(move |snapshot| snapshot.step == step);
        own.flat_map(|snapshot| &snapshot.rods).map(|rod| {
            let points = rod.iter().map(|[x, y, _]| (*x, *y));
            Series { markers: false, ..Series::new(trace.name.clone(), points) }
        })
    });
    LineChart {
        title: format!("step {step}"),
        x: Axis::linear("x [m]"),
        y: Axis::linear("y [m]"),
        series: series.collect(),
        aspect: Aspect::Equal,
        ..LineChart::default()
    }
}

fn row(trace: &Trace) -> Vec<Cell> {
    vec![
        trace.name.as_str().into(),
        last_determinant(trace).into(),
        trace.nrmse.last().map_or(Cell::muted("-"), |error| number(*error).into()),
        number(trace.distance).into(),
        trace.stopped.map_or(Cell::muted("never"), |step| step.to_string().into()),
    ]
}

/// The determinant in the last frame; a dash where the way did not get there.
fn last_determinant(trace: &Trace) -> String {
    let of = |snapshot: &Snapshot| {
        let nodes: Vec<Vector3<f64>> = snapshot.rods.iter().flatten().map(|&x| Vector3::from(x)).collect();
        number(determinant(&nodes))
    };
    match (trace.snapshots.last(), trace.stopped) {
        (Some(snapshot), None) => of(snapshot),
        _ => "-".to_owned(),
    }
}
