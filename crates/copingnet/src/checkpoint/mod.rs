//! Checkpoints: trained networks in files, and training cut off.

mod card;
mod simulated;
mod state;
mod tensors;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use graph::Whitening;
use safetensors::Dtype;

pub use card::{Card, Leg, Measured, Training};
/// Why there is no checkpoint, or no training state.
pub use export::ExportError as CheckpointError;
pub use simulated::Simulated;
pub use state::TrainingState;

use crate::{Encoding, Features, Inputs, TensorSpec, Weights};
use card::Stored;
use tensors::{Tensor, Tensors};

/// A trained network with all that is needed to use it.
///
/// A checkpoint NAME is two files side by side:
///
/// - `NAME.safetensors`, the weights: each tensor of [`crate::NetworkConfig::tensors`] by its name, and the whitening as
///   `whitening.nodes.shift`, `whitening.nodes.scale` `[features]`, and so on for each of [`crate::Inputs`]; all F32,
///   finite;
/// - `NAME.toml`, the card: what the network reads and means, its sizes and norms, how it was trained and what was
///   measured of it ([`Card`]), the BLAKE3 hash of the weights' file, and a checksum of its own ([`export::seal`]).
///
/// Each file is complete or not there, and the weights come first: whatever is cut off between the two leaves a card
/// whose hash does not fit, or none. Sizes are checked against limits (width 1 to 4096, at most 64 GN blocks, 1 to 64
/// layers, at most 4096 scans) and against the tensors in the file before memory is taken for them. Whatever is done to
/// the files, loading gives one error that names the file, the key, its value and what is allowed.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Where it comes from and how good it is.
    pub card: Card,
    /// How inputs are made and outputs read.
    pub encoding: Encoding,
    /// The network's sizes and parameters.
    pub weights: Weights,
}

/// A checkpoint's two files.
struct Files {
    card: PathBuf,
    weights: PathBuf,
}

impl Files {
    /// From the name, or the path of either file.
    fn of(path: &Path) -> Self {
        let is_file = path.extension().is_some_and(|end| end == "toml" || end == "safetensors");
        let name = if is_file { path.with_extension("") } else { path.to_owned() };
        let with = |end: &str| {
            let mut file = OsString::from(&name);
            file.push(end);
            PathBuf::from(file)
        };
        Self { card: with(".toml"), weights: with(".safetensors") }
    }
}

impl Checkpoint {
    /// Reads and checks the checkpoint of this name; `path` may also be that of either file.
    ///
    /// # Errors
    /// If a file cannot be read, is damaged, foreign, or of another version, or the two do not belong together.
    pub fn load(path: &Path) -> Result<Self, CheckpointError> {
        let [card, weights] = Self::contents(path)?;
        Self::from_bytes(path, &card, &weights)
    }

    /// The contents of the checkpoint's files, the card's and the weights', unchecked.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn contents(path: &Path) -> Result<[Vec<u8>; 2], CheckpointError> {
        let files = Files::of(path);
        let read = |file: &Path| std::fs::read(file).map_err(CheckpointError::io("read", file));
        Ok([read(&files.card)?, read(&files.weights)?])
    }

    /// As [`Checkpoint::load`], with the files' contents in memory; `name` is for errors.
    ///
    /// # Errors
    /// As [`Checkpoint::load`].
    pub fn from_bytes(name: impl AsRef<Path>, card: &[u8], weights: &[u8]) -> Result<Self, CheckpointError> {
        Self::read(&Files::of(name.as_ref()), card, weights)
    }

    /// Writes both files. Nothing is written that would not load again.
    ///
    /// # Errors
    /// If a value is not allowed, or a file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), CheckpointError> {
        let files = Files::of(path);
        let weights = tensors::to_bytes(&self.tensors()).map_err(CheckpointError::io("write", &files.weights))?;
        let stored = Stored::new(
            &self.card,
            &self.encoding,
            *self.weights.config(),
            blake3::hash(&weights).to_hex().to_string(),
        );
        stored.check(&files.card)?;
        let card = export::seal(&stored).map_err(CheckpointError::io("write", &files.card))?;
        Self::read(&files, card.as_bytes(), &weights)?;
        for (file, bytes) in [(&files.weights, weights.as_slice()), (&files.card, card.as_bytes())] {
            export::write_atomically(file, |out| std::io::Write::write_all(out, bytes))?;
        }
        Ok(())
    }

    fn tensors(&self) -> Vec<Tensor> {
        let weights = self.weights.tensors().map(|(spec, values)| Tensor::f32s(&spec.name, spec.shape.clone(), values));
        let whitening = NAMES.iter().zip(self.encoding.whitening.all()).flat_map(|(name, whitening)| {
            [("shift", &whitening.shift), ("scale", &whitening.scale)]
                .map(|(part, values)| Tensor::f32s(&format!("whitening.{name}.{part}"), vec![values.len()], values))
        });
        weights.chain(whitening).collect()
    }

    fn read(files: &Files, card: &[u8], weights: &[u8]) -> Result<Self, CheckpointError> {
        let stored = Stored::read(&files.card, card)?;
        let found = blake3::hash(weights).to_hex();
        if found.as_str() != stored.weights_blake3 {
            let allowed =
                format!("{} by {}: it is damaged or another one", stored.weights_blake3, files.card.display());
            return Err(CheckpointError::value(&files.weights, "blake3", found, allowed));
        }
        let tensors = Tensors::open(&files.weights, weights)?;
        let mut specs = stored.network.tensors();
        specs.extend(whitening_specs(stored.features));
        tensors.check(&specs)?;

        let mut weights = Weights::zeros(stored.network);
        for (spec, values) in weights.tensors_mut() {
            values.copy_from_slice(&finite(&tensors, &spec.name)?);
        }
        let of = |k: usize| {
            let part = |part: &str| finite(&tensors, &format!("whitening.{}.{part}", NAMES[k]));
            Ok::<_, CheckpointError>(Whitening { shift: part("shift")?, scale: part("scale")? })
        };
        let whitening = Inputs { nodes: of(0)?, constant_nodes: of(1)?, edges: of(2)?, constant_edges: of(3)? };
        let encoding = Encoding { features: stored.features, head: stored.head, norms: stored.norms, whitening };
        Ok(Self { card: stored.into_card(), encoding, weights })
    }
}

/// The whitening's parts in the order of [`Inputs::all`].
const NAMES: [&str; 4] = ["nodes", "constant_nodes", "edges", "constant_edges"];

fn whitening_specs(features: Features) -> Vec<TensorSpec> {
    let parts = NAMES.into_iter().zip(features.channels().all().map(|channels| channels.len()));
    parts
        .flat_map(|(name, features)| {
            ["shift", "scale"]
                .map(|part| TensorSpec { name: format!("whitening.{name}.{part}"), shape: vec![features] })
        })
        .collect()
}

/// Values of a tensor, none of them infinite or NaN.
fn finite(tensors: &Tensors, name: &str) -> Result<Vec<f32>, CheckpointError> {
    let values: Vec<f32> = tensors.values(name, Dtype::F32, f32::from_le_bytes)?;
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(values),
        Some(k) => Err(tensors.wrong(&format!("{name}[{k}]"), values[k], "finite")),
    }
}
