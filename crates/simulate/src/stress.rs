//! `simulate stress`: the stability table.

use anyhow::Result;
use comfy_table::{CellAlignment, Table};
use evaluation::stress;
use solver::formulation::Formulation;

use crate::Outcome;
use crate::cli::StressArgs;
use crate::progress::Progress;

/// Runs the cases and prints a row each.
pub(crate) fn stress(args: &StressArgs) -> Result<Outcome> {
    let formulations = if args.formulation.is_empty() { Formulation::ALL.to_vec() } else { args.formulation.clone() };
    let mut cases = stress::cases();
    cases.retain(|case| case.name.contains(&args.only));
    let progress = Progress::new(cases.len() * formulations.len(), args.json)?;
    let mut rows = Vec::new();
    'all: for case in &cases {
        for &formulation in &formulations {
            rows.push(stress::run(case, formulation)?);
            if !progress.advance() {
                break 'all;
            }
        }
    }
    let interrupted = progress.finish();
    if args.json {
        println!("{}", serde_json::to_string_pretty(&rows)?);
    } else {
        print(&rows);
    }
    Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done })
}

fn print(rows: &[stress::Row]) {
    println!(
        "Outer tolerance {:e} relative, {:e} absolute. Energy rise: largest rise of the total energy above its start,\n\
         relative to the energy at stake. Length: largest relative change.",
        stress::RELATIVE_TOLERANCE,
        stress::ABSOLUTE_TOLERANCE
    );
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
        "s",
    ]);
    for row in rows {
        let finite = if row.finite { "" } else { ", NOT FINITE" };
        table.add_row([
            row.case.clone(),
            row.formulation.to_owned(),
            row.segments.to_string(),
            format!("{}{finite}", row.status),
            format!("{:.2}", row.iterations_per_step),
            row.retries.to_string(),
            format!("{:.1e}", row.energy_rise),
            format!("{:.1e}", row.length_drift),
            format!("{:.1e}", row.worst_stretch),
            format!("{:.1e}", row.worst_bend),
            format!("{:.2}", row.seconds),
        ]);
    }
    for column in table.column_iter_mut().skip(4) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    println!("{table}");
}
