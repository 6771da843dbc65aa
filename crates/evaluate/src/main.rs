//! `evaluate`: measures and makes the report. See `evaluate --help`.

mod agree;
mod blocks;
mod cells;
mod cli;
mod commands;
mod context;
mod front;
mod library;
mod make;
mod numbers;
mod outcome;
mod sections;
mod show;
mod sources;
mod ways;

use std::process::ExitCode;

use crate::cli::Command;
use crate::commands::{benchmark, compare, laws, random, stress};
use crate::outcome::Outcome;

fn main() -> ExitCode {
    let result = match Command::read() {
        Command::Report(args) => make::report(&args),
        Command::Check { report } => make::check(&report),
        Command::Agree { first, second } => agree::runs([&first, &second]),
        Command::Compare(args) => compare::compare(&args),
        Command::Guesses(args) => random::guesses(&args),
        Command::Steps(args) => random::steps(&args),
        Command::Stress(args) => stress::stress(&args),
        Command::Benchmark(args) => benchmark::benchmark(&args),
        Command::Random(args) => laws::random(&args),
    };
    let outcome = result.unwrap_or_else(|error| {
        terminal::complain(format_args!("{error:#}"));
        Outcome::BadInput
    });
    ExitCode::from(outcome as u8)
}
