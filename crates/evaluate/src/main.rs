//! `evaluate`: measures and makes the report. See `evaluate --help`.

mod cards;
mod cells;
mod cli;
mod compare;
mod context;
mod library;
mod make;
mod sections;
mod show;
mod sources;
mod ways;
mod written;

use std::process::ExitCode;

use crate::cli::{Cli, Command};

/// Exit code of bad input: flags, places to write to, damaged results.
const BAD_INPUT: u8 = 2;

fn main() -> ExitCode {
    let result = match Cli::read() {
        Command::Report(args) => make::report(&args),
        Command::Check { report } => make::check(&report),
        Command::Compare { first, second } => compare::runs([&first, &second])
            .map(|same| if same { ExitCode::SUCCESS } else { ExitCode::from(make::FAILED) }),
    };
    result.unwrap_or_else(|error| {
        terminal::complain(format_args!("{error:#}"));
        ExitCode::from(BAD_INPUT)
    })
}
