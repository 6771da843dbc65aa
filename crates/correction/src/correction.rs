//! A correction: networks whose mean says what to add.

use std::io::Write;
use std::path::Path;

use burn::tensor::Device;
use copingnet::{Backend, GraphTensors, Network, NetworkConfig, Output, Weights};
use export::{ExportError, SealedError, seal, unseal, write_atomically};
use graph::Batch;
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::film::{Film, Guess};
use crate::inputs::{Inputs, Kind, Sizes};

/// Version of the file.
const SCHEMA: u32 = 1;
/// Frames that go through a network at once.
const TOGETHER: usize = 64;

/// Sizes of the networks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    /// Width of all layers.
    pub width: usize,
    /// GN blocks; a perceptron has none.
    pub blocks: usize,
    /// Scans along the cable, each way, in every block.
    pub scans: usize,
}

impl Shape {
    /// The usual one.
    pub fn of(kind: Kind) -> Self {
        match kind {
            Kind::Graph => Self { width: 32, blocks: 2, scans: 8 },
            Kind::Perceptron => Self { width: 128, blocks: 0, scans: 0 },
        }
    }

    /// The network for so many markers.
    pub fn network(&self, kind: Kind, markers: usize, free: usize) -> NetworkConfig {
        let sizes = Sizes::of(kind, markers);
        NetworkConfig {
            node_inputs: sizes.node,
            constant_node_inputs: 0,
            edge_inputs: sizes.edge,
            constant_edge_inputs: 0,
            node_outputs: if kind == Kind::Graph { 3 } else { 3 * free },
            edge_outputs: 0,
            gn_blocks: self.blocks,
            mlp_layers: 2,
            width: self.width,
            scans: self.scans,
            output: Output::Tanh,
        }
    }
}

/// What is added to a guess of a cable's markers.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// What is corrected.
    pub guess: Guess,
    /// How frames are read.
    pub kind: Kind,
    /// Markers of the cable.
    pub markers: usize,
    /// Largest correction of a coordinate [m].
    pub bound: f64,
    /// Mean of each input of a node and its inverse spread.
    pub scale: [Vec<f32>; 2],
    /// Networks, whose mean counts.
    pub members: Vec<Weights>,
}

/// What a file holds.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema_version: u32,
    guess: String,
    kind: String,
    markers: usize,
    bound_m: f64,
    scale: [Vec<f32>; 2],
    members: Vec<Vec<f32>>,
    network: NetworkConfig,
}

/// Frames as tensors.
pub(crate) fn tensors(kind: Kind, inputs: &[&Inputs], scale: &[Vec<f32>; 2], scans: bool, to: &Device) -> GraphTensors {
    let columns = scale[0].len();
    let nodes: usize = inputs.iter().map(|inputs| inputs.nodes.len()).sum::<usize>() / columns;
    let each = nodes / inputs.len().max(1);
    let scaled = inputs.iter().flat_map(|inputs| &inputs.nodes).enumerate();
    let scaled: Vec<f32> = scaled.map(|(i, x)| (x - scale[0][i % columns]) * scale[1][i % columns]).collect();
    match kind {
        Kind::Graph => {
            let edges: Vec<f32> = inputs.iter().flat_map(|inputs| &inputs.edges).copied().collect();
            GraphTensors::new(&Batch::chains(inputs.len(), each), &scaled, &edges, scans, to)
        }
        // One edge, from the first to the second frame, of which blocks that are not there make nothing.
        Kind::Perceptron => GraphTensors::new(&Batch::chains(1, nodes), &scaled, &vec![0.0; nodes - 1], false, to),
    }
}

impl Correction {
    /// What to add to the free markers of a film [m]: `added[frame][marker]`.
    pub fn add(&self, film: &Film) -> Vec<Vec<Vector3<f64>>> {
        let device = Backend::default().device();
        let frames: Vec<usize> = (0..film.time.len()).collect();
        let chunks: Vec<Vec<Vec<Vector3<f64>>>> =
            frames.par_chunks(TOGETHER).map(|frames| self.add_frames(film, frames, &device)).collect();
        chunks.into_iter().flatten().collect()
    }

    fn add_frames(&self, film: &Film, frames: &[usize], device: &Device) -> Vec<Vec<Vector3<f64>>> {
        // A perceptron's frames are a chain, which takes two.
        let twice = [frames[0], frames[0]];
        let frames_or_two = if frames.len() == 1 { &twice[..] } else { frames };
        let inputs: Vec<Inputs> = frames_or_two.iter().map(|&frame| Inputs::of(self.kind, film, frame)).collect();
        let listed: Vec<&Inputs> = inputs.iter().collect();
        let mut sum: Vec<f64> = Vec::new();
        for weights in &self.members {
            let scans = weights.config().scans > 0;
            let graph = tensors(self.kind, &listed, &self.scale, scans, device);
            let (nodes, _) = Network::new(weights, device).forward(&graph);
            let found = nodes.into_data();
            sum.resize(found.num_elements(), 0.0);
            sum.iter_mut().zip(found.iter::<f32>()).for_each(|(sum, x)| *sum += f64::from(x));
        }
        let each = sum.len() / inputs.len();
        let share = self.bound / self.members.len().max(1) as f64;
        let of = |(k, inputs): (usize, &Inputs)| -> Vec<Vector3<f64>> {
            let own = &sum[k * each..(k + 1) * each];
            let skipped = if self.kind == Kind::Graph { film.free.start } else { 0 };
            let free = own.chunks_exact(3).skip(skipped).take(film.free.len());
            free.map(|x| inputs.axes.tr_mul(&Vector3::new(x[0], x[1], x[2])) * (share * inputs.share)).collect()
        };
        inputs.iter().enumerate().take(frames.len()).map(of).collect()
    }

    /// Writes it.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn write(&self, path: &Path) -> Result<(), ExportError> {
        let network = self.members.first().map_or_else(NetworkConfig::default, |weights| *weights.config());
        let file = File {
            schema_version: SCHEMA,
            guess: self.guess.name().to_owned(),
            kind: self.kind.name().to_owned(),
            markers: self.markers,
            bound_m: self.bound,
            scale: self.scale.clone(),
            members: self.members.iter().map(|weights| weights.values().to_vec()).collect(),
            network,
        };
        write_atomically(path, |out| out.write_all(seal(&file)?.as_bytes()))
    }

    /// Reads it back.
    ///
    /// # Errors
    /// With the file, and what is wrong in it.
    pub fn read(path: &Path) -> Result<Self, String> {
        let named = |message: String| format!("{}: {message}", path.display());
        let bytes = std::fs::read(path).map_err(|error| named(error.to_string()))?;
        let file: File = unseal(path, &bytes, SCHEMA).map_err(|error: SealedError| error.to_string())?;
        let member = |values: &Vec<f32>| {
            let mut weights = Weights::zeros(file.network);
            let is_whole = weights.values().len() == values.len() && values.iter().all(|x| x.is_finite());
            is_whole.then(|| {
                weights.values_mut().copy_from_slice(values);
                weights
            })
        };
        let members: Option<Vec<Weights>> = file.members.iter().map(member).collect();
        let members = members.ok_or_else(|| named("its weights do not fit its network".to_owned()))?;
        if file.scale.iter().any(|list| list.len() != file.network.node_inputs) || members.is_empty() {
            return Err(named("its scale does not fit its network".to_owned()));
        }
        Ok(Self {
            guess: file.guess.parse().map_err(|allowed| named(format!("guess {:?}: {allowed}", file.guess)))?,
            kind: file.kind.parse().map_err(|allowed| named(format!("kind {:?}: {allowed}", file.kind)))?,
            markers: file.markers,
            bound: file.bound_m,
            scale: file.scale,
            members,
        })
    }
}
