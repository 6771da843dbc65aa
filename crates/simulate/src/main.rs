//! `simulate`: elastic rods on the command line. See `simulate --help`.

mod along;
mod apart;
mod at_rest;
mod braked;
mod braking;
mod branches;
mod breaks;
mod choice;
mod chosen;
mod cli;
mod coarse;
mod converted;
mod curves;
#[cfg(feature = "gn")]
mod demo;
mod exports;
mod files;
mod going_on;
mod held;
mod inelastic;
mod keep;
mod kept_scene;
mod learned_start;
mod list;
mod measured;
mod modes;
mod named;
mod numbers;
mod outcome;
mod plots;
mod rate;
mod reached;
mod rods;
mod run;
mod sample;
mod scenes;
mod sharp;
mod shown;
mod solver_name;
mod sought;
mod statics;
mod summary;
mod view;
mod watch;

use std::process::ExitCode;

use anyhow::Result;
use terminal::say;

use crate::cli::{Cli, Command};
use crate::outcome::Outcome;

/// Exit code of a run with a step that was not solved to its tolerance, and of an equilibrium that was not found.
const FAILED: u8 = 1;
/// Exit code of bad input: flags, scenes, places to write to.
const BAD_INPUT: u8 = 2;

/// Commands that `evaluate` has.
const MEASURING: [&str; 4] = ["compare", "guesses", "steps", "stress"];

/// Without arguments: a first look, and where to look next.
fn first_run(cli: &Cli) -> Result<Outcome> {
    #[cfg(feature = "gn")]
    let outcome = {
        // It has flags of its own.
        let _ = cli;
        demo::demo()?
    };
    #[cfg(not(feature = "gn"))]
    let outcome = run::run(&cli.scene, &cli.run)?;
    say!(
        "\nNext: `simulate --view` writes a page to watch it (`cargo run -p simulate -- --view`),\n\
         `simulate list` shows more scenes, `simulate --help` all flags; for scenes of your own see docs/scenes.md"
    )?;
    Ok(outcome)
}

/// One run, and how to watch it where that was not asked for and nothing was written.
fn one_run(cli: &Cli) -> Result<Outcome> {
    let outcome = run::run(&cli.scene, &cli.run)?;
    let prints = !cli.scene.quiet && !cli.scene.json;
    if prints && !cli.run.live && !cli.run.writes() && matches!(outcome, Outcome::Done) {
        say!("add --view to this command for a page to watch it")?;
    }
    Ok(outcome)
}

fn main() -> ExitCode {
    let first = std::env::args_os().nth(1);
    if let Some(name) = first.as_ref().and_then(|name| name.to_str()).filter(|name| MEASURING.contains(name)) {
        terminal::complain(format_args!("`simulate {name}` is `evaluate {name}` now: cargo run -p evaluate -- {name}"));
        return ExitCode::from(BAD_INPUT);
    }
    let cli = cli::parse().without_repeats();
    let result = match cli.command {
        None if std::env::args_os().len() == 1 => first_run(&cli),
        None => one_run(&cli),
        Some(Command::List) => list::list(),
        Some(Command::Convert(args)) => converted::convert(&args),
        Some(Command::View(args)) => view::view(&args),
        Some(Command::Export(args)) => exports::export(&args),
        Some(Command::Static(args)) => statics::find(&args),
        Some(Command::Modes(args)) => modes::find(&args),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Interrupted) => ExitCode::from(terminal::INTERRUPTED),
        Ok(Outcome::Stuck(why)) => {
            terminal::complain(format_args!("{why}"));
            ExitCode::from(FAILED)
        }
        Ok(Outcome::Inaccurate(warning)) => {
            terminal::warn(format_args!("{warning}"));
            ExitCode::from(FAILED)
        }
        Ok(Outcome::NotConverged) => ExitCode::from(FAILED),
        Err(error) => {
            terminal::complain(format_args!("{error:#}"));
            ExitCode::from(BAD_INPUT)
        }
    }
}
