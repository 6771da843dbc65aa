//! `simulate steps`: where starts of whole steps stand, on random scenes that no network has seen.

use std::fmt::Write as _;

use anyhow::{Result, bail};
use catalogue::{NetworkOf, Row, networks, rows};
use comfy_table::{CellAlignment, Table};
use dataset::{Config, Scenario};
use evaluation::guesses::Spread;
use evaluation::steps::{self, Cell, Tally};
use graph::planar_normal;
use serde::Serialize;
use solver::formulation::Formulation;
use solver::simulation::GuessFactory;

use crate::Outcome;
use crate::cli::{StepsArgs, TableArgs};
use crate::scenes::settings_for;
use crate::spreads::{network_columns, push_spreads, spread_names};
use crate::table::{finish, prepare};
use terminal::{Progress, say};

/// All that was measured.
#[derive(Serialize)]
struct Report {
    /// Seed of the scenes.
    seed: u64,
    /// Steps of each simulation.
    steps: usize,
    sheets: Vec<Sheet>,
}

/// One kind of scenes at one time step and tolerance.
#[derive(Serialize)]
struct Sheet {
    scenario: Scenario,
    /// Whether they are the slack variants of Table 1's.
    is_slack: bool,
    dt_s: f64,
    tolerance: f64,
    simulations: usize,
    /// The networks among the starts.
    networks: Vec<NetworkOf>,
    cells: Vec<Cell>,
}

/// Measures all starts and prints the tables.
pub(crate) fn steps(args: &StepsArgs) -> Result<Outcome> {
    check(args)?;
    let loaded = prepare(&args.table, &args.guess)?;
    let table = &args.table;
    let sheets = loaded.len() * 2 * args.dt.len() * args.tolerance.len();
    let progress = Progress::new(sheets * table.simulations * table.steps, "steps", table.json)?;
    let mut report = Report { seed: table.seed, steps: table.steps, sheets: Vec::new() };
    for (scenario, guesses) in &loaded {
        // In planar scenes starts stay in the plane where they know of it.
        let rows = rows(guesses, false);
        for is_slack in [false, true] {
            for (dt_s, tolerance) in args.dt.iter().flat_map(|&dt| args.tolerance.iter().map(move |&x| (dt, x))) {
                let tallies = measure(table, *scenario, is_slack, (dt_s, tolerance), &rows, &progress)?;
                let starts: Vec<_> = rows.iter().map(|row| (row.name.clone(), row.guess_name.is_learned())).collect();
                report.sheets.push(Sheet {
                    scenario: *scenario,
                    is_slack,
                    dt_s,
                    tolerance,
                    simulations: tallies.len(),
                    networks: networks(&rows),
                    cells: steps::cells(&starts, &tallies),
                });
            }
        }
    }
    let interrupted = progress.finish();
    report.sheets.retain(|sheet| sheet.simulations > 0);
    finish(table, &report, interrupted, csv, print)
}

fn check(args: &StepsArgs) -> Result<()> {
    if args.table.seed == Config::table_1(Scenario::Rod).seed {
        bail!(
            "--seed {}, but it must differ from the training scenes' seed: networks have seen those",
            args.table.seed
        );
    }
    if let Some(scenario) = args.table.scenario.iter().find(|scenario| !scenario.teaches_steps()) {
        bail!("--scenario {scenario}, but starts of whole steps are compared on rod and helix: in free motion");
    }
    if let Some(name) = args.guess.iter().find(|name| name.helps_solves()) {
        bail!("--guess {name} starts linear solves, but starts of whole steps are compared here");
    }
    Ok(())
}

/// Simulates all scenes of a sheet from all starts; those that Ctrl-C cut off are left out.
fn measure(
    table: &TableArgs,
    scenario: Scenario,
    is_slack: bool,
    (dt, tolerance): (f64, f64),
    rows: &[Row<'_>],
    progress: &Progress,
) -> Result<Vec<Vec<Tally>>> {
    let settings = settings_for(Formulation::Newton, tolerance);
    let mut tallies = Vec::new();
    for index in 0..table.simulations as u64 {
        if progress.stopped() {
            break;
        }
        let parameters = scenario.sample(table.seed, index);
        let slack = if is_slack { parameters.slack() } else { None };
        let scene = slack.unwrap_or(parameters).scene()?;
        let plane = planar_normal(&scene.model, &scene.state);
        let factories: Vec<_> = rows.iter().map(|row| row.factory(plane)).collect();
        let start = |(row, factory)| {
            let row: &Row<'_> = row;
            row.guess_name.helps_steps().then_some(factory as GuessFactory<'_>)
        };
        let starts: Vec<_> = rows.iter().zip(&factories).map(start).collect();
        let span = (dt, table.steps);
        let one =
            steps::measure(&scene.model, &scene.state, span, &settings, &starts, |steps| progress.advance_by(steps))?;
        if !progress.stopped() {
            tallies.push(one);
        }
    }
    Ok(tallies)
}

/// Scenes of a sheet in words.
fn kind(sheet: &Sheet) -> String {
    format!("{}{}", if sheet.is_slack { "slack " } else { "" }, sheet.scenario)
}

fn print(report: &Report) -> Result<()> {
    say!(
        "Starts of whole steps, formulation newton, direct solves: the paper's random scenes (Table 1) of seed {}, and slack\n\
         variants (rods of radius 0.01 m and 1000 kg/m^3, helices of radius 0.02 m, moduli 1e4 to 1e5 Pa); {} steps each.\n\
         Outer iterations a step (medians over the simulations), and time a step relative to the fastest start without\n\
         learning (median over the simulations of the ratio within each, and its quartiles), guesses included.\n\
         Position errors against a tight reference stand in --csv and --json.",
        report.seed,
        report.steps
    )?;
    let mut rest = &report.sheets[..];
    while let Some(first) = rest.first() {
        let count = rest.iter().take_while(|sheet| kind(sheet) == kind(first)).count();
        let (sheets, others) = rest.split_at(count);
        rest = others;
        let least = sheets.iter().map(|sheet| sheet.simulations).min().unwrap_or(0);
        say!("\n{}, {least} simulations", kind(first))?;
        say!("{}", table(sheets))?;
    }
    say!("{}", words(report))
}

/// One row a start, two columns a sheet.
fn table(sheets: &[Sheet]) -> Table {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    let heads = sheets.iter().map(|sheet| format!("dt {}\n{:e}", sheet.dt_s, sheet.tolerance));
    table.set_header(std::iter::once("start".to_owned()).chain(heads.flat_map(|head| [head, "\ntime".to_owned()])));
    let starts = sheets.first().map_or(0, |sheet| sheet.cells.len());
    for start in 0..starts {
        let mut row = vec![sheets[0].cells[start].guess.clone()];
        for sheet in sheets {
            let cell = &sheet.cells[start];
            row.push(cell.iterations.map_or("-".to_owned(), |spread| format!("{:.2}", spread.median)));
            row.push(cell.time_ratio.map_or("-".to_owned(), |Spread { lower, median, upper, .. }| {
                format!("{median:.2} {lower:.2}-{upper:.2}")
            }));
        }
        table.add_row(row);
    }
    for column in table.column_iter_mut() {
        column.set_padding((0, 1));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// How each learned start does, in words.
fn words(report: &Report) -> String {
    let mut words = String::new();
    let cells = report.sheets.first().map_or(&[][..], |sheet| &sheet.cells[..]);
    for (start, Cell { guess, .. }) in cells.iter().enumerate().filter(|(_, cell)| cell.is_learned) {
        let total = report.sheets.len();
        let less = |ratio: fn(&Cell) -> Option<Spread>| {
            let is_less = |sheet: &&Sheet| ratio(&sheet.cells[start]).is_some_and(|spread| spread.median < 1.0);
            report.sheets.iter().filter(is_less).count()
        };
        let (iterations, time) = (less(|cell| cell.iteration_ratio), less(|cell| cell.time_ratio));
        // Writing to a string cannot fail.
        let _ = writeln!(
            words,
            "\n{guess} needs fewer outer iterations than every start without learning in {iterations} of {total} cells, and\n\
             less time, its own included, in {time}."
        );
        let time_of = |sheet: &Sheet| sheet.cells[start].time_ratio.map_or(f64::NAN, |spread| spread.median);
        let mut sheets: Vec<&Sheet> = report.sheets.iter().collect();
        sheets.sort_by(|a, b| time_of(a).total_cmp(&time_of(b)));
        for (sheet, how) in sheets.first().into_iter().zip(["best"]).chain(sheets.last().into_iter().zip(["worst"])) {
            let (kind, dt, tolerance) = (kind(sheet), sheet.dt_s, sheet.tolerance);
            let _ = writeln!(
                words,
                "At its {how} ({kind}, dt {dt} s, tolerance {tolerance:e}) a step takes {:.2} of the fastest other start's time.",
                time_of(sheet)
            );
        }
        let highest = |value: fn(&Cell) -> f64| {
            100.0 * report.sheets.iter().map(|sheet| value(&sheet.cells[start])).fold(0.0, f64::max)
        };
        let (dropped, failed) = (highest(|cell| cell.dropped), highest(|cell| cell.failed));
        let _ = write!(
            words,
            "Of its starts at most {dropped:.1} % were dropped, or their step done again; of the steps {failed:.1} % did not converge."
        );
    }
    words
}

/// One line a cell; empty where nothing was counted.
fn csv(report: &Report) -> String {
    let names = spread_names(&["iterations", "iteration_ratio", "time_us", "time_ratio", "guess_us", "error"]);
    let mut text = format!(
        "scenario,slack,dt_s,tolerance,simulations,start,network,weights_blake3,retried,dropped,failed,{names}\n"
    );
    for sheet in &report.sheets {
        for cell in &sheet.cells {
            let Sheet { scenario, is_slack, dt_s, tolerance, simulations, .. } = sheet;
            let network = network_columns(&sheet.networks, &cell.guess);
            // Writing to a string cannot fail.
            let _ = write!(text, "{scenario},{is_slack},{dt_s},{tolerance:e},{simulations},{},{network}", cell.guess);
            let _ = write!(text, ",{:.6},{:.6},{:.6}", cell.retried, cell.dropped, cell.failed);
            let Cell { iterations, iteration_ratio, time_us, time_ratio, guess_us, error, .. } = *cell;
            push_spreads(&mut text, &[iterations, iteration_ratio, time_us, time_ratio, guess_us, error]);
            text.push('\n');
        }
    }
    text
}
