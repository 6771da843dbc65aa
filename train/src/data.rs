//! The data sets, generated where they are absent.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use dataset::{Config, Dataset, Generated, MANIFEST, Scenario, generate, open_as};

use crate::plan::{SetArgs, threads_or_cores};
use terminal::{say, shard, threads};

/// Which data set to generate.
#[derive(Args, Debug)]
pub(crate) struct DataArgs {
    /// Which of the paper's scenarios: rod, helix (Table 1), knot, tree.
    #[arg(long, default_value_t = Scenario::Rod)]
    pub(crate) scenario: Scenario,
    #[command(flatten)]
    pub(crate) set: SetArgs,
    /// Part i of n, from 0/n to (n - 1)/n: for the jobs of an array that share a folder. Whichever finds all parts there
    /// writes the manifest; the files have the same bits as those of a single job.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub(crate) shard: Option<(usize, usize)>,
    /// Threads [default: one a core]. The files have the same bits on any number.
    #[arg(long, value_parser = threads)]
    pub(crate) threads: Option<usize>,
}

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
