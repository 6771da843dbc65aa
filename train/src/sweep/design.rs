//! What the cells of a sweep are, and the training of each.

use anyhow::{Result, bail};
use dataset::{Dataset, MANIFEST, Scenario, Split};
use evaluation::ablation::{Architecture, Budget, Grid, Key, SCHEMA_VERSION, Source, Sweep, Test};

use super::args::SweepArgs;
use super::folder::Folder;
use crate::cli::{Plan, Recipe, Schedule, TrainArgs};
use crate::data;

/// Seed of the scenes to measure on; the data sets have another.
const TEST_SEED: u64 = 1;
/// Measurements on validation scenes in each training, of which the best weights are kept.
const MEASUREMENTS: u64 = 3;

/// The paper's grid (supplement, section "Architecture").
fn grid() -> Grid {
    Grid {
        gn_blocks: vec![1, 2, 3, 4, 5],
        widths: vec![8, 16, 32, 64],
        mlp_layers: vec![1, 2, 3, 4],
        benchmark: Architecture::BENCHMARK,
    }
}

/// A small one.
fn quick_grid() -> Grid {
    Grid {
        gn_blocks: vec![1, 2],
        widths: vec![4, 8],
        mlp_layers: vec![1, 2],
        benchmark: Architecture { gn_blocks: 1, mlp_layers: 2, width: 8 },
    }
}

impl SweepArgs {
    /// Checks what clap cannot.
    pub(crate) fn check(&self) -> Result<()> {
        if self.recipe == Recipe::Step {
            bail!("--recipe step: it starts whole steps, but a sweep is about linear solves: paper or best");
        }
        let name = |scenario: &Scenario| scenario.to_string();
        for (flag, values) in [
            ("--scenario", self.scenario.iter().map(name).collect::<Vec<_>>()),
            ("--seed", self.seed.iter().map(u64::to_string).collect()),
        ] {
            if let Some(twice) = values.iter().enumerate().find(|(k, value)| values[..*k].contains(value)) {
                bail!("{flag}: {} is given twice", twice.1);
            }
        }
        Ok(())
    }

    /// The sweep. Data sets that are absent are generated, but not for a dry run.
    pub(crate) fn sweep(&self) -> Result<Sweep> {
        let sources = self.scenario.iter().map(|&scenario| self.source(scenario)).collect::<Result<_>>()?;
        let plan = self.settings(self.recipe, self.epochs).plan()?;
        let budget = Budget {
            recipe: self.recipe.name().to_owned(),
            features: plan.features.name().to_owned(),
            head: plan.head.name().to_owned(),
            loss: plan.loss.name().to_owned(),
            scans: plan.network.scans,
            epochs: self.epochs,
            batch: plan.batch,
            learning_rate: plan.learning_rate,
            schedule: plan.schedule.name().to_owned(),
            measure_every: plan.measure_every,
            validation_scenes: plan.scenes,
            backend: plan.backend.to_string(),
        };
        let (simulations, steps) = if self.quick { (4, 30) } else { (50, 100) };
        Ok(Sweep {
            schema_version: SCHEMA_VERSION,
            seeds: self.seed.clone(),
            grid: if self.quick { quick_grid() } else { grid() },
            budget,
            test: Test { seed: TEST_SEED, simulations: self.simulations.unwrap_or(simulations), steps },
            sources,
        })
    }

    /// The training of a cell.
    pub(crate) fn plan(&self, scenario: Scenario, key: &Key, folder: &Folder) -> Result<Plan> {
        let Architecture { gn_blocks, mlp_layers, width } = key.architecture;
        let settings = TrainArgs {
            scenario,
            gn_blocks: Some(gn_blocks),
            mlp_layers: Some(mlp_layers),
            width: Some(width),
            seed: key.seed,
            out: Some(folder.training(key)),
            ..self.settings(self.recipe, key.budget.epochs)
        };
        settings.plan()
    }

    /// What all trainings have in common.
    fn settings(&self, recipe: Recipe, epochs: u64) -> TrainArgs {
        let scenario = self.scenario.first().copied().unwrap_or(Scenario::Rod);
        TrainArgs {
            epochs: Some(epochs),
            batch: Some(self.batch),
            // With a constant step size the weights after a small budget are whatever the last batches made of them.
            schedule: Some(Schedule::Cosine),
            threads: self.threads,
            backend: self.backend,
            measure_every: epochs.div_ceil(MEASUREMENTS),
            ..TrainArgs::new(scenario, recipe, self.set.clone())
        }
    }

    fn source(&self, scenario: Scenario) -> Result<Source> {
        let (config, directory) = self.set.config(scenario);
        if self.dry_run && !directory.join(MANIFEST).exists() {
            bail!(
                "--data: the data set {} is not there, and a dry run makes none; `train data` does",
                directory.display()
            );
        }
        Ok(source(scenario, &data::open(&directory, &config, self.quiet)?))
    }
}

/// What a network learns from.
fn source(scenario: Scenario, dataset: &Dataset) -> Source {
    let mut hasher = blake3::Hasher::new();
    for shard in &dataset.manifest().shards {
        hasher.update(shard.blake3.as_bytes());
    }
    let mut counts = [0, 0];
    for trajectory in dataset.trajectories(Split::Train) {
        let samples = trajectory.samples().filter(|sample| sample.iteration() == 0).count() as u64;
        counts = [counts[0] + samples, counts[1] + samples * trajectory.graph().nodes().len() as u64];
    }
    Source {
        scenario: scenario.to_string(),
        data_blake3: hasher.finalize().to_hex().to_string(),
        samples: counts[0],
        nodes: counts[1],
    }
}
