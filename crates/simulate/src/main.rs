//! `simulate`: elastic rods on the command line. See `simulate --help`.

mod choice;
mod cli;
mod compare;
#[cfg(feature = "gn")]
mod demo;
mod files;
mod guesses;
mod keep;
mod list;
mod measured;
mod numbers;
mod plots;
mod run;
mod sample;
mod scenes;
mod spreads;
mod standing;
mod statics;
mod steps;
mod stress;
mod summary;
mod table;
mod view;

use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use terminal::say;

use crate::cli::{Cli, Command};

/// Exit code of a run whose numbers were not finite, or of an equilibrium that was not found.
const FAILED: u8 = 1;
/// Exit code of bad input: flags, scenes, places to write to.
const BAD_INPUT: u8 = 2;

/// How a command ended.
enum Outcome {
    Done,
    Interrupted,
    /// Numbers were not finite: where.
    NotFinite(String),
    /// No equilibrium was found.
    NotConverged,
}

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

fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match cli.command {
        None if std::env::args_os().len() == 1 => first_run(&cli),
        None => run::run(&cli.scene, &cli.run),
        Some(Command::List) => list::list(),
        Some(Command::View(args)) => view::view(&args),
        Some(Command::Compare(args)) => compare::compare(&args),
        Some(Command::Guesses(args)) => guesses::guesses(&args),
        Some(Command::Steps(args)) => steps::steps(&args),
        Some(Command::Static(args)) => statics::relax(&args),
        Some(Command::Stress(args)) => stress::stress(&args),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Interrupted) => ExitCode::from(terminal::INTERRUPTED),
        Ok(Outcome::NotFinite(place)) => {
            terminal::complain(format_args!("numbers are not finite: {place}"));
            ExitCode::from(FAILED)
        }
        Ok(Outcome::NotConverged) => ExitCode::from(FAILED),
        Err(error) => {
            terminal::complain(format_args!("{error:#}"));
            ExitCode::from(BAD_INPUT)
        }
    }
}
