//! Flags and subcommands.

use std::path::PathBuf;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};

use crate::commands::compare::CompareArgs;
use crate::commands::guesses::GuessesArgs;
use crate::commands::steps::StepsArgs;
use crate::commands::stress::StressArgs;
use crate::sections::Name;

/// Measures solvers, guesses and networks, and makes a report of it: one HTML page and its numbers as CSV files.
#[derive(Debug, Parser)]
#[command(version)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

impl Cli {
    /// Reads the command line. Beside the commands below each section has one of its own: `evaluate knot` is
    /// `evaluate report --only knot --out out/knot`.
    pub(crate) fn read() -> Command {
        let mut command = Self::command();
        for name in Name::value_variants() {
            let section = ReportArgs::augment_args(clap::Command::new(name.name()).about(name.about()));
            let section = section.mut_arg("only", |only| only.hide(true));
            command = command.subcommand(section.mut_arg("out", |out| out.default_value(name.folder())));
        }
        let matches = command.get_matches();
        let section = matches.subcommand().and_then(|(name, own)| Some((Name::from_str(name, false).ok()?, own)));
        let read = match section {
            Some((name, own)) => {
                ReportArgs::from_arg_matches(own).map(|args| Command::Report(ReportArgs { only: vec![name], ..args }))
            }
            None => Self::from_arg_matches(&matches).map(|cli| cli.command),
        };
        read.unwrap_or_else(|error| error.exit())
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Measure whatever is not measured yet, and write the report.
    Report(ReportArgs),
    /// Look for faults in a report: broken links, figures without conditions or numbers.
    Check(CheckArgs),
    /// Hold what two runs have measured against each other: all but times must be the same; of times, their order is.
    Agree(AgreeArgs),
    /// Run a scene with several solvers and guesses: iterations, time by stage, error against a tight reference.
    Compare(CompareArgs),
    /// Measure guesses on the paper's random scenes: iterations and time relative to a zero start, by step.
    Guesses(GuessesArgs),
    /// Measure starts of whole steps on random scenes, slack ones too: outer iterations and time (formulation newton).
    Steps(StepsArgs),
    /// Run the stability table: stiff, slack, tiny, huge and degenerate rods, each with its status.
    Stress(StressArgs),
}

#[derive(Args, Debug)]
pub(crate) struct ReportArgs {
    /// Fewer scenes, simulations and steps: done in under ten minutes. The full report takes about five hours of one core;
    /// it may be interrupted, and goes on where it stopped, and several processes that are started side by side share it.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Folder of the report: index.html, csv/ and svg/.
    #[arg(long, default_value = "report", value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Only these sections.
    #[arg(long, value_delimiter = ',', value_name = "SECTIONS", value_enum)]
    pub(crate) only: Vec<Name>,
    /// Folder of what was measured so far, a file a cell; delete it to measure anew.
    #[arg(long, default_value = "data/report", value_name = "DIR")]
    pub(crate) cells: PathBuf,
    /// Folder of the data sets that nearest neighbours look into; generated on first use.
    #[arg(long, default_value = "data", value_name = "DIR")]
    pub(crate) data: PathBuf,
    /// Summary of the ablation sweep: the summary.toml that `train sweep merge` writes, copied here.
    #[arg(long, default_value = "data/sweep.toml", value_name = "FILE")]
    pub(crate) sweep: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(Args, Debug)]
pub(crate) struct CheckArgs {
    /// Folder of the report.
    #[arg(default_value = "report", value_name = "DIR")]
    pub(crate) report: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct AgreeArgs {
    /// Folder of what the first run has measured: its --cells.
    #[arg(value_name = "FIRST")]
    pub(crate) first: PathBuf,
    /// That of the second.
    #[arg(value_name = "SECOND")]
    pub(crate) second: PathBuf,
}
