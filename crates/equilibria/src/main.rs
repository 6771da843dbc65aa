//! `equilibria`: answers queries for the shapes of cables from a file. See `equilibria --help`.

mod branched_command;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, ensure};
use clap::{Args, Parser, Subcommand, ValueEnum};
use equilibria::branched::BranchedQuery;
use equilibria::branched::sample::BranchedDistribution;
use equilibria::file::{self, AnswerWriter};
use equilibria::learned::Learned;
use equilibria::sample::Distribution;
use equilibria::start::{Curves, Starts};
use equilibria::{Params, Query, solve_from};
use terminal::{Progress, complain, say, shard, threads};

/// Exit code of bad input.
const BAD_INPUT: u8 = 2;
/// Rows that are answered between two looks at Ctrl-C.
const CHUNK: usize = 8192;

/// Answers many questions at once: which shape does this cable take between these two grips?
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    answer: AnswerArgs,
}

#[derive(Subcommand)]
enum Command {
    /// Draw random queries.
    Sample(SampleArgs),
    /// Answer questions about cables with three arms: which shape do they take between three grips?
    Branched(branched_command::BranchedArgs),
}

#[derive(Args)]
struct AnswerArgs {
    /// The queries: a CSV or safetensors file, a row a query (docs/equilibria.md has the columns).
    queries: Option<PathBuf>,
    /// The folder to write answers.csv and shapes.safetensors to.
    #[arg(long, default_value = "out/equilibria")]
    out: PathBuf,
    /// Equal segments in which each cable is cut.
    #[arg(long, default_value_t = Params::default().segments)]
    segments: usize,
    /// Error that is left: of turns [rad], of moments over EI / L, of the gap at the end over L.
    #[arg(long, default_value_t = Params::default().tolerance)]
    tolerance: f64,
    /// Where searches begin. curves: two curves, each with both of the two least twists. learned: where a small network says that
    /// the lowest equilibrium is; rows unlike those of its training begin at the curves.
    #[arg(long, value_enum, default_value_t = Start::Curves)]
    start: Start,
    /// Write all equilibria that are found, not the lowest alone.
    #[arg(long)]
    branches: bool,
    /// Answer part i of n of the rows, from 0/n to (n - 1)/n: rows i, i + n, ...
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "0/1")]
    shard: (usize, usize),
    /// Threads; the answers are the same on any number.
    #[arg(long, value_parser = threads)]
    threads: Option<usize>,
    /// No progress.
    #[arg(long)]
    quiet: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Start {
    Curves,
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
    /// The file to write.
    #[arg(long, default_value = "out/queries.csv")]
    out: PathBuf,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match &cli.command {
        Some(Command::Sample(args)) => sample(args),
        Some(Command::Branched(args)) => branched_command::answer(args),
        None => answer(&cli.answer),
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
    let text = if args.branched {
        let distribution = BranchedDistribution::default();
        let queries: Vec<BranchedQuery> = (0..args.count).map(|k| distribution.query(args.seed, k)).collect();
        equilibria::branched::file::text(&queries)
    } else {
        let queries: Vec<Query> = (0..args.count).map(|k| distribution.query(args.seed, k)).collect();
        file::text(&queries)
    };
    if let Some(folder) = args.out.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).with_context(|| format!("--out: cannot create {}", folder.display()))?;
    }
    export::write_atomically(&args.out, |out| std::io::Write::write_all(out, text.as_bytes())).context("--out")?;
    say!("{} queries in {}", args.count, args.out.display())?;
    Ok(ExitCode::SUCCESS)
}

fn answer(args: &AnswerArgs) -> Result<ExitCode> {
    let path = args.queries.as_ref().context("there is no file of queries; `equilibria sample` makes one")?;
    let params =
        Params { segments: args.segments, tolerance: args.tolerance, branches: args.branches, ..Params::default() };
    params.validate().map_err(|error| anyhow!("--{error}"))?;
    if let Some(count) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(count).build_global()?;
    }
    let name = path.display().to_string();
    let cannot = || format!("cannot read {name}");
    let all = match path.extension() {
        Some(extension) if extension == "safetensors" => {
            file::read_tensors(&std::fs::read(path).with_context(cannot)?, &name)?
        }
        _ => file::read(&std::fs::read_to_string(path).with_context(cannot)?, &name)?,
    };
    let (part, parts) = args.shard;
    let rows: Vec<(usize, file::Row)> = all.into_iter().enumerate().filter(|(row, _)| row % parts == part).collect();
    std::fs::create_dir_all(&args.out).with_context(|| format!("--out: cannot create {}", args.out.display()))?;
    let suffix = if parts == 1 { String::new() } else { format!("-{part}-of-{parts}") };
    let mut writer = AnswerWriter::create(&args.out, &suffix, params.segments).context("--out")?;
    let starts: Box<dyn Starts> = match args.start {
        Start::Curves => Box::new(Curves::all()),
        Start::Learned => Box::new(Learned::default()),
    };
    let progress = Progress::new(rows.len(), "queries", args.quiet)?;
    let (mut done, mut found, mut seconds) = (0, 0, 0.0);
    for chunk in rows.chunks(CHUNK) {
        let queries: Vec<Query> = chunk.iter().filter_map(|(_, query)| query.as_ref().ok().copied()).collect();
        let begin = Instant::now();
        let mut answers = solve_from(&queries, &params, starts.as_ref())?.into_iter();
        seconds += begin.elapsed().as_secs_f64();
        for (row, query) in chunk {
            let answer = match query {
                Ok(_) => answers.next().context("an answer a query")?.map_err(|error| error.to_string()),
                Err(message) => Err(message.clone()),
            };
            found += usize::from(answer.is_ok());
            writer.add(*row, &answer).context("--out")?;
        }
        done += chunk.len();
        if !progress.advance_by(chunk.len()) {
            break;
        }
    }
    let interrupted = progress.finish();
    writer.finish().context("--out")?;
    if !args.quiet {
        let rate = done as f64 / f64::max(seconds, f64::MIN_POSITIVE);
        say!("{found} of {done} queries answered in {seconds:.3} s, {rate:.0} a second: {}", args.out.display())?;
    }
    Ok(if interrupted { ExitCode::from(terminal::INTERRUPTED) } else { ExitCode::SUCCESS })
}
