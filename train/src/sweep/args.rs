//! Flags of `train sweep`, and the sweep and the trainings that they stand for.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{Args, Subcommand};
use copingnet::Backend;
use dataset::{MANIFEST, Scenario, Split};
use evaluation::ablation::{Architecture, Budget, CellKey, Grid, SCHEMA_VERSION, Source, Sweep, Test};
use terminal::{shard, threads};

use super::folder::Folder;
use crate::data;
use crate::plan::{Plan, Recipe, Schedule, SetArgs, TrainArgs, whole};

/// Seed of the scenes to measure on; the data sets have another.
const TEST_SEED: u64 = 1;
/// Measurements on validation scenes in each training, of which the best weights are kept.
const MEASUREMENTS: u64 = 3;

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

impl SweepArgs {
    /// Checks what clap cannot.
    pub(crate) fn check(&self) -> Result<()> {
        if self.recipe == Recipe::Step {
            bail!("--recipe step: it starts whole steps, but a sweep is about linear solves: paper or best");
        }
        let scenarios: Vec<String> = self.scenario.iter().map(Scenario::to_string).collect();
        for (flag, values) in [("--scenario", scenarios), ("--seed", self.seed.iter().map(u64::to_string).collect())] {
            if let Some(twice) = values.iter().enumerate().find(|(k, value)| values[..*k].contains(value)) {
                bail!("{flag}: {} is given twice", twice.1);
            }
        }
        Ok(())
    }

    /// The sweep: the supplement's grid, or a small one. Data sets that are absent are generated, but not for a dry run.
    pub(crate) fn sweep(&self) -> Result<Sweep> {
        let grid = if self.quick {
            let benchmark = Architecture { gn_blocks: 1, mlp_layers: 2, width: 8 };
            Grid { gn_blocks: vec![1, 2], widths: vec![4, 8], mlp_layers: vec![1, 2], benchmark }
        } else {
            let (gn_blocks, mlp_layers) = (vec![1, 2, 3, 4, 5], vec![1, 2, 3, 4]);
            Grid { gn_blocks, widths: vec![8, 16, 32, 64], mlp_layers, benchmark: Architecture::BENCHMARK }
        };
        let (simulations, steps) = if self.quick { (4, 30) } else { (50, 100) };
        let plan = self.training().plan()?;
        Ok(Sweep {
            schema_version: SCHEMA_VERSION,
            seeds: self.seed.clone(),
            grid,
            budget: Budget {
                recipe: plan.recipe.name().to_owned(),
                features: plan.features.name().to_owned(),
                head: plan.head.name().to_owned(),
                loss: plan.loss.name().to_owned(),
                scans: plan.network.scans,
                epochs: plan.epochs,
                batch: plan.batch,
                learning_rate: plan.learning_rate,
                schedule: plan.schedule.name().to_owned(),
                measure_every: plan.measure_every,
                validation_scenes: plan.scenes,
                backend: plan.backend.to_string(),
            },
            test: Test { seed: TEST_SEED, simulations: self.simulations.unwrap_or(simulations), steps },
            sources: self.scenario.iter().map(|&scenario| self.source(scenario)).collect::<Result<_>>()?,
        })
    }

    /// The training of a cell.
    pub(crate) fn plan(&self, scenario: Scenario, key: &CellKey) -> Result<Plan> {
        let CellKey { architecture: Architecture { gn_blocks, mlp_layers, width }, seed, .. } = *key;
        let recipe = self.recipe.name();
        let name = format!("{scenario}-{recipe}-gn{gn_blocks}-mlp{mlp_layers}-width{width}-seed{seed}");
        let settings = TrainArgs {
            scenario,
            gn_blocks: Some(gn_blocks),
            mlp_layers: Some(mlp_layers),
            width: Some(width),
            seed,
            out: Some(Folder::new(&self.out).trainings().join(name)),
            ..self.training()
        };
        settings.plan()
    }

    /// What all trainings have in common.
    fn training(&self) -> TrainArgs {
        let scenario = self.scenario.first().copied().unwrap_or(Scenario::Rod);
        TrainArgs {
            epochs: Some(self.epochs),
            batch: Some(self.batch),
            // With a constant step size the weights after a small budget are whatever the last batches made of them.
            schedule: Some(Schedule::Cosine),
            threads: self.threads,
            backend: self.backend,
            measure_every: self.epochs.div_ceil(MEASUREMENTS),
            ..TrainArgs::new(scenario, self.recipe, self.set.clone())
        }
    }

    /// What the networks of a kind of scenes learn from.
    fn source(&self, scenario: Scenario) -> Result<Source> {
        let (config, directory) = self.set.config(scenario);
        if self.dry_run && !directory.join(MANIFEST).exists() {
            let directory = directory.display();
            bail!("--data: the data set {directory} is not there, and a dry run makes none; `train data` does");
        }
        let dataset = data::open(&directory, &config, self.quiet)?;
        let mut hasher = blake3::Hasher::new();
        for shard in &dataset.manifest().shards {
            hasher.update(shard.blake3.as_bytes());
        }
        let (mut samples, mut nodes) = (0, 0);
        for trajectory in dataset.trajectories(Split::Train) {
            let own = trajectory.samples().filter(|sample| sample.iteration() == 0).count() as u64;
            samples += own;
            nodes += own * trajectory.graph().nodes().len() as u64;
        }
        let data_blake3 = hasher.finalize().to_hex().to_string();
        Ok(Source { scenario: scenario.to_string(), data_blake3, samples, nodes })
    }
}
