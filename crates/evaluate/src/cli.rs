//! Flags and subcommands.

use std::path::PathBuf;

use clap::{Args as _, CommandFactory, FromArgMatches, Parser};

use crate::commands::benchmark::BenchmarkArgs;
use crate::commands::compare::CompareArgs;
use crate::commands::laws::RandomArgs;
use crate::commands::random::{GuessesArgs, StepsArgs};
use crate::commands::stress::StressArgs;
use crate::make::ReportArgs;
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
    /// Run fourteen experiments with a known result, from the catenary to extremes of stiffness, and show each error.
    Benchmark(BenchmarkArgs),
    /// Draw scenes at random, and hold their runs against laws of mechanics: momentum, energy, friction, passing, restart.
    Random(RandomArgs),
}

impl Command {
    /// Reads the command line. Beside the commands above each section has one of its own: `evaluate knot` is
    /// `evaluate report --only knot --out out/knot`.
    pub(crate) fn read() -> Self {
        let mut command = Self::command();
        for section in &SECTIONS {
            let own = ReportArgs::augment_args(clap::Command::new(section.name).about(section.about));
            let own = own.mut_arg("only", |only| only.hide(true)).mut_arg("first_page", |flag| flag.hide(true));
            command = command.subcommand(own);
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
