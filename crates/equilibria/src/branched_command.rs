//! `equilibria branched`: answers queries for cables with three arms.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use clap::{Args, ValueEnum};
use equilibria::Params;
use equilibria::branched::file::{self, BranchedWriter};
use equilibria::branched::learned::LearnedStar;
use equilibria::branched::start::{StarStarts, Stars};
use equilibria::branched::{BranchedQuery, default_params, solve_from};
use terminal::{Progress, say, shard, threads};

use crate::CHUNK;

#[derive(Args)]
pub(crate) struct BranchedArgs {
    /// The queries: a CSV file, a row a query (docs/equilibria.md has the columns; `sample --branched` makes one).
    queries: PathBuf,
    /// The folder to write answers.csv and shapes.safetensors to.
    #[arg(long, default_value = "out/equilibria")]
    out: PathBuf,
    /// Equal segments in which each arm is cut.
    #[arg(long, default_value_t = default_params().segments)]
    segments: usize,
    /// Error that is left: of turns [rad], of moments over EI / L, of gaps over L.
    #[arg(long, default_value_t = default_params().tolerance)]
    tolerance: f64,
    /// Where searches begin. poses: two poses of the junction in each class of twist. learned: where a small network says that the
    /// lowest equilibrium is; rows unlike those of its training begin at the poses.
    #[arg(long, value_enum, default_value_t = Start::Poses)]
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
    Poses,
    Learned,
}

/// Answers the rows of a file.
///
/// # Errors
/// If a flag or the file is not allowed, or the answers cannot be written. A row that cannot be has its own error in the answers.
pub(crate) fn answer(args: &BranchedArgs) -> Result<ExitCode> {
    let BranchedArgs { segments, tolerance, branches, .. } = *args;
    // A level must not be finer than the arms.
    let levels = default_params().levels.into_iter().filter(|&level| level <= segments).collect();
    let params = Params { segments, levels, tolerance, branches, ..default_params() };
    params.validate().map_err(|error| anyhow!("--{error}"))?;
    if let Some(count) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(count).build_global()?;
    }
    let name = args.queries.display().to_string();
    let all =
        file::read(&std::fs::read_to_string(&args.queries).with_context(|| format!("cannot read {name}"))?, &name)?;
    let (part, parts) = args.shard;
    let rows: Vec<(usize, file::Row)> = all.into_iter().enumerate().filter(|(row, _)| row % parts == part).collect();
    std::fs::create_dir_all(&args.out).with_context(|| format!("--out: cannot create {}", args.out.display()))?;
    let suffix = if parts == 1 { String::new() } else { format!("-{part}-of-{parts}") };
    let mut writer = BranchedWriter::create(&args.out, &suffix, segments).context("--out")?;
    let starts: Box<dyn StarStarts> = match args.start {
        Start::Poses => Box::new(Stars::default()),
        Start::Learned => Box::new(LearnedStar::default()),
    };
    let progress = Progress::new(rows.len(), "queries", args.quiet)?;
    let (mut done, mut found, mut seconds) = (0, 0, 0.0);
    for chunk in rows.chunks(CHUNK) {
        let queries: Vec<BranchedQuery> = chunk.iter().filter_map(|(_, query)| query.as_ref().ok().copied()).collect();
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
