//! How error against run time over the time step is shown.

use evaluation::precision::pareto::{Line, Place, fastest};
use report::{Axis, Block, Cell, Point as Mark, Reference, Section, Series};

use super::key::{TimeStepKey, Value};
use crate::blocks::{self, figure, table};
use crate::context::Context;
use crate::show::{number, per_cent};

const INTRODUCTION: &str = "Each scene with each formulation and integrator at their default tolerances, from four times the \
    scene's time step to an eighth of it. Errors are those of the time step and of the tolerances: against theory, or the \
    largest of eight samples against a refined run with the same segments. Steps that were not solved within their tolerances \
    count for nothing; the tables say how many levels that leaves out. Lower and further left is better.";

/// Errors at which ways are compared.
const ERRORS: [f64; 4] = [1e-1, 1e-2, 1e-3, 1e-4];

/// The cells of one scene.
type Cells<'a> = [(&'a TimeStepKey, &'a Value)];

pub(super) fn section(context: &Context, cells: &Cells<'_>) -> Section {
    let scenes: Vec<&Cells<'_>> = cells.chunk_by(|(key, _), (next, _)| key.scene == next.scene).collect();
    let rows: Vec<Row<'_>> = scenes.iter().flat_map(|own| rows(own)).collect();
    let mut blocks = vec![Block::Paragraph(in_short(&rows)), overview(context, &rows), levels(context, cells)];
    blocks.extend(scenes.iter().map(|own| charts(context, own)));
    blocks::section(["time-step", "Error against run time, by formulation and integrator", INTRODUCTION], blocks)
}

/// The line of a way for the `k`-th error, of the levels that were solved.
fn line((key, value): (&TimeStepKey, &Value), k: usize) -> Line {
    let solved = value.points.iter().filter(|point| point.is_solved);
    let place =
        |point: &evaluation::time_step::Point| Some(Place { error: *point.errors.get(k)?, time: point.time?.median });
    Line { way: key.way(), kind: String::new(), places: solved.filter_map(place).collect() }
}

/// The default beside the fastest way at an error.
struct Row<'a> {
    scene: &'a str,
    quantity: &'a str,
    error: f64,
    fastest: String,
    /// Time of the fastest [s/s].
    time: f64,
    /// Time of the default over it; `None` where it does not reach the error.
    ratio: Option<f64>,
}

fn rows<'a>(own: &Cells<'a>) -> Vec<Row<'a>> {
    let (key, value) = own[0];
    let mut rows = Vec::new();
    for (k, quantity) in value.errors.iter().enumerate() {
        let lines: Vec<Line> = own.iter().map(|cell| line(*cell, k)).collect();
        let default = own.iter().find(|(key, _)| key.is_default()).map(|(key, _)| key.way());
        for error in ERRORS {
            let Some((best, time)) = fastest(&lines, error, |_| true) else { continue };
            let default = fastest(&lines, error, |line| Some(&line.way) == default.as_ref());
            let ratio = default.map(|(_, own)| own / time);
            rows.push(Row { scene: &key.scene, quantity, error, fastest: best.way.clone(), time, ratio });
        }
    }
    rows
}

fn in_short(rows: &[Row<'_>]) -> String {
    let within = |bar: f64| rows.iter().filter(|row| row.ratio.is_some_and(|ratio| ratio <= bar)).count();
    let none = rows.iter().filter(|row| row.ratio.is_none()).count();
    format!(
        "**In short**, at equal error the default (formulation `newton`, integrator `bdf2`) is the fastest of the four ways in {} of {} \
         comparisons, within 1.25 times the fastest in {}, and does not reach the error in {none}.",
        within(1.0),
        rows.len(),
        within(1.25)
    )
}

fn overview(context: &Context, rows: &[Row<'_>]) -> Block {
    let row = |row: &Row<'_>| {
        let ratio = match row.ratio {
            Some(ratio) if ratio <= 1.0 => Cell::strong(number(ratio)),
            Some(ratio) => number(ratio).into(),
            None => Cell::muted("not reached"),
        };
        let texts = [row.scene, row.quantity].map(Cell::from);
        let rest =
            [format!("{:e}", row.error).into(), row.fastest.as_str().into(), number(1e3 * row.time).into(), ratio];
        texts.into_iter().chain(rest).collect()
    };
    let head = [
        "time-step-overview",
        "The default beside the fastest way at equal error",
        "Time of the default over that of the fastest; bold where it is the fastest itself. Between two levels times lie on the \
         straight line in the logarithms of both.",
    ];
    let headings = "scene | error of | #error | fastest | #its time [ms/s] | #default, to it";
    table(head, headings, rows.iter().map(row).collect(), conditions(context))
}

/// Every level.
fn levels(context: &Context, cells: &Cells<'_>) -> Block {
    let mut rows = Vec::new();
    for (key, value) in cells {
        for point in &value.points {
            let errors: Vec<String> = point.errors.iter().map(|&error| number(error)).collect();
            let status =
                if point.is_solved { point.status.as_str().into() } else { Cell::strong(point.status.as_str()) };
            let time = point.time.map_or("-".to_owned(), |time| number(1e3 * time.median));
            rows.push(vec![
                key.scene.as_str().into(),
                key.way().into(),
                number(point.dt).into(),
                number(point.iterations).into(),
                time.into(),
                errors.first().cloned().unwrap_or_default().into(),
                errors.get(1).cloned().unwrap_or("-".to_owned()).into(),
                status,
            ]);
        }
    }
    let unsolved = cells.iter().flat_map(|(_, value)| &value.points).filter(|point| !point.is_solved).count();
    let caption = format!(
        "The first error is that against theory, or of positions; the second that of forces. {unsolved} of {} levels ({}) have \
         steps that were not solved.",
        rows.len(),
        per_cent(unsolved as f64 / rows.len().max(1) as f64)
    );
    let headings =
        "scene | formulation, integrator | #time step [s] | #iterations | #time [ms/s] | #error | #of forces | status";
    table(["time-step-levels", "Every level", &caption], headings, rows, conditions(context))
}

fn charts(context: &Context, own: &Cells<'_>) -> Block {
    let (key, value) = own[0];
    let mut charts = Vec::new();
    for (k, quantity) in value.errors.iter().enumerate() {
        let series = own.iter().map(|cell| {
            let mut places = line(*cell, k).places;
            places.sort_by(|a, b| a.time.total_cmp(&b.time));
            let points = places.iter().map(|place| Mark { x: 1e3 * place.time, y: place.error, ..Mark::default() });
            let name = format!("{}{}", cell.0.way(), if cell.0.is_default() { " (default)" } else { "" });
            Series { dashed: !cell.0.is_default(), ..Series::new(name, points) }
        });
        let floor = value.floor.get(k).filter(|&&floor| floor > 0.0);
        let floor = floor.map(|&y| Reference::Horizontal { y, label: "the refined run's own error".to_owned() });
        let axes = [Axis::log("wall time per simulated second [ms]"), Axis::log("error")];
        charts.push(blocks::chart(quantity, axes, series.collect(), floor.into_iter().collect()));
    }
    let title = format!("{}: error against run time", key.scene);
    let steps = key.steps.map_or(String::new(), |steps| format!("{steps} steps of the scene's dt; "));
    let conditions = conditions(context).with("against", format!("{steps}{}", value.right));
    figure([&format!("time-step-{}", key.scene), &title, ""], charts, conditions)
}

fn conditions(context: &Context) -> report::Conditions {
    context.without_networks(
        "all stages of a step, medians of three runs (one where a run takes long); setting up left out",
    )
}
