//! The supplement's knot: pulled tight by a solver, from a guess, and by predictions alone.

use std::collections::BTreeMap;

use anyhow::Result;
use cosserat::scene;
use evaluation::knot::determinant;
use evaluation::paper::DIRECT;
use evaluation::paper::motions::Trace;
use nalgebra::Vector3;
use report::{Cell, LineChart, Section as PageSection, Series};
use serde::{Deserialize, Serialize};

use crate::blocks::{figure, section, table};
use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{BLOCK_JACOBI, is_end_to_end, solver, traces};
use crate::show::{number, picture};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct KnotKey {
    steps: usize,
    frames: Vec<usize>,
}

pub(crate) struct Knot;

const INTRODUCTION: &str = "The supplement's knot: the ends of a loosely knotted rope are pulled apart. The paper draws the \
    motion of its network end to end (red) over vanilla position-based dynamics (blue).";

impl Section for Knot {
    type Key = KnotKey;
    type Value = Vec<Trace>;
    const ID: &'static str = "knot";

    fn keys(&self, context: &Context) -> Result<Vec<KnotKey>> {
        let (steps, every) = context.size.pick((40, 20), (480, 96));
        Ok(vec![KnotKey { steps, frames: (0..=steps).step_by(every).collect() }])
    }

    fn seconds(&self, key: &KnotKey) -> f64 {
        0.1 * key.steps as f64
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &KnotKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Vec<Trace>>> {
        let scene = scene::builtin("knot")?;
        let guesses = context.library.for_scene(&scene, Learned::Networks)?;
        traces(&scene, &guesses, &solver(BLOCK_JACOBI, 1e-8)?, (key.steps, &key.frames), go_on)
    }

    fn show(&self, context: &Context, cells: &[(&KnotKey, &Vec<Trace>)]) -> Result<PageSection> {
        let mut blocks = Vec::new();
        for (key, traces) in cells {
            let conditions = context
                .conditions("none: positions are compared here")
                .with("scene", format!("knot, {} steps of 0.02 s", key.steps))
                .with("solver", "formulation xpbd; direct, and block-Jacobi conjugate gradients to 1e-8 from guesses");
            let mut kept: Vec<&str> =
                traces.iter().filter(|trace| is_knotted(trace)).map(|trace| trace.name.as_str()).collect();
            if kept.is_empty() {
                kept.push("none");
            }
            let caption = format!(
                "Seen along z. Predictions alone are drawn as long as they are finite. Still a knot at the end: {}.",
                kept.join("; ")
            );
            let charts = key.frames.iter().map(|&step| chart(traces, step)).collect();
            blocks.push(figure(["knot-frames", "A knot is pulled tight", &caption], charts, conditions.clone()));
            blocks.push(table(
                [
                    "knot-ways",
                    "What became of the knot",
                    "The determinant is 3 for a trefoil knot and 1 where nothing is knotted. Distances relative to the rope's \
                     length.",
                ],
                "way | #determinant at the end | #error at the end (NRMSE) | #largest distance of any segment | #first step \
                 not finite",
                traces.iter().map(row).collect(),
                conditions,
            ));
        }
        Ok(section([Self::ID, "The knot", INTRODUCTION], blocks))
    }

    fn claims(&self, _: &Context, cells: &[(&KnotKey, &Vec<Trace>)]) -> Result<BTreeMap<String, String>> {
        let words = |(key, traces): &(&KnotKey, &Vec<Trace>)| {
            let solved = traces.iter().filter(|trace| !is_end_to_end(&trace.name));
            let words = solved.map(|trace| format!("{}: determinant {}", trace.name, determinant_text(trace)));
            format!("after {} steps, {}", key.steps, words.collect::<Vec<_>>().join("; "))
        };
        Ok(cells.iter().map(|cell| ("knot-kept".to_owned(), words(cell))).collect())
    }
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
    picture(format!("step {step}"), ["x [m]", "y [m]"], series.collect())
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
    let last = trace.snapshots.last().filter(|_| trace.stopped.is_none())?;
    Some(determinant(&last.rods.concat().into_iter().map(Vector3::from).collect::<Vec<_>>()))
}

fn determinant_text(trace: &Trace) -> String {
    last_determinant(trace).map_or("-".to_owned(), number)
}

/// Whether it is a trefoil knot at the end, to the rounding errors of its determinant.
fn is_knotted(trace: &Trace) -> bool {
    last_determinant(trace).is_some_and(|determinant| (determinant - 3.0).abs() < 0.1)
}
