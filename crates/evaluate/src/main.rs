//! `evaluate`: measures and makes the report. See `evaluate --help`.

mod agree;
mod blocks;
mod cells;
mod cli;
mod commands;
mod context;
mod library;
mod make;
mod sections;
mod show;
mod sources;
mod ways;

use std::process::ExitCode;

use crate::cli::Command;
use crate::commands::{compare, random, stress};

/// Exit code of a report with faults, of runs that differ, and of numbers that are not finite.
const FAILED: u8 = 1;
/// Exit code of bad input: flags, places to write to, damaged results.
const BAD_INPUT: u8 = 2;

/// How a command ended.
enum Outcome {
    Done,
    Interrupted,
    Faulty,
}

impl Outcome {
    /// Says of what the numbers are not finite.
    fn not_finite(scene: &str, way: &str) -> Self {
        terminal::complain(format_args!("numbers are not finite: {scene}, {way}"));
        Self::Faulty
    }
}

fn main() -> ExitCode {
    let result = match Command::read() {
        Command::Report(args) => make::report(&args),
        Command::Check { report } => make::check(&report),
        Command::Agree { first, second } => agree::runs([&first, &second]),
        Command::Compare(args) => compare::compare(&args),
        Command::Guesses(args) => random::guesses(&args),
        Command::Steps(args) => random::steps(&args),
        Command::Stress(args) => stress::stress(&args),
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
