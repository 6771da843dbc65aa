//! The network on a batch of graphs.

use std::mem::swap;
use std::sync::Arc;

use graph::Batch;

use super::connections::Connections;
use super::layer::Layer;
use super::memory::{Rows, Table};
use super::packed::Packed;
use super::scan::Scan;
use super::sweep::{Scratch, Sink, Source, Sweep};

/// The network on one batch of graphs: connectivity, what constant inputs contribute, and memory.
///
/// With n nodes and m edges in the batch, all matrices are row by row, as [`Batch`] counts nodes and edges.
#[derive(Debug)]
pub struct Forward {
    packed: Arc<Packed>,
    connections: Connections,
    scratch: Scratch,
    /// What the first layer of the nodes' encoder begins with. `[n, width]`
    node_start: Table,
    /// The same of the edges' encoder or, where edges have constant inputs only, of the first block's edges. `[m, width]`
    edge_start: Table,
    /// The edges as the encoder gives them. `[m, width]`
    encoded_edges: Table,
    nodes: [Table; 2],
    edges: [Table; 2],
    /// E' of a block, and a row of zeros. `[m + 1, width]`
    messages: Table,
    /// H of a block. `[n, 2 scans]`
    scans: Table,
    node_outputs: Vec<f32>,
    edge_outputs: Vec<f32>,
}

impl Forward {
    /// Memory for a batch, with its constant inputs: `constant_nodes` `[n, constant_node_inputs]` and `constant_edges`
    /// `[m, constant_edge_inputs]`.
    ///
    /// # Panics
    ///
    /// Where inputs are more or fewer than that.
    pub fn new(packed: Arc<Packed>, graphs: &Batch, constant_nodes: &[f32], constant_edges: &[f32]) -> Self {
        let (config, n, m) = (*packed.config(), graphs.nodes(), graphs.edges());
        let table = |rows| Table::zeros(rows, config.width);
        let mut forward = Self {
            connections: Connections::new(graphs),
            scratch: Scratch::new(packed.lines()),
            node_start: table(n),
            edge_start: table(m),
            encoded_edges: table(m),
            nodes: [table(n), table(n)],
            edges: [table(m), table(m)],
            messages: table(m + 1),
            scans: Table::zeros(n, 2 * config.scans),
            node_outputs: vec![0.0; n * config.node_outputs],
            edge_outputs: vec![0.0; m * config.edge_outputs],
            packed,
        };
        forward.set_constants(constant_nodes, constant_edges);
        forward
    }

    /// Changes the constant inputs: `constant_nodes` `[n, constant_node_inputs]` and `constant_edges`
    /// `[m, constant_edge_inputs]`.
    ///
    /// # Panics
    ///
    /// Where inputs are more or fewer than that.
    pub fn set_constants(&mut self, constant_nodes: &[f32], constant_edges: &[f32]) {
        let Self { packed, connections, scratch, node_start, edge_start, encoded_edges, .. } = self;
        let (config, n, m) = (packed.config(), connections.nodes, connections.edges);
        let mut sweep = Sweeper { packed, scratch };
        let source = Source::plain(constant_nodes, n, config.constant_node_inputs);
        sweep.one(n, source, &packed.node_encoder.constant, node_start);
        let source = Source::plain(constant_edges, m, config.constant_edge_inputs);
        sweep.one(m, source, &packed.edge_encoder.constant, edge_start);
        if config.has_constant_edges() {
            sweep.run(m, &[], edge_start.rows(), &packed.edge_encoder.layers, Sink::Store(encoded_edges.rows_mut()));
            if let Some(layer) = &packed.first_edges {
                sweep.one(m, Source::Own(encoded_edges.rows()), layer, edge_start);
            }
        }
    }

    /// Computes the outputs: `nodes` `[n, node_inputs - constant_node_inputs]` and `edges`
    /// `[m, edge_inputs - constant_edge_inputs]` are the inputs that change. Allocates nothing.
    ///
    /// # Panics
    ///
    /// Where inputs are more or fewer than that.
    pub fn run(&mut self, nodes: &[f32], edges: &[f32]) {
        let Self { packed, connections, scratch, node_start, edge_start, encoded_edges, messages, scans, .. } = self;
        let (config, n, m) = (packed.config(), connections.nodes, connections.edges);
        let [v, v_next] = &mut self.nodes;
        let [e, e_next] = &mut self.edges;
        let (mut v, mut v_next, mut e, mut e_next) = (v, v_next, e, e_next);
        let mut sweep = Sweeper { packed, scratch };

        let inputs = Source::plain(nodes, n, config.node_inputs - config.constant_node_inputs);
        sweep.run(n, &[inputs], node_start.rows(), &packed.node_encoder.layers, Sink::Store(v.rows_mut()));
        if !config.has_constant_edges() {
            let inputs = Source::plain(edges, m, config.edge_inputs - config.constant_edge_inputs);
            sweep.run(
                m,
                &[inputs],
                edge_start.rows(),
                &packed.edge_encoder.layers,
                Sink::Store(encoded_edges.rows_mut()),
            );
        }

        for (k, block) in packed.blocks.iter().enumerate() {
            let old = if k == 0 { &*encoded_edges } else { &*e };
            let sources = [
                Source::Own(old.rows()),
                Source::At(v.rows(), &connections.senders),
                Source::At(v.rows(), &connections.receivers),
            ];
            let (sources, start) = match &packed.first_edges {
                Some(_) if k == 0 => (&sources[1..], edge_start.rows()),
                _ => (&sources[..], block.edges[0].bias()),
            };
            sweep.run(
                m,
                sources,
                start,
                &block.edges,
                Sink::Add { old: old.rows(), new: e_next.rows_mut(), change: Some(messages.rows_mut()) },
            );
            if let Some((layer, decays)) = &block.scan {
                sweep.one(n, Source::Own(v.rows()), layer, scans);
                let visits = &connections.visits;
                packed.arch.dispatch(Scan { decays, scans: config.scans, visits, rows: scans.rows_mut() });
            }
            let sums = [&connections.sent, &connections.received].map(|lists| Source::Sum(messages.rows(), lists));
            let sources = [Source::Own(v.rows()), sums[0], sums[1], Source::Own(scans.rows())];
            let sink = Sink::Add { old: v.rows(), new: v_next.rows_mut(), change: None };
            sweep.run(n, &sources, block.nodes[0].bias(), &block.nodes, sink);
            swap(&mut v, &mut v_next);
            swap(&mut e, &mut e_next);
        }

        let e = if packed.blocks.is_empty() { encoded_edges } else { e };
        let sink = Sink::Output(&mut self.node_outputs, config.node_outputs, config.output);
        sweep.run(n, &[Source::Own(v.rows())], packed.node_decoder[0].bias(), &packed.node_decoder, sink);
        let Some(first) = packed.edge_decoder.first() else { return };
        let sink = Sink::Output(&mut self.edge_outputs, config.edge_outputs, config.output);
        sweep.run(m, &[Source::Own(e.rows())], first.bias(), &packed.edge_decoder, sink);
    }

    /// Outputs of the nodes. `[n, node_outputs]`
    pub fn node_outputs(&self) -> &[f32] {
        &self.node_outputs
    }

    /// Outputs of the edges. `[m, edge_outputs]`
    pub fn edge_outputs(&self) -> &[f32] {
        &self.edge_outputs
    }
}

/// Runs sweeps with the machine's instructions.
struct Sweeper<'a> {
    packed: &'a Packed,
    scratch: &'a mut Scratch,
}

impl Sweeper<'_> {
    /// A perceptron.
    fn run(&mut self, rows: usize, sources: &[Source], start: Rows, layers: &[Layer], sink: Sink) {
        self.packed.arch.dispatch(Sweep { rows, sources, start, layers, sink, scratch: self.scratch });
    }

    /// A single layer.
    fn one(&mut self, rows: usize, source: Source, layer: &Layer, to: &mut Table) {
        self.run(rows, &[source], layer.bias(), std::slice::from_ref(layer), Sink::Store(to.rows_mut()));
    }
}

#[cfg(test)]
mod tests {
    use pulp::Arch;

    use super::*;
    use crate::{NetworkConfig, Weights};

    fn outputs(arch: Arch, width: usize) -> [Vec<f32>; 2] {
        let config = NetworkConfig { width, scans: 5, ..NetworkConfig::default() };
        let mut weights = Weights::zeros(config);
        let bound = 2.0 / (width as f32).sqrt();
        for (k, x) in weights.values_mut().iter_mut().enumerate() {
            *x = bound * (7.3 * k as f32).sin();
        }
        let mut assembly = rod::Assembly::new(nalgebra::Vector3::zeros());
        let nodes = rod::shape::straight(nalgebra::Vector3::zeros(), nalgebra::Vector3::x(), 3.0, 29);
        let material = rod::Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        assembly.rod(&rod::RodSpec::new(nodes, 0.05, material));
        let (model, _) = assembly.finish();
        let (members, topology) = component::split(&model).swap_remove(0);
        let mut graphs = Batch::default();
        graphs.push(&graph::Graph::new(&model, &members, &topology));
        let inputs: Vec<f32> = (0..7 * 29).map(|k| (0.9 * k as f32).cos()).collect();
        let packed = Arc::new(Packed::for_arch(&weights, arch));
        let mut forward = Forward::new(packed, &graphs, &inputs, &inputs[..5 * 28]);
        forward.run(&inputs, &[]);
        [forward.node_outputs, forward.edge_outputs]
    }

    #[test]
    fn all_instruction_sets_agree() {
        for width in [8, 20, 32, 64] {
            let expected = outputs(Arch::new(), width);
            let mut archs = vec![Arch::Scalar];
            #[cfg(target_arch = "x86_64")]
            archs.extend(pulp::x86::V3::try_new().map(Arch::V3));
            for arch in archs {
                let got = outputs(arch, width);
                for (a, b) in got.iter().flatten().zip(expected.iter().flatten()) {
                    assert!((a - b).abs() < 1e-4, "{a} {b} {width} {arch:?}");
                }
            }
        }
    }
}
