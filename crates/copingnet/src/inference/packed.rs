//! A network's weights, laid out for the kernels.

use std::ops::Range;

use pulp::Arch;

use super::layer::Layer;
use super::scan::Decays;
use crate::config::{NetworkConfig, TensorSpec};
use crate::weights::Weights;

/// A network's weights in panels for the machine's vector registers.
#[derive(Debug)]
pub struct Packed {
    config: NetworkConfig,
    pub(super) arch: Arch,
    pub(super) node_encoder: Encoder,
    pub(super) edge_encoder: Encoder,
    /// Where edges have constant inputs only: the first block's part for an edge's own row, and the bias.
    pub(super) first_edges: Option<Layer>,
    pub(super) blocks: Vec<Block>,
    pub(super) node_decoder: Vec<Layer>,
    pub(super) edge_decoder: Vec<Layer>,
}

/// A perceptron whose last inputs are constant.
#[derive(Debug)]
pub(super) struct Encoder {
    /// The first layer's part for constant inputs, and its bias.
    pub(super) constant: Layer,
    /// All layers, the first one for changing inputs only.
    pub(super) layers: Vec<Layer>,
}

/// Weights of a GN block.
#[derive(Debug)]
pub(super) struct Block {
    pub(super) edges: Vec<Layer>,
    /// Layer to (1 - a) u, and decays.
    pub(super) scan: Option<(Layer, Decays)>,
    pub(super) nodes: Vec<Layer>,
}

impl Packed {
    /// Packs `weights` for the machine that runs this.
    pub fn new(weights: &Weights) -> Self {
        Self::for_arch(weights, Arch::new())
    }

    /// Packs `weights` for one set of instructions.
    pub(super) fn for_arch(weights: &Weights, arch: Arch) -> Self {
        let config = *weights.config();
        let (width, scans) = (config.width, config.scans);
        let mut reader = Reader { config, arch, tensors: weights.tensors() };
        let node_encoder = reader.encoder(config.node_inputs, config.constant_node_inputs);
        let edge_encoder = reader.encoder(config.edge_inputs, config.constant_edge_inputs);
        let mut first_edges = None;
        let blocks = (0..config.gn_blocks).map(|k| {
            let apart = if k == 0 && config.has_constant_edges() { 0..width } else { 0..0 };
            let parts = [width - apart.len(), width, width];
            let (own, edges) = reader.split(apart.clone(), &parts, width);
            if !apart.is_empty() {
                first_edges = Some(own);
            }
            let scan = (scans > 0).then(|| reader.scan());
            let nodes = reader.perceptron(&[width, width, width, 2 * scans], width);
            Block { edges, scan, nodes }
        });
        let blocks = blocks.collect();
        let node_decoder = reader.perceptron(&[width], config.node_outputs);
        let edge_decoder = match config.edge_outputs {
            0 => Vec::new(),
            outputs => reader.perceptron(&[width], outputs),
        };
        Self { config, arch, node_encoder, edge_encoder, first_edges, blocks, node_decoder, edge_decoder }
    }

    /// Sizes of the network.
    pub fn config(&self) -> &NetworkConfig {
        &self.config
    }

    /// Lines of the longest row that goes into a layer or comes out of one.
    pub(super) fn lines(&self) -> usize {
        let encoders = [&self.node_encoder, &self.edge_encoder].into_iter();
        let blocks = self.blocks.iter().flat_map(|block| {
            block.edges.iter().chain(&block.nodes).chain(block.scan.as_ref().map(|(layer, _)| layer))
        });
        let layers = encoders.flat_map(|encoder| encoder.layers.iter().chain([&encoder.constant])).chain(blocks);
        layers.chain(&self.node_decoder).chain(&self.edge_decoder).map(Layer::lines).max().unwrap_or(0)
    }
}

/// Takes a network's tensors one after the other.
struct Reader<T> {
    config: NetworkConfig,
    arch: Arch,
    tensors: T,
}

impl<'a, T: Iterator<Item = (&'a TensorSpec, &'a [f32])>> Reader<T> {
    fn next(&mut self) -> &'a [f32] {
        self.tensors.next().map_or(&[], |(_, values)| values)
    }

    /// A perceptron whose inputs come in parts of so many columns.
    fn perceptron(&mut self, parts: &[usize], outputs: usize) -> Vec<Layer> {
        self.split(0..0, parts, outputs).1
    }

    fn encoder(&mut self, inputs: usize, constant: usize) -> Encoder {
        let changing = inputs - constant;
        let (constant, layers) = self.split(changing..inputs, &[changing], self.config.width);
        Encoder { constant, layers }
    }

    /// A perceptron and, apart from it, the first layer's part for some of the inputs; `parts` are the columns of the
    /// others. The first layer's bias is in both.
    fn split(&mut self, apart: Range<usize>, parts: &[usize], outputs: usize) -> (Layer, Vec<Layer>) {
        let inputs = apart.len() + parts.iter().sum::<usize>();
        let sizes = self.config.mlp(inputs, outputs);
        let (weights, bias) = (self.next(), self.next());
        let rows = apart.start * bias.len()..apart.end * bias.len();
        let others = [&weights[..rows.start], &weights[rows.end..]].concat();
        let mut layers = vec![Layer::new(self.arch, parts, &others, bias)];
        for &[inputs, _] in &sizes[1..] {
            let (weights, bias) = (self.next(), self.next());
            layers.push(Layer::new(self.arch, &[inputs], weights, bias));
        }
        (Layer::new(self.arch, &[apart.len()], &weights[rows], bias), layers)
    }

    /// Layer to (1 - a) u, and decays a.
    fn scan(&mut self) -> (Layer, Decays) {
        let (weights, bias, decays) = (self.next(), self.next(), self.next());
        let decays: Vec<f64> = decays.iter().map(|&d| 1.0 / (1.0 + (-f64::from(d)).exp())).collect();
        let scaled = |values: &[f32]| -> Vec<f32> {
            values.iter().zip(decays.iter().cycle()).map(|(&x, a)| (f64::from(x) * (1.0 - a)) as f32).collect()
        };
        let layer = Layer::new(self.arch, &[self.config.width], &scaled(weights), &scaled(bias));
        let decays: Vec<f32> = decays.iter().map(|&a| a as f32).collect();
        (layer, Decays::new(&decays))
    }
}
