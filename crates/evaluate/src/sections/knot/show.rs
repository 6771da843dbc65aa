//! Pictures of the knot, and whether it is still one at the end.

use std::collections::BTreeMap;

use evaluation::knot::determinant;
use evaluation::paper::DIRECT;
use evaluation::paper::motions::{Snapshot, Trace};
use nalgebra::Vector3;
use report::{Axis, Block, Cell, Charts, Figure, LineChart, Section as PageSection, Series, Table};

use super::{Key, Knot};
use crate::cells::Section as _;
use crate::context::Context;
use crate::sections::paper::is_end_to_end;
use crate::show::{columns, number};

const INTRODUCTION: &str = "The supplement's knot: the ends of a loosely knotted rope are pulled apart. The paper draws the \
    motion of its network end to end (red) over vanilla position-based dynamics (blue).";

pub(super) fn section(context: &Context, cells: &[(&Key, &Vec<Trace>)]) -> PageSection {
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
    for (key, traces) in cells {
        let conditions = context
            .conditions("none: positions are compared here")
            .with("scene", format!("knot, {} steps of 0.02 s", key.steps))
            .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-8 from guesses");
        let kept: Vec<&str> =
            traces.iter().filter(|trace| is_knotted(trace)).map(|trace| trace.name.as_str()).collect();
        blocks.push(Block::Figure(Figure {
            id: "knot-frames".to_owned(),
            title: "A knot is pulled tight".to_owned(),
            caption: format!(
                "Seen along z. Predictions alone are drawn as long as they are finite. Still a knot at the end: {}.",
                if kept.is_empty() { "none".to_owned() } else { kept.join("; ") }
            ),
            charts: Charts::Lines(key.frames.iter().map(|&step| chart(traces, step)).collect()),
            conditions: conditions.clone(),
        }));
        blocks.push(Block::Table(Table {
            id: "knot-ways".to_owned(),
            title: "What became of the knot".to_owned(),
            caption: "The determinant is 3 for a trefoil knot and 1 where nothing is knotted. Distances relative to the rope's \
                      length."
                .to_owned(),
            columns: columns(&["way", "#determinant at the end", "#error at the end (NRMSE)", "#largest distance of any segment", "#first step not finite"]),
            rows: traces.iter().map(row).collect(),
            conditions,
        }));
    }
    PageSection { id: Knot::ID.to_owned(), title: "The knot".to_owned(), blocks }
}

pub(super) fn claims(cells: &[(&Key, &Vec<Trace>)]) -> BTreeMap<String, String> {
    let words = |(key, traces): &(&Key, &Vec<Trace>)| {
        let solved = traces.iter().filter(|trace| !is_end_to_end(&trace.name));
        let words = solved.map(|trace| format!("{}: determinant {}", trace.name, determinant_text(trace)));
        format!("after {} steps, {}", key.steps, words.collect::<Vec<_>>().join("; "))
    };
    cells.iter().map(|cell| ("knot-kept".to_owned(), words(cell))).collect()
}

fn chart(traces: &[Trace], step: usize) -> LineChart {
    let shown = traces.iter().filter(|trace| trace.name == DIRECT || trace.name == "gn, end to end");
    let series = shown.flat_map(|trace| {
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
        equal_units: true,
        ..LineChart::default()
    }
}

fn row(trace: &Trace) -> Vec<Cell> {
    vec![
        trace.name.as_str().into(),
        determinant_text(trace).into(),
        trace.nrmse.last().map_or(Cell::muted("-"), |error| number(*error).into()),
        number(trace.distance).into(),
        trace.stopped.map_or(Cell::muted("never"), |step| step.to_string().into()),
    ]
}

/// The knot's determinant in the last frame; `None` where the way did not get there.
fn last_determinant(trace: &Trace) -> Option<f64> {
    let of = |snapshot: &Snapshot| {
        let nodes: Vec<Vector3<f64>> = snapshot.rods.iter().flatten().map(|&x| Vector3::from(x)).collect();
        determinant(&nodes)
    };
    trace.snapshots.last().filter(|_| trace.stopped.is_none()).map(of)
}

fn determinant_text(trace: &Trace) -> String {
    last_determinant(trace).map_or("-".to_owned(), number)
}

/// Whether it is a trefoil knot at the end, to the rounding errors of its determinant.
fn is_knotted(trace: &Trace) -> bool {
    last_determinant(trace).is_some_and(|determinant| (determinant - 3.0).abs() < 0.1)
}
