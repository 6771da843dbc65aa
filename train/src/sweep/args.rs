//! Flags of `train sweep`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use copingnet::Backend;
use dataset::Scenario;
use terminal::{shard, threads};

use crate::cli::{Recipe, SetArgs, whole};

#[derive(Debug, Subcommand)]
pub(crate) enum SweepCommand {
    /// Put the cells of all shards together in summary.toml.
    Merge(MergeArgs),
}

/// `train sweep` and `train sweep merge`.
#[derive(Args, Debug)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct SweepArgs {
    #[command(subcommand)]
    pub(crate) command: Option<SweepCommand>,
    /// Kinds of scenes: rod, helix.
    #[arg(long, value_delimiter = ',', default_value = "rod,helix")]
    pub(crate) scenario: Vec<Scenario>,
    /// paper or best.
    #[arg(long, value_enum, default_value_t = Recipe::Paper)]
    pub(crate) recipe: Recipe,
    /// Seeds of the networks, one network each.
    #[arg(long, value_delimiter = ',', default_value = "0,1", allow_hyphen_values = true,
        value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub(crate) seed: Vec<u64>,
    /// Times through the training samples, for every cell.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) epochs: u64,
    /// Samples in a batch. Small ones make the most of a small budget: two epochs of 8 reach what six of 32 do.
    #[arg(long, default_value_t = 8, value_parser = whole)]
    pub(crate) batch: usize,
    /// Simulations of 100 steps to measure on, for each cell [default: 50].
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub(crate) simulations: Option<u64>,
    /// A small grid of small networks: shows in a minute or two what a sweep does.
    #[arg(long)]
    pub(crate) quick: bool,
    /// What computes the networks in training: ndarray; flex, wgpu or cuda where built with that cargo feature.
    #[arg(long, default_value_t = Backend::default())]
    pub(crate) backend: Backend,
    #[command(flatten)]
    pub(crate) set: SetArgs,
    /// Folder of the sweep. Shards on one file system may share it.
    #[arg(long, value_name = "DIR", default_value = "sweep")]
    pub(crate) out: PathBuf,
    /// Do the i-th of every n cells alone, from 0/n to (n - 1)/n: for the jobs of an array.
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "0/1")]
    pub(crate) shard: (usize, usize),
    /// Threads [default: one a core].
    #[arg(long, value_parser = threads)]
    pub(crate) threads: Option<usize>,
    /// List the cells with their files, and whether they are done; train nothing and write nothing.
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// Print nothing but errors.
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// What to put together.
#[derive(Args, Debug)]
pub(crate) struct MergeArgs {
    /// Folders of sweeps with the same settings.
    #[arg(required = true, value_name = "DIR")]
    pub(crate) folders: Vec<PathBuf>,
    /// Where summary.toml goes [default: the first folder].
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Go on where cells are lost: they are left out, and the summary names them.
    #[arg(long)]
    pub(crate) partial: bool,
}
