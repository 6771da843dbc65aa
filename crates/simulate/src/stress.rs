//! `simulate stress`: the stability table.

use anyhow::{Result, bail};
use comfy_table::{CellAlignment, Table};
use evaluation::stress;
use solver::formulation::Formulation;
use solver::step::Status;

use crate::Outcome;
use crate::cli::StressArgs;
use terminal::{Progress, say};

/// Runs the cases and prints a row each.
pub(crate) fn stress(args: &StressArgs) -> Result<Outcome> {
    let formulations = if args.formulation.is_empty() { Formulation::ALL.to_vec() } else { args.formulation.clone() };
    let mut cases = stress::cases();
    cases.retain(|case| case.name.contains(&args.only));
    if cases.is_empty() {
        let names = stress::cases().into_iter().map(|case| case.name).collect::<Vec<_>>().join("; ");
        bail!("--only {}: no case's name holds this text; there are: {names}", args.only);
    }
    let of = |case: &stress::Case| formulations.iter().filter(|f| case.formulations.contains(f)).count();
    let runs = cases.iter().map(of).sum();
    let progress = Progress::new(runs, "runs", args.json)?;
    if !args.json {
        let names = formulations.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        say!("{runs} runs: {} cases in {names}", cases.len())?;
    }
    let mut rows = Vec::new();
    'all: for case in &cases {
        for &formulation in formulations.iter().filter(|f| case.formulations.contains(f)) {
            rows.push(stress::run(case, &stress::settings(formulation), None)?);
            if !progress.advance() {
                break 'all;
            }
        }
    }
    let interrupted = progress.finish();
    if args.json {
        say!("{}", serde_json::to_string_pretty(&rows)?)?;
    } else {
        print(&rows)?;
    }
    let failed = rows.iter().find(|row| !row.finite || row.status == Status::NonFinite.name());
    Ok(match (failed, interrupted) {
        (Some(row), _) => Outcome::NotFinite(format!("{}, {}", row.case, row.formulation)),
        (None, true) => Outcome::Interrupted,
        (None, false) => Outcome::Done,
    })
}

fn print(rows: &[stress::Row]) -> Result<()> {
    say!(
        "Outer tolerance {:e} relative, {:e} absolute. Energy rise: largest rise of the total energy above its start,\n\
         relative to the energy at stake (none in wind, which does work). Length: largest relative change. Depth: deepest\n\
         penetration, contact: worst error of a contact (penetration, or slip where it should stick), both relative to the\n\
         smaller radius.",
        stress::RELATIVE_TOLERANCE,
        stress::ABSOLUTE_TOLERANCE
    )?;
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header([
        "case",
        "formulation",
        "segments",
        "status",
        "outer",
        "halved",
        "energy rise",
        "length",
        "stretch",
        "bend",
        "depth",
        "contact",
        "s",
    ]);
    for row in rows {
        let small = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.1e}"));
        let finite = if row.finite { "" } else { ", NOT FINITE" };
        table.add_row([
            row.case.clone(),
            row.formulation.clone(),
            row.segments.to_string(),
            format!("{}{finite}", row.status),
            format!("{:.2}", row.iterations_per_step),
            row.retries.to_string(),
            small(row.energy_rise),
            format!("{:.1e}", row.length_drift),
            format!("{:.1e}", row.worst_stretch),
            format!("{:.1e}", row.worst_bend),
            small(row.deepest_penetration),
            small(row.worst_contact),
            format!("{:.2}", row.seconds),
        ]);
    }
    for column in table.column_iter_mut().skip(4) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    say!("{table}")
}
