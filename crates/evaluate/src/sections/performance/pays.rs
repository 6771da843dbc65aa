//! Where a learned guess begins to pay: from which N, stiffness and tolerance on.

use evaluation::guesses::Spread;
use evaluation::paper::performance::Point;
use evaluation::paper::{DIRECT, FISCHER, ZERO};
use report::{Cell, Column, Table};

use super::{Key, Study, name_of, studies};
use crate::context::Context;

/// Rivals, and how they are called.
const RIVALS: [(&str, &str); 3] = [(ZERO, "zero"), (FISCHER, "Fischer"), (DIRECT, "direct")];

/// A row a study, a preconditioner and a learned guess.
pub(super) fn table(context: &Context, cells: &[(&Key, &Point)]) -> Table {
    let mut rows = Vec::new();
    for Study { scenario, axis, preconditioner, cells, .. } in studies(cells) {
        let own: Vec<(f64, &Point)> = cells.iter().map(|(key, point)| (key.varied.value(), *point)).collect();
        for guess in learned(&own) {
            let mut row: Vec<Cell> = [name_of(scenario), axis, preconditioner.name(), guess].map(Cell::from).to_vec();
            for saved in [of_projection, of_whole] {
                row.extend(RIVALS.map(|(rival, _)| places(&own, |point| pays(saved, point, guess, rival))));
            }
            rows.push(row);
        }
    }
    let mut columns = ["scene", "over", "solver", "guess"].map(Column::text).to_vec();
    for part in ["solves", "whole"] {
        columns.extend(RIVALS.map(|(_, rival)| Column::text(format!("{part}, against {rival}"))));
    }
    Table {
        id: "performance-pays".to_owned(),
        title: "Where a learned guess pays".to_owned(),
        caption: "Where the median time with the guess, its own time included, is below that of a rival: of the first \
                  linear solves of the steps, and of whole simulations. Bold: everywhere."
            .to_owned(),
        columns,
        rows,
        conditions: context.conditions("as in the figures below").with("values", "those of the figures, no others"),
    }
}

/// Names of the learned guesses.
fn learned<'a>(points: &[(f64, &'a Point)]) -> Vec<&'a str> {
    let starts = points.first().map_or(&[][..], |(_, point)| &point.starts);
    starts.iter().map(|start| start.name.as_str()).filter(|name| ![ZERO, FISCHER].contains(name)).collect()
}

/// Share of the time of the first solves that a way saves, relative to a zero start.
fn of_projection(point: &Point, way: &str) -> Option<Spread> {
    if way == DIRECT {
        return point.direct_projection;
    }
    point.starts.iter().find(|start| start.name == way)?.projection
}

/// Of the whole simulation's.
fn of_whole(point: &Point, way: &str) -> Option<Spread> {
    point.runs.iter().find(|run| run.name == way)?.total
}

/// Whether a guess saves more than a rival; `None` where one of them was not measured.
fn pays(saved: fn(&Point, &str) -> Option<Spread>, point: &Point, guess: &str, rival: &str) -> Option<bool> {
    let of_rival = if rival == ZERO { 0.0 } else { saved(point, rival)?.median };
    Some(saved(point, guess)?.median > of_rival)
}

/// The values at which something is so, in words: neighbours as ranges.
fn places(points: &[(f64, &Point)], is_so: impl Fn(&Point) -> Option<bool>) -> Cell {
    let known: Vec<(f64, bool)> = points.iter().filter_map(|(value, point)| Some((*value, is_so(point)?))).collect();
    if known.is_empty() {
        return Cell::muted("-");
    }
    if known.iter().all(|&(_, is_so)| is_so) {
        return Cell::strong("everywhere");
    }
    let ranges = known.chunk_by(|a, b| a.1 == b.1).filter(|range| range[0].1).map(|range| match range {
        [(one, _)] => short(*one),
        [(first, _), .., (last, _)] => format!("{} to {}", short(*first), short(*last)),
        [] => String::new(),
    });
    let text = ranges.collect::<Vec<_>>().join(", ");
    if text.is_empty() { Cell::muted("nowhere") } else { text.into() }
}

fn short(value: f64) -> String {
    if (1.0..1000.0).contains(&value) { value.to_string() } else { format!("{value:e}") }
}
