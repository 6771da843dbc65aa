//! The networks that read frames, in burn: what all kinds have in common.

use burn::tensor::{Device, Gradients, Tensor};
use copingnet::{GraphTensors, Network, NetworkConfig, Output, Weights};
use graph::Batch;
use serde::{Deserialize, Serialize};

use crate::inputs::{Inputs, Kind, Sizes};
use crate::recurrent::{self, Recurrent};

/// Sizes of the networks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    /// Width of all layers.
    pub width: usize,
    /// GN blocks; only a graph network has any.
    pub blocks: usize,
    /// Scans along the cable, each way, in every block.
    pub scans: usize,
}

impl Shape {
    /// The usual one. A recurrent network has about as many parameters as a perceptron.
    pub fn of(kind: Kind) -> Self {
        match kind {
            Kind::Graph => Self { width: 32, blocks: 2, scans: 8 },
            Kind::Perceptron => Self { width: 128, blocks: 0, scans: 0 },
            Kind::Recurrent => Self { width: 80, blocks: 0, scans: 0 },
        }
    }
}

/// Which network reads a cable of so many markers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reader {
    /// How frames are read.
    pub kind: Kind,
    /// Sizes.
    pub shape: Shape,
    /// Markers of the cable.
    pub markers: usize,
    /// Those that are predicted.
    pub free: Vec<usize>,
}

impl Reader {
    /// The markers that it says something of.
    pub(crate) fn told(&self) -> Vec<usize> {
        match self.kind {
            Kind::Graph => (0..self.markers).collect(),
            Kind::Perceptron | Kind::Recurrent => self.free.clone(),
        }
    }

    /// The sizes of a network that reads frames one by one.
    fn config(&self) -> NetworkConfig {
        let sizes = Sizes::of(self.kind, self.markers);
        NetworkConfig {
            node_inputs: sizes.node,
            constant_node_inputs: 0,
            edge_inputs: sizes.edge,
            constant_edge_inputs: 0,
            node_outputs: if self.kind == Kind::Graph { 3 } else { 3 * self.told().len() },
            edge_outputs: 0,
            gn_blocks: self.shape.blocks,
            mlp_layers: 2,
            width: self.shape.width,
            scans: self.shape.scans,
            output: Output::Tanh,
        }
    }

    /// Inputs, width and outputs of a recurrent network.
    fn sizes(&self) -> recurrent::Sizes {
        let NetworkConfig { node_inputs: inputs, width, node_outputs: outputs, .. } = self.config();
        recurrent::Sizes { inputs, width, outputs }
    }

    /// Number of its parameters.
    pub fn parameters(&self) -> usize {
        match self.kind {
            Kind::Recurrent => self.sizes().parameters(),
            Kind::Graph | Kind::Perceptron => Weights::zeros(self.config()).values().len(),
        }
    }

    /// Random parameters, the same for a seed on every machine.
    pub(crate) fn random(&self, seed: u64) -> Vec<f32> {
        match self.kind {
            Kind::Recurrent => self.sizes().random(seed),
            Kind::Graph | Kind::Perceptron => Weights::random(self.config(), seed).values().to_vec(),
        }
    }

    /// The network with these parameters.
    pub(crate) fn network(&self, parameters: &[f32], device: &Device) -> Net {
        match self.kind {
            Kind::Recurrent => Net::Sequence(Box::new(self.sizes().network(parameters, device))),
            Kind::Graph | Kind::Perceptron => {
                Net::Frames(self.config().init(device).set(parameters), self.shape.scans > 0)
            }
        }
    }
}

/// A network in burn.
pub(crate) enum Net {
    /// Each frame by itself, with scans or without.
    Frames(Network, bool),
    /// Frames in a row.
    Sequence(Box<Recurrent>),
}

/// Frames in a row, or a single one.
pub(crate) type Row<'a> = &'a [Inputs];

/// A frame of a row, which goes on with its last.
fn at<'a>(row: Row<'a>, k: usize) -> &'a Inputs {
    &row[k.min(row.len() - 1)]
}

impl Net {
    /// What it says of rows of frames, of which the longest is `longest`: row by row, frame by frame, in the grips' frame, as shares of
    /// the bound. Shorter rows are longer there, too: what is said beyond their end means nothing. `scale` is the mean of each input of a
    /// node and its inverse spread.
    pub(crate) fn forward(&self, rows: &[Row<'_>], longest: usize, scale: &[Vec<f32>; 2], to: &Device) -> Tensor<2> {
        let columns = scale[0].len();
        let scaled = |nodes: &[f32]| -> Vec<f32> {
            nodes.iter().enumerate().map(|(i, x)| (x - scale[0][i % columns]) * scale[1][i % columns]).collect()
        };
        match self {
            Self::Frames(network, has_scans) => {
                let frames: Vec<&Inputs> = rows.iter().flat_map(|row| (0..longest).map(move |k| at(row, k))).collect();
                let each = frames.first().map_or(1, |inputs| inputs.nodes.len() / columns);
                let nodes: Vec<f32> = frames.iter().flat_map(|inputs| scaled(&inputs.nodes)).collect();
                let edges: Vec<f32> = frames.iter().flat_map(|inputs| &inputs.edges).copied().collect();
                let chains = Batch::chains(frames.len(), each);
                network.forward(&GraphTensors::new(&chains, &nodes, &edges, *has_scans, to)).0
            }
            Self::Sequence(network) => {
                let step = |k: usize| rows.iter().flat_map(|row| scaled(&at(row, k).nodes)).collect();
                network.forward((0..longest).map(step), rows.len(), to)
            }
        }
    }

    /// The gradient by all parameters.
    pub(crate) fn gradients(&self, of: &Gradients) -> Vec<f32> {
        match self {
            Self::Frames(network, _) => network.gradients(of),
            Self::Sequence(network) => copingnet::parameters::gradients(network.as_ref(), of),
        }
    }
}
