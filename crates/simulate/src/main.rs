//! `simulate`: elastic rods on the command line. See `simulate --help`.

mod choice;
mod cli;
#[cfg(feature = "gn")]
mod demo;
mod files;
mod keep;
mod list;
mod measured;
mod plots;
mod run;
mod sample;
mod scenes;
mod solver_name;
mod statics;
mod summary;
mod view;

use std::process::ExitCode;

use clap::Parser;

use crate::cli::{Cli, Command};

/// Exit code of a run whose numbers were not finite, or of an equilibrium that was not found.
const FAILED: u8 = 1;
/// Exit code of bad input: flags, scenes, places to write to.
const BAD_INPUT: u8 = 2;

/// Commands that `evaluate` has.
const MEASURING: [&str; 4] = ["compare", "guesses", "steps", "stress"];

/// How a command ended.
enum Outcome {
    Done,
    Interrupted,
    /// Numbers were not finite: where.
    NotFinite(String),
    /// No equilibrium was found.
    NotConverged,
}

fn main() -> ExitCode {
    if let Some(name) = std::env::args().nth(1).filter(|name| MEASURING.contains(&name.as_str())) {
        terminal::complain(format_args!("`simulate {name}` is `evaluate {name}` now: cargo run -p evaluate -- {name}"));
        return ExitCode::from(BAD_INPUT);
    }
    let cli = Cli::parse();
    let result = match cli.command {
        #[cfg(feature = "gn")]
        None if std::env::args_os().len() == 1 => demo::demo(),
        None => run::run(&cli.scene, &cli.run),
        Some(Command::List) => list::list(),
        Some(Command::View(args)) => view::view(&args),
        Some(Command::Static(args)) => statics::relax(&args),
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
