//! `simulate guesses`: where the guesses stand, on random scenes that no data set holds.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, bail};
use dataset::{Config, Scenario};
use evaluation::guesses::{self, Cell, Spread};
use evaluation::starts::{Measured, Plan};
use graph::planar_normal;
use scene::Scene;
use serde::Serialize;
use solver::formulation::Formulation;
use solver::guess::GuessKind;
use solver::simulation::{GuessFactory, Settings};

use crate::Outcome;
use crate::cli::GuessesArgs;
use crate::compare::{PRECONDITIONERS, TOLERANCES};
use crate::guess::GuessName;
use crate::progress::Progress;
use crate::rows::{NetworkOf, Row, load, networks, rows};
use crate::standing;
use crate::training::Training;
use terminal::say;

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
    if let Some(file) = &args.csv {
        check_place(file)?;
    }
    let mut scenarios: Vec<Scenario> = Vec::new();
    for &scenario in &args.scenario {
        if !scenarios.contains(&scenario) {
            scenarios.push(scenario);
        }
    }
    let mut loaded = Vec::new();
    for training in Training::of(&args.learned, &args.guess, &scenarios, args.json)? {
        let names = std::iter::once(GuessName::Plain(GuessKind::Zero)).chain(args.guess.iter().copied());
        loaded.push((training.scenario, load(names, &training)?));
    }
    let progress = Progress::new(loaded.len() * args.simulations * args.steps, "steps", args.json)?;
    let mut standings = Vec::new();
    for (scenario, guesses) in &loaded {
        standings.push(measure(*scenario, args, &rows(guesses, *scenario == Scenario::Rod), &progress)?);
    }
    let interrupted = progress.finish();
    let data_seed = Config::table_1(Scenario::Rod).seed;
    let report = Report { seed: args.seed, data_seed, steps: args.steps, standings };
    if let Some(file) = &args.csv {
        let text = csv(&report);
        export::write_atomically(file, |out| std::io::Write::write_all(out, text.as_bytes())).context("--csv")?;
    }
    if args.json {
        say!("{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        standing::print(&report)?;
    }
    Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done })
}

fn check(args: &GuessesArgs) -> Result<()> {
    if args.seed == Config::table_1(Scenario::Rod).seed {
        bail!("--seed {}, but it must differ from the data sets' seed: guesses have seen those scenes", args.seed);
    }
    if let Some(name) = args.guess.iter().find(|name| name.helps_steps()) {
        bail!("--guess {name} starts whole steps, but guesses of linear solves are compared here");
    }
    Ok(())
}

/// Finds out before the run whether the file can be written after it.
fn check_place(file: &Path) -> Result<()> {
    let parent = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if file.is_dir() {
        bail!("--csv: cannot write {}: is a directory", file.display());
    }
    if !parent.is_dir() {
        bail!("--csv: cannot write {}: there is no directory {}", file.display(), parent.display());
    }
    Ok(())
}

fn measure(scenario: Scenario, args: &GuessesArgs, rows: &[Row<'_>], progress: &Progress) -> Result<Standing> {
    let mut measured = Vec::new();
    for index in 0..args.simulations as u64 {
        let scene = scenario.sample(args.seed, index).scene()?;
        if let Some(one) = simulate(&scene, rows, args.steps, progress)? {
            measured.push(one);
        }
        if progress.stopped() {
            break;
        }
    }
    // The names and columns are all that a table takes of a plan.
    let names = rows.iter().map(|row| (row.name.clone(), None)).collect();
    let cells = guesses::table(&plan(names, args.steps), &measured);
    Ok(Standing { scenario, simulations: measured.len(), networks: networks(rows), cells })
}

fn plan<'a>(guesses: Vec<(String, Option<GuessFactory<'a>>)>, steps: usize) -> Plan<'a> {
    Plan {
        guesses,
        preconditioners: PRECONDITIONERS.to_vec(),
        tolerances: TOLERANCES.to_vec(),
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
    let spreads = ["iterations", "iteration_ratio", "time_ratio", "time_us"];
    let parts = ["mean", "lower_quartile", "median", "upper_quartile"];
    let names: Vec<String> = spreads.iter().flat_map(|spread| parts.map(|part| format!("{spread}_{part}"))).collect();
    let mut text = format!(
        "scenario,simulations,bucket,guess,network,weights_blake3,preconditioner,tolerance,solves,dropped,{}\n",
        names.join(",")
    );
    for standing in &report.standings {
        for cell in &standing.cells {
            let Cell { bucket, guess, preconditioner, tolerance, solves, dropped, .. } = cell;
            let network = standing.networks.iter().find(|network| network.guess == *guess);
            let network = network.map_or(",".to_owned(), |NetworkOf { origin, .. }| {
                format!("\"{}\",{}", origin.network.replace('"', "\"\""), origin.weights_blake3)
            });
            let start = format!("{},{},{bucket},\"{guess}\",{network}", standing.scenario, standing.simulations);
            // Writing to a string cannot fail.
            let _ = write!(text, "{start},{preconditioner},{tolerance:e},{solves},{dropped}");
            for spread in [cell.iterations, cell.iteration_ratio, cell.time_ratio, cell.time_us] {
                match spread {
                    Some(Spread { mean, lower, median, upper }) => {
                        let _ = write!(text, ",{mean:.6},{lower:.6},{median:.6},{upper:.6}");
                    }
                    None => text.push_str(",,,,"),
                }
            }
            text.push('\n');
        }
    }
    text
}
