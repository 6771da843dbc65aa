//! `train`: trains COPINGNet. See `train --help`.

mod cli;
mod course;
mod curves;
mod data;
mod equilibrium;
mod lesson;
mod measure;
mod objective;
mod outcome;
mod paths;
mod plan;
mod run;
mod samples;
mod steps;
mod sweep;
mod trainer;

use std::process::ExitCode;

use clap::Parser;

use crate::outcome::Outcome;

/// Exit code of bad input: flags, data, files.
const BAD_INPUT: u8 = 2;
/// Exit code of a training that was stopped by Ctrl-C, its state kept.
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    let result = match &cli.command {
        None => run::run(&cli.train),
        Some(cli::Command::Data(args)) => data::generate_part(args).map(|()| Outcome::Done),
        Some(cli::Command::Sweep(args)) => sweep::run(args),
        Some(cli::Command::Equilibrium(args)) => equilibrium::run(args),
    };
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Interrupted) => ExitCode::from(INTERRUPTED),
        Err(error) => {
            terminal::complain(format_args!("{error:#}"));
            ExitCode::from(BAD_INPUT)
        }
    }
}
