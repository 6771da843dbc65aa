//! The manifest, and the entries that say of each shard that it is finished.
//!
//! Both are TOML with a checksum in front ([`export::seal`]).

use std::collections::BTreeMap;
use std::path::Path;

use graph::Norms;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::config::{Config, Scenario, Split};
use crate::layout::Counts;
use crate::{DatasetError, SCHEMA_VERSION};

/// Name of the manifest's file.
pub const MANIFEST: &str = "manifest.toml";

/// What a data set is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of the format, [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Version of the program that generated it.
    pub program_version: String,
    /// The program's source revision, where it was found when the set was finished.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub git_revision: Option<String>,
    /// Formulation of the projection, "xpbd".
    pub formulation: String,
    /// What was generated.
    pub config: Config,
    /// Range of every parameter of the scenes.
    pub ranges: BTreeMap<String, [f64; 2]>,
    /// Largest magnitudes over the training samples.
    pub norms: Norms,
    /// Numbers of the training split.
    pub train: Numbers,
    /// Numbers of the validation split.
    pub validation: Numbers,
    /// The files, training first.
    pub shards: Vec<ShardInfo>,
}

/// How much there is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Numbers {
    /// Trajectories.
    pub trajectories: usize,
    /// Samples: outer iterations.
    pub samples: usize,
    /// Segments of all samples.
    pub sample_segments: usize,
    /// Joints of all samples.
    pub sample_joints: usize,
    /// Steps that ended at the cap on iterations.
    pub unconverged_steps: usize,
}

/// One file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShardInfo {
    /// Its name.
    pub file: String,
    /// What it belongs to.
    pub split: Split,
    /// Index of its first trajectory.
    pub first_trajectory: u64,
    /// Its size in bytes.
    pub bytes: usize,
    /// BLAKE3 hash of the file.
    pub blake3: String,
    /// What is in it.
    pub numbers: Numbers,
}

/// A finished shard, in a file beside it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Entry {
    pub(crate) schema_version: u32,
    pub(crate) program_version: String,
    pub(crate) config: Config,
    pub(crate) norms: Norms,
    pub(crate) shard: ShardInfo,
}

impl Numbers {
    pub(crate) fn new(counts: Counts, unconverged_steps: usize) -> Self {
        Self {
            trajectories: counts.trajectories,
            samples: counts.samples,
            sample_segments: counts.sample_segments,
            sample_joints: counts.sample_joints,
            unconverged_steps,
        }
    }

    /// The sum.
    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            trajectories: self.trajectories.saturating_add(other.trajectories),
            samples: self.samples.saturating_add(other.samples),
            sample_segments: self.sample_segments.saturating_add(other.sample_segments),
            sample_joints: self.sample_joints.saturating_add(other.sample_joints),
            unconverged_steps: self.unconverged_steps.saturating_add(other.unconverged_steps),
        }
    }
}

impl Manifest {
    /// Number of samples and more of a split.
    pub fn numbers(&self, split: Split) -> Numbers {
        match split {
            Split::Train => self.train,
            Split::Validation => self.validation,
        }
    }

    /// Reads and checks the manifest of the data set in `directory`.
    ///
    /// # Errors
    /// If there is none, or it is damaged, foreign, or of another version.
    pub fn read(directory: &Path) -> Result<Self, DatasetError> {
        let file = directory.join(MANIFEST);
        let manifest: Self = read_sealed(&file)?;
        manifest.check(&file)?;
        Ok(manifest)
    }

    /// The manifest of finished shards, in order.
    pub(crate) fn of(config: &Config, entries: &[Entry], git_revision: Option<String>) -> Self {
        let mut norms = Norms::default();
        let mut numbers = [Numbers::default(); 2];
        for entry in entries {
            let split = &mut numbers[entry.shard.split as usize];
            *split = split.plus(entry.shard.numbers);
            if entry.shard.split == Split::Train {
                norms = norms.union(entry.norms);
            }
        }
        Self {
            schema_version: SCHEMA_VERSION,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            git_revision,
            formulation: config.step().formulation.name().to_owned(),
            config: config.clone(),
            ranges: config.scenario.ranges(),
            norms,
            train: numbers[Split::Train as usize],
            validation: numbers[Split::Validation as usize],
            shards: entries.iter().map(|entry| entry.shard.clone()).collect(),
        }
    }

    fn check(&self, file: &Path) -> Result<(), DatasetError> {
        let wrong = |key: &str, value: String, allowed: String| Err(DatasetError::value(file, key, value, allowed));
        self.config.check().map_err(|error| match error {
            DatasetError::Setting { key, value, allowed } => {
                DatasetError::value(file, format!("config.{key}"), value, allowed)
            }
            other => other,
        })?;
        let formulation = self.config.step().formulation.name();
        if self.formulation != formulation {
            return wrong("formulation", format!("\"{}\"", self.formulation), format!("\"{formulation}\""));
        }
        let norms = [
            ("norms.dx_m", self.norms.dx),
            ("norms.dphi_rad", self.norms.dphi),
            ("norms.dlambda_stretch_n_s2", self.norms.dlambda_stretch),
            ("norms.dlambda_bend_n_m2_s2", self.norms.dlambda_bend),
        ];
        if let Some((key, value)) = norms.into_iter().find(|(_, x)| !(x.is_finite() && *x >= 0.0)) {
            return wrong(key, value.to_string(), "finite and >= 0".to_owned());
        }
        let plans = self.config.shards();
        if self.shards.len() != plans.len() {
            return wrong("number of shards", self.shards.len().to_string(), format!("{}, by config", plans.len()));
        }
        let mut sums = [Numbers::default(); 2];
        for (k, (shard, plan)) in self.shards.iter().zip(&plans).enumerate() {
            let key = |name: &str| format!("shards[{k}].{name}");
            if shard.file != plan.file() {
                return wrong(&key("file"), format!("\"{}\"", shard.file), format!("\"{}\"", plan.file()));
            }
            if (shard.split, shard.first_trajectory) != (plan.split, plan.first) {
                let value = format!("{}, from trajectory {}", shard.split.name(), shard.first_trajectory);
                let allowed = format!("{}, from trajectory {}", plan.split.name(), plan.first);
                return wrong(&key("split"), value, allowed);
            }
            if shard.numbers.trajectories != plan.trajectories {
                let (value, allowed) = (shard.numbers.trajectories.to_string(), plan.trajectories.to_string());
                return wrong(&key("numbers.trajectories"), value, allowed);
            }
            let sum = &mut sums[shard.split as usize];
            *sum = sum.plus(shard.numbers);
        }
        for split in Split::ALL {
            let (found, sum) = (self.numbers(split), sums[split as usize]);
            if found != sum {
                return wrong(split.name(), format!("{found:?}"), format!("{sum:?}, the sum over its shards"));
            }
        }
        let scenario: Scenario = self.config.scenario;
        if self.ranges != scenario.ranges() {
            return wrong("ranges", format!("{:?}", self.ranges), format!("{:?}", scenario.ranges()));
        }
        Ok(())
    }
}

/// Reads what [`export::seal`] has made of a manifest or an entry.
pub(crate) fn read_sealed<T: DeserializeOwned>(file: &Path) -> Result<T, DatasetError> {
    let bytes = std::fs::read(file).map_err(DatasetError::io("read", file))?;
    Ok(export::unseal(file, &bytes, SCHEMA_VERSION).map_err(export::ExportError::from)?)
}
