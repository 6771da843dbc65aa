//! Flags and subcommands.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Args, CommandFactory, FromArgMatches, Parser};

use crate::commands::compare::CompareArgs;
use crate::commands::random::{GuessesArgs, StepsArgs};
use crate::commands::stress::StressArgs;
use crate::sections::SECTIONS;

/// Measures solvers, guesses and networks, and makes a report of it: one HTML page and its numbers as CSV files.
#[derive(Debug, Parser)]
#[command(version)]
pub(crate) enum Command {
    /// Measure whatever is not measured yet, and write the report.
    Report(ReportArgs),
    /// Look for faults in a report: broken links, figures without conditions or numbers.
    Check {
        /// Folder of the report.
        #[arg(default_value = "report", value_name = "DIR")]
        report: PathBuf,
    },
    /// Hold what two runs have measured against each other: all but times must be the same.
    Agree {
        /// Folder of what the first run has measured: its --cells.
        first: PathBuf,
        /// That of the second.
        second: PathBuf,
    },
    /// Run a scene with several solvers and guesses: iterations, time by stage, error against a tight reference.
    Compare(CompareArgs),
    /// Measure guesses on the paper's random scenes: iterations and time relative to a zero start, by step.
    Guesses(GuessesArgs),
    /// Measure starts of whole steps on random scenes, slack ones too: outer iterations and time (formulation newton).
    Steps(StepsArgs),
    /// Run the stability table: stiff, slack, tiny, huge and degenerate rods, each with its status.
    Stress(StressArgs),
}

impl Command {
    /// Reads the command line. Beside the commands above each section has one of its own: `evaluate knot` is
    /// `evaluate report --only knot --out out/knot`.
    pub(crate) fn read() -> Self {
        let mut command = Self::command();
        for section in &SECTIONS {
            let own = ReportArgs::augment_args(clap::Command::new(section.name).about(section.about));
            command = command.subcommand(own.mut_arg("only", |only| only.hide(true)));
        }
        let matches = command.get_matches();
        let own = matches.subcommand().filter(|(name, _)| SECTIONS.iter().any(|section| section.name == *name));
        let read = match own {
            Some((name, own)) => ReportArgs::from_arg_matches(own).map(|args| {
                let out = args.out.or_else(|| Some(PathBuf::from("out").join(name)));
                Self::Report(ReportArgs { only: vec![name.to_owned()], out, ..args })
            }),
            None => Self::from_arg_matches(&matches),
        };
        read.unwrap_or_else(|error| error.exit())
    }
}

/// Names of the sections, for `--only`.
fn names() -> PossibleValuesParser {
    SECTIONS.iter().map(|section| PossibleValue::new(section.name).help(section.about)).into()
}

#[derive(Args, Debug)]
pub(crate) struct ReportArgs {
    /// Fewer scenes, simulations and steps: done in minutes, where the full report takes three to four hours of one core.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Folder of the report [default: report; where a section has the command, out/SECTION].
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Only these sections.
    #[arg(long, value_delimiter = ',', value_name = "SECTIONS", value_parser = names())]
    pub(crate) only: Vec<String>,
    /// Part i of n of what is measured, from 0/n to (n - 1)/n, of about the same time: for processes that share the folder of
    /// cells. Cells with the same references stay together. Whichever process finds all cells there makes the report.
    #[arg(long, value_name = "I/N", value_parser = terminal::shard, default_value = "0/1")]
    pub(crate) shard: (usize, usize),
    /// Folder of what was measured so far, a file a cell; what other sources measured is measured anew.
    #[arg(long, default_value = "data/report", value_name = "DIR")]
    pub(crate) cells: PathBuf,
    /// Folder of the data sets that nearest neighbours look into; generated on first use.
    #[arg(long, default_value = "data", value_name = "DIR")]
    pub(crate) data: PathBuf,
    /// Summary of the ablation sweep: the summary.toml that `train sweep merge` writes, copied here.
    #[arg(long, default_value = "data/sweep.toml", value_name = "FILE")]
    pub(crate) sweep: PathBuf,
    /// Folder with a folder of recordings for each real cable, `train` and `eval` in it: what the section real-cables measures.
    #[arg(long, value_name = "DIR")]
    pub(crate) recordings: Option<PathBuf>,
    /// Print nothing but errors.
    #[arg(long)]
    pub(crate) quiet: bool,
}
