//! The tables of the stability report.

use evaluation::stress::{self, CaseRun};
use report::{Block, Cell, Conditions, Section, Table};
use solver::formulation::Formulation;

use super::{DIRECT, Key, Value, ZERO};
use crate::context::Context;
use crate::show::{columns, number};

pub(super) fn section(context: &Context, cells: &[(&Key, &Value)]) -> Section {
    let conditions = tolerances(context.conditions("wall time of all steps"));
    let is_plain = |key: &Key| key.solver == DIRECT && key.start == ZERO;
    let plain: Vec<_> = cells.iter().filter(|(key, _)| is_plain(key)).map(|(_, value)| &value.row).collect();
    let plain = cases_table(&plain, conditions.clone());
    let guessed = cells.iter().filter(|(key, _)| !is_plain(key));
    let learned = Table {
        id: "stability-guesses".to_owned(),
        title: "Learned guesses far outside of their training".to_owned(),
        caption:
            "The same cases from learned guesses, beside the same solver without them. A bad guess must cost time at \
                  worst: status, energy and length must be those of the row without it."
                .to_owned(),
        columns: columns(&[&["case", "formulation", "solver", "start", "status"], &NUMBERS[..]].concat()),
        rows: guessed
            .map(|(key, value)| row(&[&key.case, &key.formulation, &key.solver, &key.start], &value.row))
            .collect(),
        conditions,
    };
    let blocks = vec![Block::Paragraph(verdict(cells)), Block::Table(plain), Block::Table(learned)];
    Section { id: "stability".to_owned(), title: "Stability".to_owned(), blocks }
}

/// Conditions with the table's tolerances.
pub(crate) fn tolerances(conditions: Conditions) -> Conditions {
    let tolerances = format!("{:e} relative, {:e} absolute", stress::RELATIVE_TOLERANCE, stress::ABSOLUTE_TOLERANCE);
    conditions.with("tolerance", tolerances)
}

/// The table of cases that are solved directly.
pub(crate) fn cases_table(runs: &[&CaseRun], conditions: Conditions) -> Table {
    Table {
        id: "stability-cases".to_owned(),
        title: "Stiff and extreme cases".to_owned(),
        caption: "Energy: largest rise of the total energy above its start, relative to the energy at stake; none in wind, \
                  which does work. Length: largest relative change. Stretch in segment lengths, bend in radians. Depth: \
                  deepest penetration over the radius."
            .to_owned(),
        columns: columns(&[&["case", "formulation", "status"], &NUMBERS[..]].concat()),
        rows: runs.iter().map(|run| row(&[&run.case, &run.formulation], run)).collect(),
        conditions,
    }
}

const NUMBERS: [&str; 8] =
    ["#iterations a step", "#halved", "#energy rise", "#length", "#stretch", "#bend [rad]", "#depth", "#time [s]"];

fn row(names: &[&str], row: &CaseRun) -> Vec<Cell> {
    let optional = |value: Option<f64>| value.map_or(Cell::muted("-"), |value| number(value).into());
    let status = if is_good(row) { Cell::from(row.status.as_str()) } else { Cell::strong(row.status.as_str()) };
    let numbers = [
        number(row.iterations_per_step).into(),
        row.retries.to_string().into(),
        optional(row.energy_rise),
        number(row.length_drift).into(),
        number(row.worst_stretch).into(),
        number(row.worst_bend).into(),
        optional(row.deepest_penetration),
        number(row.seconds).into(),
    ];
    names.iter().map(|&name| Cell::from(name)).chain([status]).chain(numbers).collect()
}

/// Whether all steps converged.
fn is_good(row: &CaseRun) -> bool {
    row.finite && row.status.starts_with("converged")
}

/// The tables in words.
fn verdict(cells: &[(&Key, &Value)]) -> String {
    // Good runs and all, of each formulation, solver and start in their order.
    let mut counts: Vec<([&str; 3], [usize; 2])> = Vec::new();
    // The same solver from zero stands where the network's guess does not.
    let (mut learned, mut fallen) = (0, 0);
    for (key, value) in cells {
        let (way, good) = ([&key.formulation, &key.solver, &key.start].map(String::as_str), is_good(&value.row));
        let place = counts.iter().position(|(known, _)| *known == way).unwrap_or_else(|| {
            counts.push((way, [0; 2]));
            counts.len() - 1
        });
        counts[place].1[0] += usize::from(good);
        counts[place].1[1] += 1;
        if key.start.starts_with("gn") {
            let base = Key { start: ZERO.to_owned(), ..(*key).clone() };
            let stands = cells.iter().any(|(other, value)| **other == base && is_good(&value.row));
            learned += 1;
            fallen += usize::from(stands && !good);
        }
    }
    counts.sort_by_key(|([formulation, solver, start], _)| {
        (Formulation::ALL.iter().position(|known| known.name() == *formulation), *solver != DIRECT, *start != ZERO)
    });
    let words = counts.into_iter().map(|([formulation, solver, start], [good, all])| {
        format!("{formulation}, {solver}, from {start}: {good} of {all}")
    });
    format!(
        "Cases that converge in every step: {}. The paper's formulation is xpbd, the default xpbd-geometric. Of {learned} runs \
         from a learned guess {fallen} do not where the same solver does from zero.",
        words.collect::<Vec<_>>().join("; ")
    )
}
