//! Where a learned guess begins to pay: from which N, stiffness and tolerance on.

use evaluation::guesses::Spread;
use evaluation::paper::performance::Point;
use evaluation::paper::{DIRECT, FISCHER, ZERO};
use report::{Cell, Column, Table};

use super::Key;
use super::show::{Study, name_of, of_projection, of_whole, studies};
use crate::context::Context;

/// Rivals, and how they are called.
const RIVALS: [(&str, &str); 3] = [(ZERO, "zero"), (FISCHER, "Fischer"), (DIRECT, "direct")];

/// A row a study, a preconditioner and a learned guess.
pub(super) fn table(context: &Context, cells: &[(&Key, &Point)]) -> Table {
    let mut rows = Vec::new();
    for Study { scenario, axis, preconditioner, cells, .. } in studies(cells) {
        let starts = cells.first().map_or(&[][..], |(_, point)| &point.starts);
        for guess in
            starts.iter().map(|start| start.name.as_str()).filter(|name| ![ZERO, FISCHER, DIRECT].contains(name))
        {
            let mut row: Vec<Cell> = [name_of(scenario), axis, preconditioner.name(), guess].map(Cell::from).to_vec();
            for saved in [of_projection, of_whole] {
                row.extend(RIVALS.map(|(rival, _)| places(&cells, |point| pays(saved, point, guess, rival))));
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

/// Whether a guess saves more than a rival; `None` where one of them was not measured.
fn pays(saved: fn(&Point, &str) -> Option<Spread>, point: &Point, guess: &str, rival: &str) -> Option<bool> {
    let of_rival = if rival == ZERO { 0.0 } else { saved(point, rival)?.median };
    Some(saved(point, guess)?.median > of_rival)
}

/// The values at which something is so, in words.
fn places(cells: &[(&Key, &Point)], is_so: impl Fn(&Point) -> Option<bool>) -> Cell {
    let known = || cells.iter().filter_map(|(key, point)| Some((key.value, is_so(point)?)));
    match ranges(known()) {
        _ if known().next().is_none() => Cell::muted("-"),
        _ if known().all(|(_, is_so)| is_so) => Cell::strong("everywhere"),
        Some(ranges) => ranges.into(),
        None => Cell::muted("nowhere"),
    }
}

/// The values at which something is so, neighbours as ranges; `None` where there are none.
pub(super) fn ranges(known: impl Iterator<Item = (f64, bool)>) -> Option<String> {
    let known: Vec<(f64, bool)> = known.collect();
    let ranges = known.chunk_by(|a, b| a.1 == b.1).filter(|range| range[0].1).map(|range| match range {
        [(one, _)] => short(*one),
        [(first, _), .., (last, _)] => format!("{} to {}", short(*first), short(*last)),
        [] => String::new(),
    });
    Some(ranges.collect::<Vec<_>>().join(", ")).filter(|text| !text.is_empty())
}

fn short(value: f64) -> String {
    if (1.0..1000.0).contains(&value) { value.to_string() } else { format!("{value:e}") }
}
