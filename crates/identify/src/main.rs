//! `identify`: from recordings of a cable to its numbers. See `identify --help`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, bail};
use clap::{Parser, Subcommand};
use identify::branched::Tree;
use identify::kind::{Clamped, Plain};
use identify::noodle::is_noodle;
use identify::recording::{Grips, files, is_flat};
use terminal::{complain, positive, threads};

mod hanging_command;
mod identification;
mod video_command;

/// Exit code of bad input.
const BAD_INPUT: u8 = 2;

/// Identifies a cable between two grips from recordings of markers along it, and predicts further recordings. It may have branches;
/// or one clamp holds it, whose pose is recorded.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Recordings to identify the cable on: files, or folders of files that end in .pkl or .csv.
    recordings: Vec<PathBuf>,
    /// Recordings to predict with what was found: of them the first two frames and the grips are used, nothing else.
    #[arg(long, num_args = 1..)]
    eval: Vec<PathBuf>,
    /// Takes the parameters from the result.json of another identification instead of searching for them.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["hold", "free", "law"])]
    from: Option<PathBuf>,
    /// The folder to write to.
    #[arg(long, default_value = "out/identify")]
    out: PathBuf,
    /// Segments between two markers; of a noodle, segments in all.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=100))]
    segments: Option<u16>,
    /// Steps from frame to frame.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1000))]
    steps: Option<u16>,
    /// Predicts again with so many times the steps, and with so many times the segments, and tells by how much predictions change.
    #[arg(long, value_name = "TIMES", value_parser = clap::value_parser!(u16).range(2..=10))]
    refine: Option<u16>,
    /// Frames a second of files that do not say it: 100 unless given, with --from as in its result.
    #[arg(long, value_parser = positive)]
    rate: Option<f64>,
    /// Unit of length of the files [m], 0.001 for millimetres: 1 unless given, with --from as in its result.
    #[arg(long, value_parser = positive)]
    unit_m: Option<f64>,
    /// The markers of the parent of a cable with branches that are held and given: 0,1,-2,-1 (default), or M,-2,-1 where the first grip
    /// holds it at marker M.
    #[arg(long, value_name = "MARKERS", allow_hyphen_values = true)]
    grips: Option<Grips>,
    /// Holds a parameter at a value, as in twist=0.7, instead of searching for it.
    #[arg(long, value_name = "NAME=VALUE")]
    hold: Vec<String>,
    /// Searches for a further parameter, as drag-across.
    #[arg(long, value_name = "NAME")]
    free: Vec<String>,
    /// Searches for a law of the joints that is not elastic, too: friction between strands, or relaxation. Takes several times as long.
    #[arg(long, value_parser = ["hysteresis", "viscoelastic"])]
    law: Option<String>,
    /// Threads; the result is the same on any number.
    #[arg(long, value_parser = threads)]
    threads: Option<usize>,
    /// No progress.
    #[arg(long)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Command {
    Hanging(hanging_command::Hanging),
    Video(video_command::Video),
}

fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(code) => code,
        Err(error) => {
            complain(format_args!("{error:#}"));
            ExitCode::from(BAD_INPUT)
        }
    }
}

fn run(cli: &Cli) -> Result<ExitCode> {
    match &cli.command {
        Some(Command::Video(video)) => return video.run().map(|()| ExitCode::SUCCESS),
        Some(Command::Hanging(hanging)) => return hanging.run().map(|()| ExitCode::SUCCESS),
        None => {}
    }
    if let Some(count) = cli.threads {
        rayon::ThreadPoolBuilder::new().num_threads(count).build_global()?;
    }
    let places: Vec<PathBuf> = cli.recordings.iter().chain(&cli.eval).cloned().collect();
    // The first says of which kind all are; another kind is told where it is read.
    match files(&places)?.first() {
        None => bail!("there are no recordings: name files, or folders of files that end in .pkl or .csv"),
        Some(path) if cli.grips.is_some() && !is_flat(path) => bail!(
            "--grips: {} is not of a cable with branches; of other cables the first two and the last two markers are held",
            path.display()
        ),
        Some(path) if is_noodle(path) => identification::run::<Clamped>(cli),
        Some(path) if is_flat(path) => identification::run::<Tree>(cli),
        Some(_) => identification::run::<Plain>(cli),
    }
}
