//! `evaluate`: measures and makes the report. See `evaluate --help`.

mod agreement;
mod cells;
mod cli;
mod context;
mod library;
mod make;
mod sections;
mod show;
mod ways;

use std::process::ExitCode;

use crate::cli::{Cli, Command};

/// Exit code of a report with faults, and of runs that differ.
const FAILED: u8 = 1;
/// Exit code of bad input: flags, places to write to, damaged results.
const BAD_INPUT: u8 = 2;

/// How a command ended.
enum Outcome {
    Done,
    Interrupted,
    Faulty,
}

fn main() -> ExitCode {
    let result = match Cli::read() {
        Command::Report(args) => make::report(&args),
        Command::Check(args) => make::check(&args.report),
        Command::Compare(args) => make::compare([&args.first, &args.second]),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Interrupted) => ExitCode::from(terminal::INTERRUPTED),
        Ok(Outcome::Faulty) => ExitCode::from(FAILED),
        Err(error) => {
            terminal::complain(format_args!("{error:#}"));
            ExitCode::from(BAD_INPUT)
        }
    }
}
