//! Answers the rows of a file, of any problem.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use equilibria::Params;
use equilibria::file::{self, AnswerWriter, Tabled};
use equilibria::start::Starts;
use terminal::{Progress, say, shard, threads};

/// Rows that are answered between two looks at Ctrl-C.
const CHUNK: usize = 8192;

/// What cables of both kinds have flags for.
#[derive(Args)]
pub(crate) struct AnswerArgs {
    /// The folder to write answers.csv and shapes.safetensors to.
    #[arg(long, default_value = "out/equilibria")]
    out: PathBuf,
    /// Error that is left: of turns [rad], of moments over EI / L, of gaps over L.
    #[arg(long, default_value_t = Params::default().tolerance)]
    tolerance: f64,
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

/// Answers the rows of a file from these starts; segments and levels are those of `params`.
///
/// # Errors
/// If a flag or the file is not allowed, or the answers cannot be written. A row that cannot be has its own error in the answers.
pub(crate) fn answer<P: Tabled>(
    path: &Path,
    args: &AnswerArgs,
    params: Params,
    starts: &dyn Starts<P>,
) -> Result<ExitCode> {
    let mut params = Params { tolerance: args.tolerance, branches: args.branches, ..params };
    // A level must not be finer than the cable.
    params.levels.retain(|&level| level <= params.segments);
    params.validate().map_err(|error| anyhow!("--{error}"))?;
    if let Some(count) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(count).build_global()?;
    }
    let (part, parts) = args.shard;
    let rows: Vec<_> = file::read::<P>(path)?.into_iter().enumerate().filter(|(row, _)| row % parts == part).collect();
    std::fs::create_dir_all(&args.out).with_context(|| format!("--out: cannot create {}", args.out.display()))?;
    let suffix = if parts == 1 { String::new() } else { format!("-{part}-of-{parts}") };
    let mut writer = AnswerWriter::<P>::create(&args.out, &suffix, params.segments).context("--out")?;
    let progress = Progress::new(rows.len(), "queries", args.quiet)?;
    let (mut done, mut found, mut seconds) = (0, 0, 0.0);
    for chunk in rows.chunks(CHUNK) {
        let queries: Vec<P::Query> = chunk.iter().filter_map(|(_, query)| query.as_ref().ok().copied()).collect();
        let begin = Instant::now();
        let mut answers = P::solve_from(&queries, &params, starts)?.into_iter();
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
