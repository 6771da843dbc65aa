//! `simulate guesses`: where the guesses stand, on random scenes that no data set holds.

use std::fmt::Write as _;

use anyhow::{Result, bail};
use catalogue::{NetworkOf, Row, networks, rows};
use dataset::{Config, Scenario};
use evaluation::guesses::{self, Cell};
use evaluation::starts::{Measured, Plan};
use graph::planar_normal;
use scene::Scene;
use serde::Serialize;
use solver::formulation::Formulation;
use solver::simulation::{GuessFactory, Settings};

use terminal::Progress;

use crate::Outcome;
use crate::cli::{GuessesArgs, TableArgs};
use crate::compare::{PRECONDITIONERS, TOLERANCES};
use crate::spreads::{network_columns, push_spreads, spread_names};
use crate::standing;
use crate::table::{finish, prepare};

/// All that was measured.
#[derive(Serialize)]
pub(crate) struct Report {
    /// Seed of the scenes.
    pub(crate) seed: u64,
    /// Seed of the data sets.
    pub(crate) data_seed: u64,
    /// Steps of each simulation.
    pub(crate) steps: usize,
    /// One a scenario.
    pub(crate) standings: Vec<Standing>,
}

/// What was measured in one scenario.
#[derive(Serialize)]
pub(crate) struct Standing {
    /// Which scenes.
    pub(crate) scenario: Scenario,
    /// Simulations measured.
    pub(crate) simulations: usize,
    /// The networks among the guesses.
    pub(crate) networks: Vec<NetworkOf>,
    /// By bucket, guess, preconditioner and tolerance.
    pub(crate) cells: Vec<Cell>,
}

/// Measures all guesses and prints the tables.
pub(crate) fn guesses(args: &GuessesArgs) -> Result<Outcome> {
    check(args)?;
    let loaded = prepare(&args.table, &args.guess)?;
    let table = &args.table;
    let progress = Progress::new(loaded.len() * table.simulations * table.steps, "steps", table.json)?;
    let mut standings = Vec::new();
    for (scenario, guesses) in &loaded {
        standings.push(measure(*scenario, table, &rows(guesses, *scenario == Scenario::Rod), &progress)?);
    }
    let interrupted = progress.finish();
    let data_seed = Config::table_1(Scenario::Rod).seed;
    let report = Report { seed: table.seed, data_seed, steps: table.steps, standings };
    finish(table, &report, interrupted, csv, standing::print)
}

fn check(args: &GuessesArgs) -> Result<()> {
    if args.table.seed == Config::table_1(Scenario::Rod).seed {
        bail!(
            "--seed {}, but it must differ from the data sets' seed: guesses have seen those scenes",
            args.table.seed
        );
    }
    if let Some(name) = args.guess.iter().find(|name| name.helps_steps()) {
        bail!("--guess {name} starts whole steps, but guesses of linear solves are compared here");
    }
    Ok(())
}

fn measure(scenario: Scenario, table: &TableArgs, rows: &[Row<'_>], progress: &Progress) -> Result<Standing> {
    let mut measured = Vec::new();
    for index in 0..table.simulations as u64 {
        let scene = scenario.sample(table.seed, index).scene()?;
        if let Some(one) = simulate(&scene, rows, table.steps, progress)? {
            measured.push(one);
        }
        if progress.stopped() {
            break;
        }
    }
    // The names and columns are all that a table takes of a plan.
    let names = rows.iter().map(|row| (row.name.clone(), None)).collect();
    let cells = guesses::table(&plan(names, table.steps), &measured);
    Ok(Standing { scenario, simulations: measured.len(), networks: networks(rows), cells })
}

fn plan<'a>(guesses: Vec<(String, Option<GuessFactory<'a>>)>, steps: usize) -> Plan<'a> {
    Plan {
        guesses,
        preconditioners: PRECONDITIONERS.to_vec(),
        tolerances: TOLERANCES.to_vec(),
        max_iterations: None,
        buckets: guesses::buckets(steps),
    }
}

/// Measures one scene; `None` where Ctrl-C came first.
fn simulate(scene: &Scene, rows: &[Row<'_>], steps: usize, progress: &Progress) -> Result<Option<Measured>> {
    let plane = planar_normal(&scene.model, &scene.state);
    let factories: Vec<_> = rows.iter().map(|row| row.factory(plane)).collect();
    let guesses = rows.iter().zip(&factories).map(|(row, factory)| {
        let guess = row.guess_name.helps_solves().then_some(factory as GuessFactory<'_>);
        (row.name.clone(), guess)
    });
    let plan = plan(guesses.collect(), steps);
    // The paper's formulation, and the data sets'.
    let mut settings = Settings::default();
    settings.step.formulation = Formulation::Xpbd;
    let measured = guesses::measure(&scene.model, &scene.state, scene.run.dt, &settings, &plan, || progress.advance())?;
    Ok((!progress.stopped()).then_some(measured))
}

/// One line a cell; empty where nothing was counted.
fn csv(report: &Report) -> String {
    let names = spread_names(&["iterations", "iteration_ratio", "time_ratio", "time_us"]);
    let mut text = format!(
        "scenario,simulations,bucket,guess,network,weights_blake3,preconditioner,tolerance,solves,dropped,{names}\n"
    );
    for standing in &report.standings {
        for cell in &standing.cells {
            let Cell { bucket, guess, preconditioner, tolerance, solves, dropped, .. } = cell;
            let network = network_columns(&standing.networks, guess);
            let start = format!("{},{},{bucket},\"{guess}\",{network}", standing.scenario, standing.simulations);
            // Writing to a string cannot fail.
            let _ = write!(text, "{start},{preconditioner},{tolerance:e},{solves},{dropped}");
            push_spreads(&mut text, &[cell.iterations, cell.iteration_ratio, cell.time_ratio, cell.time_us]);
            text.push('\n');
        }
    }
    text
}
