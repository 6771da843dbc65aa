//! `equilibria`: answers queries for the shapes of cables from a file. See `equilibria --help`.

mod answering;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, ensure};
use clap::{Args, Parser, Subcommand, ValueEnum};
use equilibria::branched::learned::LearnedStar;
use equilibria::branched::sample::BranchedDistribution;
use equilibria::branched::start::Stars;
use equilibria::branched::{Star, default_params};
use equilibria::learned::Learned;
use equilibria::sample::Distribution;
use equilibria::start::{Curves, Starts};
use equilibria::{Params, Scaled, file};
use terminal::{complain, say};

use crate::answering::{AnswerArgs, answer};

/// Exit code of bad input.
const BAD_INPUT: u8 = 2;

/// Answers many questions at once: which shape does this cable take between these two grips?
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    single: SingleArgs,
}

#[derive(Subcommand)]
enum Command {
    /// Draw random queries.
    Sample(SampleArgs),
    /// Answer questions about cables with three arms: which shape do they take between three grips?
    Branched(BranchedArgs),
}

#[derive(Args)]
struct SingleArgs {
    /// The queries: a CSV or safetensors file, a row a query (docs/equilibria.md has the columns).
    queries: Option<PathBuf>,
    /// Equal segments in which each cable is cut.
    #[arg(long, default_value_t = Params::default().segments)]
    segments: usize,
    /// Where searches begin. curves: two curves, each with both of the two least twists. learned: where a small network says that
    /// the lowest equilibrium is; rows unlike those of its training begin at the curves.
    #[arg(long, value_enum, default_value_t = Start::Curves)]
    start: Start,
    #[command(flatten)]
    answer: AnswerArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum Start {
    Curves,
    Learned,
}

#[derive(Args)]
struct BranchedArgs {
    /// The queries: a CSV or safetensors file, a row a query (docs/equilibria.md has the columns; `sample --branched` makes one).
    queries: PathBuf,
    /// Equal segments in which each arm is cut.
    #[arg(long, default_value_t = default_params().segments)]
    segments: usize,
    /// Where searches begin. poses: two poses of the junction in each class of twist. learned: where a small network says that the
    /// lowest equilibrium is; rows unlike those of its training begin at the poses.
    #[arg(long, value_enum, default_value_t = BranchedStart::Poses)]
    start: BranchedStart,
    #[command(flatten)]
    answer: AnswerArgs,
}

#[derive(Clone, Copy, ValueEnum)]
enum BranchedStart {
    Poses,
    Learned,
}

#[derive(Args)]
struct SampleArgs {
    /// How many.
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    count: u64,
    /// The seed: query k is the same whatever the count.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Smallest and largest distance of the grips over the length.
    #[arg(long, num_args = 2, value_names = ["LEAST", "MOST"], default_values_t = Distribution::default().distance)]
    distance: Vec<f64>,
    /// Largest curvature at rest times the length.
    #[arg(long, default_value_t = 0.0)]
    curvature: f64,
    /// Largest weight that is carried, over B / L^2, anywhere on the cable.
    #[arg(long, default_value_t = 0.0)]
    carried: f64,
    /// Of cables with three arms, for `branched`.
    #[arg(long, conflicts_with_all = ["distance", "curvature", "carried"])]
    branched: bool,
    /// The file to write: CSV, or safetensors where it is called so.
    #[arg(long, default_value = "out/queries.csv")]
    out: PathBuf,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match &cli.command {
        Some(Command::Sample(args)) => sample(args),
        Some(Command::Branched(args)) => branched(args),
        None => single(&cli.single),
    };
    result.unwrap_or_else(|error| {
        complain(format_args!("{error:#}"));
        ExitCode::from(BAD_INPUT)
    })
}

fn sample(args: &SampleArgs) -> Result<ExitCode> {
    let [least, most] = args.distance[..] else { return Err(anyhow!("--distance must be two numbers")) };
    let is_range = 0.0 <= least && least <= most && most <= 1.0;
    ensure!(is_range, "--distance {least} {most}, but it must be two numbers from 0 to 1, the larger one last");
    let SampleArgs { curvature, carried, .. } = *args;
    for (flag, value) in [("--curvature", curvature), ("--carried", carried)] {
        ensure!((0.0..=1e3).contains(&value), "{flag} {value}, but it must be a number from 0 to 1000");
    }
    let distribution = Distribution { distance: [least, most], curvature, carried, ..Distribution::default() };
    let bytes = if args.branched {
        let distribution = BranchedDistribution::default();
        let queries: Vec<_> = (0..args.count).map(|k| distribution.query(args.seed, k)).collect();
        file::bytes::<Star>(&queries, &args.out)
    } else {
        let queries: Vec<_> = (0..args.count).map(|k| distribution.query(args.seed, k)).collect();
        file::bytes::<Scaled>(&queries, &args.out)
    };
    let bytes = bytes.context("--out")?;
    if let Some(folder) = args.out.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).with_context(|| format!("--out: cannot create {}", folder.display()))?;
    }
    export::write_atomically(&args.out, |out| std::io::Write::write_all(out, &bytes)).context("--out")?;
    say!("{} queries in {}", args.count, args.out.display())?;
    Ok(ExitCode::SUCCESS)
}

fn single(args: &SingleArgs) -> Result<ExitCode> {
    let path = args.queries.as_ref().context("there is no file of queries; `equilibria sample` makes one")?;
    let starts: &dyn Starts = match args.start {
        Start::Curves => &Curves::all(),
        Start::Learned => &Learned::default(),
    };
    answer(path, &args.answer, Params { segments: args.segments, ..Params::default() }, starts)
}

fn branched(args: &BranchedArgs) -> Result<ExitCode> {
    let starts: &dyn Starts<Star> = match args.start {
        BranchedStart::Poses => &Stars::default(),
        BranchedStart::Learned => &LearnedStar::default(),
    };
    answer(&args.queries, &args.answer, Params { segments: args.segments, ..default_params() }, starts)
}
