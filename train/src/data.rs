//! The data sets, generated where they are absent.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use dataset::{Config, Dataset, Generated, MANIFEST, generate, open_as};

use crate::cli::{DataArgs, threads_or_cores};
use terminal::say;

/// Opens a data set; generates it, or what is missing of it, if need be.
pub(crate) fn open(directory: &Path, config: &Config, quiet: bool) -> Result<Dataset> {
    if !directory.join(MANIFEST).exists() {
        if !quiet {
            say!("generating the data set {}, once and for all", directory.display())?;
        }
        with_progress(directory, config, None, quiet)?;
    }
    open_as(directory, config).context("--data")
}

/// `train data`.
pub(crate) fn generate_part(args: &DataArgs) -> Result<()> {
    rayon::ThreadPoolBuilder::new().num_threads(threads_or_cores(args.threads)).build_global()?;
    let (config, directory) = args.set.config(args.scenario);
    let begin = Instant::now();
    let made = with_progress(&directory, &config, args.shard, false)?;
    say!(
        "{}: {} shards written, {} were there, in {:.1} s; {}",
        directory.display(),
        made.written,
        made.kept,
        begin.elapsed().as_secs_f64(),
        if made.manifest.is_some() { "the data set is complete" } else { "other parts are missing" }
    )
}

fn with_progress(directory: &Path, config: &Config, part: Option<(usize, usize)>, quiet: bool) -> Result<Generated> {
    let bar = terminal::bar(0, "trajectories", quiet)?;
    let made = generate(directory, config, part, &|made| {
        bar.set_length(made.total as u64);
        bar.set_position(made.done as u64);
    });
    bar.finish_and_clear();
    made.context("--data")
}
