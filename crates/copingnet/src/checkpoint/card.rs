//! The card: what a checkpoint says of itself, and how that stands in its file.

use std::path::Path;

use export::ExportError as CheckpointError;
use graph::Norms;
use serde::{Deserialize, Serialize};

use super::simulated::Simulated;
use crate::{Encoding, Features, Head, NetworkConfig, Output};

/// Version of the card and of the weights' file.
const SCHEMA_VERSION: u32 = 1;

/// Where a network comes from and how good it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Card {
    /// Version of the program that trained it.
    pub program_version: String,
    /// The program's source revision, where it was found ([`export::git_revision`]).
    pub git_revision: Option<String>,
    /// What it was trained for: "rod", "helix".
    pub scenario: String,
    /// Name of the recipe: "paper", "best".
    pub recipe: String,
    /// BLAKE3 hash of the data set's manifest, in hexadecimal digits; none where trajectories were made in passing.
    pub data_blake3: Option<String>,
    /// How the data were simulated; `None` in cards of older programs.
    pub simulated: Option<Simulated>,
    /// How it was trained.
    pub training: Training,
    /// The trainings before, the first one first: each began with the weights that the one before it had left.
    pub before: Vec<Leg>,
    /// What was measured on validation scenes.
    pub measured: Vec<Measured>,
}

impl Card {
    /// All trainings that made the weights, the first one first.
    pub fn trainings(&self) -> impl Iterator<Item = &Training> {
        self.before.iter().map(|leg| &leg.training).chain([&self.training])
    }

    /// How long they took altogether [s].
    pub fn seconds(&self) -> f64 {
        self.trainings().map(|training| training.seconds).sum()
    }

    /// The card's training as an earlier one of those that begin with its weights (by the BLAKE3 hash of their file), and
    /// those before it.
    pub fn into_legs(self, weights_blake3: String) -> Vec<Leg> {
        let Self { git_revision, data_blake3, training, mut before, .. } = self;
        before.push(Leg { weights_blake3, git_revision, data_blake3, training });
        before
    }
}

/// An earlier training, with whose weights a later one began.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Leg {
    /// BLAKE3 hash of the file of the weights that it left.
    pub weights_blake3: String,
    /// As [`Card::git_revision`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub git_revision: Option<String>,
    /// As [`Card::data_blake3`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub data_blake3: Option<String>,
    /// How it was trained.
    pub training: Training,
}

/// How a network was trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Seed of weights and order, at most 2^63 - 1.
    pub seed: u64,
    /// Trajectories of the training data; `None` in cards of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trajectories: Option<usize>,
    /// Steps of each; `None` in cards of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<usize>,
    /// Passes through the data.
    pub epochs: usize,
    /// Samples a step.
    pub batch: usize,
    /// Name of the loss.
    pub loss: String,
    /// Learning rate at the start.
    pub learning_rate: f64,
    /// How the learning rate changes.
    pub schedule: String,
    /// Name of the backend.
    pub backend: String,
    /// Threads.
    pub threads: usize,
    /// Time it took [s].
    pub seconds: f64,
    /// The command line.
    pub command: String,
}

/// What starts from the network come to with one solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// The preconditioner's name.
    pub preconditioner: String,
    /// Relative tolerance of the linear solves.
    pub tolerance: f64,
    /// Which steps of which scenes.
    pub steps: String,
    /// Iterations from the network's start over those from zero.
    pub ratio: f64,
}

/// A card as it stands in its file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stored {
    schema_version: u32,
    program_version: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    git_revision: Option<String>,
    scenario: String,
    recipe: String,
    pub(super) features: Features,
    pub(super) head: Head,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    data_blake3: Option<String>,
    pub(super) weights_blake3: String,
    pub(super) network: NetworkConfig,
    pub(super) norms: Norms,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    simulated: Option<Simulated>,
    training: Training,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    before: Vec<Leg>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    measured: Vec<Measured>,
}

impl Stored {
    /// Of a checkpoint's parts, and the hash of its weights' file.
    pub(super) fn new(card: &Card, encoding: &Encoding, network: NetworkConfig, weights_blake3: String) -> Self {
        let card = card.clone();
        Self {
            schema_version: SCHEMA_VERSION,
            program_version: card.program_version,
            git_revision: card.git_revision,
            scenario: card.scenario,
            recipe: card.recipe,
            features: encoding.features,
            head: encoding.head,
            data_blake3: card.data_blake3,
            weights_blake3,
            network,
            norms: encoding.norms,
            simulated: card.simulated,
            training: card.training,
            before: card.before,
            measured: card.measured,
        }
    }

    pub(super) fn into_card(self) -> Card {
        Card {
            program_version: self.program_version,
            git_revision: self.git_revision,
            scenario: self.scenario,
            recipe: self.recipe,
            data_blake3: self.data_blake3,
            simulated: self.simulated,
            training: self.training,
            before: self.before,
            measured: self.measured,
        }
    }

    /// Reads and checks the text of `file`.
    pub(super) fn read(file: &Path, bytes: &[u8]) -> Result<Self, CheckpointError> {
        let stored: Self = export::unseal(file, bytes, SCHEMA_VERSION)?;
        stored.check(file)?;
        Ok(stored)
    }

    pub(super) fn check(&self, file: &Path) -> Result<(), CheckpointError> {
        self.check_network(file)?;
        self.simulated.as_ref().map_or(Ok(()), |simulated| simulated.check(file))?;
        self.check_numbers(file)?;
        if let Some(hash) = self.data_blake3.as_ref().filter(|hash| blake3::Hash::from_hex(hash).is_err()) {
            let value = format!("{hash:?}");
            return Err(CheckpointError::value(file, "data_blake3", value, "64 hexadecimal digits"));
        }
        Ok(())
    }

    fn check_network(&self, file: &Path) -> Result<(), CheckpointError> {
        let wrong = |key: &str, value: &dyn ToString, allowed: String| {
            Err(CheckpointError::value(file, key, value.to_string(), allowed))
        };
        if !self.head.fits(self.features) {
            let (head, features) = (self.head.name(), self.features.name());
            let fitting: Vec<String> = Head::ALL
                .into_iter()
                .filter(|head| head.fits(self.features))
                .map(|head| format!("\"{}\"", head.name()))
                .collect();
            let allowed = format!("{} with features \"{features}\"", fitting.join(" or "));
            return wrong("head", &format!("\"{head}\""), allowed);
        }
        let network = &self.network;
        let limits = [
            ("network.gn_blocks", network.gn_blocks, 0..=64),
            ("network.mlp_layers", network.mlp_layers, 1..=64),
            ("network.width", network.width, 1..=4096),
            ("network.scans", network.scans, 0..=4096),
        ];
        for (key, value, limits) in limits {
            if !limits.contains(&value) {
                return wrong(key, &value, format!("{} to {}", limits.start(), limits.end()));
            }
        }
        let fitting = self.features.configure(self.head, *network);
        let sizes = [
            ("network.node_inputs", network.node_inputs, fitting.node_inputs),
            ("network.constant_node_inputs", network.constant_node_inputs, fitting.constant_node_inputs),
            ("network.edge_inputs", network.edge_inputs, fitting.edge_inputs),
            ("network.constant_edge_inputs", network.constant_edge_inputs, fitting.constant_edge_inputs),
            ("network.node_outputs", network.node_outputs, fitting.node_outputs),
            ("network.edge_outputs", network.edge_outputs, fitting.edge_outputs),
        ];
        if let Some((key, found, allowed)) = sizes.into_iter().find(|(_, found, allowed)| found != allowed) {
            return wrong(key, &found, format!("{allowed}, by features and head"));
        }
        let name = |output| if output == Output::Tanh { "tanh" } else { "linear" };
        if network.output != fitting.output {
            let allowed = format!("\"{}\", by features", name(fitting.output));
            return wrong("network.output", &format!("\"{}\"", name(network.output)), allowed);
        }
        Ok(())
    }

    fn check_numbers(&self, file: &Path) -> Result<(), CheckpointError> {
        let (norms, training) = (&self.norms, &self.training);
        if i64::try_from(training.seed).is_err() {
            return Err(CheckpointError::value(file, "training.seed", training.seed, format!("at most {}", i64::MAX)));
        }
        // Only the paper's outputs are multiplied with norms.
        let norms_are_read = self.features == Features::Paper;
        let mut numbers: Vec<(String, f64, bool)> = [
            ("norms.dx_m", norms.dx, norms_are_read),
            ("norms.dphi_rad", norms.dphi, norms_are_read),
            ("norms.dlambda_stretch_n_s2", norms.dlambda_stretch, norms_are_read),
            ("norms.dlambda_bend_n_m2_s2", norms.dlambda_bend, norms_are_read),
            ("training.learning_rate", training.learning_rate, true),
            ("training.seconds", training.seconds, false),
        ]
        .map(|(key, number, positive)| (key.to_owned(), number, positive))
        .into();
        for (k, leg) in self.before.iter().enumerate() {
            numbers.push((format!("before[{k}].training.learning_rate"), leg.training.learning_rate, true));
            numbers.push((format!("before[{k}].training.seconds"), leg.training.seconds, false));
        }
        for (k, measured) in self.measured.iter().enumerate() {
            numbers.push((format!("measured[{k}].tolerance"), measured.tolerance, true));
            numbers.push((format!("measured[{k}].ratio"), measured.ratio, false));
        }
        let is_allowed =
            |number: f64, positive: bool| number.is_finite() && number >= 0.0 && (!positive || number > 0.0);
        match numbers.into_iter().find(|&(_, number, positive)| !is_allowed(number, positive)) {
            None => Ok(()),
            Some((key, number, positive)) => {
                let allowed = if positive { "finite and > 0" } else { "finite and >= 0" };
                Err(CheckpointError::value(file, key, number, allowed))
            }
        }
    }
}
