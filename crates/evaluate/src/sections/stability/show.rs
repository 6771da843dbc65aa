//! The tables of the stability report.

use cosserat::simulation::Formulation;
use evaluation::stress::{self, CaseRun};
use report::{Block, Cell, Conditions, Section};

use super::key::{DIRECT, StabilityKey, Value, ZERO};
use crate::blocks::{self, groups, table};
use crate::context::Context;
use crate::show::number;

pub(super) fn section(context: &Context, cells: &[(&StabilityKey, &Value)]) -> Section {
    let conditions = tolerances(context.conditions("wall time of all steps"));
    let is_plain = |key: &StabilityKey| key.solver == DIRECT && key.start == ZERO;
    let plain: Vec<_> = cells.iter().filter(|(key, _)| is_plain(key)).map(|(_, value)| &value.row).collect();
    let guessed = cells.iter().filter(|(key, _)| !is_plain(key));
    let head = [
        "stability-guesses",
        "Learned guesses far outside of their training",
        "The same cases from learned guesses, beside the same solver without them. A bad guess must cost time at worst: \
         its status must be that of the row without it; energy and length stand beside.",
    ];
    let row = |(key, value): &(&StabilityKey, &Value)| {
        row([&key.case, &key.formulation, &key.solver, &key.start], &value.row)
    };
    let headings = format!("case | formulation | solver | start | {NUMBERS}");
    let guesses = table(head, &headings, guessed.map(row).collect(), conditions.clone());
    blocks::section(["stability", "Stability", &verdict(cells)], vec![cases_table(&plain, conditions), guesses])
}

/// Conditions with the table's tolerances.
pub(crate) fn tolerances(conditions: Conditions) -> Conditions {
    let tolerances = format!("{:e} relative, {:e} absolute", stress::RELATIVE_TOLERANCE, stress::ABSOLUTE_TOLERANCE);
    conditions.with("tolerance", tolerances)
}

/// The table of cases that are solved directly.
pub(crate) fn cases_table(runs: &[&CaseRun], conditions: Conditions) -> Block {
    let head = [
        "stability-cases",
        "Stiff and extreme cases",
        "Energy: largest rise of the total energy above its start, relative to the energy at stake; none in wind, which \
         does work. Length: largest relative change. Stretch in segment lengths, bend in radians. Depth: deepest \
         penetration over the radius.",
    ];
    let rows = runs.iter().map(|run| row([&run.case, &run.formulation], run)).collect();
    table(head, &format!("case | formulation | {NUMBERS}"), rows, conditions)
}

const NUMBERS: &str =
    "status | #iterations a step | #halved | #energy rise | #length | #stretch | #bend [rad] | #depth | #time [s]";

fn row<const N: usize>(names: [&String; N], row: &CaseRun) -> Vec<Cell> {
    let optional = |value: Option<f64>| value.map_or(Cell::muted("-"), |value| number(value).into());
    let status = if is_good(row) { Cell::from(row.status.as_str()) } else { Cell::strong(row.status.as_str()) };
    let numbers = [
        status,
        number(row.iterations_per_step).into(),
        row.retries.to_string().into(),
        optional(row.energy_rise),
        number(row.length_drift).into(),
        number(row.worst_stretch).into(),
        number(row.worst_bend).into(),
        optional(row.deepest_penetration),
        number(row.seconds).into(),
    ];
    names.into_iter().map(|name| Cell::from(name.as_str())).chain(numbers).collect()
}

/// Whether all steps converged.
fn is_good(row: &CaseRun) -> bool {
    row.finite && row.status.starts_with("converged")
}

/// The tables in words.
fn verdict(cells: &[(&StabilityKey, &Value)]) -> String {
    let mut ways = groups(cells, |StabilityKey { formulation, solver, start, .. }| (formulation, solver, start));
    ways.sort_by_key(|((formulation, solver, start), _)| {
        (Formulation::ALL.iter().position(|known| known.name() == *formulation), *solver != DIRECT, *start != ZERO)
    });
    let words = ways.iter().map(|((formulation, solver, start), own)| {
        let good = own.iter().filter(|(_, value)| is_good(&value.row)).count();
        format!("{formulation}, {solver}, from {start}: {good} of {}", own.len())
    });
    let learned = || cells.iter().filter(|(key, _)| key.start.starts_with("gn"));
    // The same solver from zero stands where the network's guess does not.
    let fallen = learned().filter(|(key, value)| {
        let base = StabilityKey { start: ZERO.to_owned(), ..(*key).clone() };
        !is_good(&value.row) && cells.iter().any(|(other, value)| **other == base && is_good(&value.row))
    });
    format!(
        "Cases that converge in every step: {}. The paper's formulation is xpbd, the default newton. Of {} runs \
         from a learned guess {} do not where the same solver does from zero.",
        words.collect::<Vec<_>>().join("; "),
        learned().count(),
        fallen.count()
    )
}
