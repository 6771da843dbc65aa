//! The packed forward pass beside the plain one.

use std::sync::Arc;

use crate::common::{Inputs, batch, chain, reference, ring, tree, weights};
use copingnet::inference::{Forward, Packed};
use copingnet::{NetworkConfig, Output};
use graph::Batch;

fn graphs() -> Batch {
    batch(&[chain(13), tree(9), ring(7), chain(2), tree(2)])
}

/// Largest difference of any output from the plain pass, over the largest output where that is more than 1.
fn error(config: NetworkConfig, scale: f32, graphs: &Batch) -> f64 {
    let weights = weights(config, scale);
    let inputs = Inputs::random(&config, graphs, 1);
    let forward = inputs.forward(&Arc::new(Packed::new(&weights)), graphs);
    let [nodes, edges] = reference(&weights, graphs, &inputs);
    assert_eq!(forward.node_outputs().len(), nodes.len());
    assert_eq!(forward.edge_outputs().len(), edges.len());
    let largest = nodes.iter().chain(&edges).fold(1.0_f64, |largest, x| largest.max(x.abs()));
    let outputs = forward.node_outputs().iter().chain(forward.edge_outputs());
    let errors = outputs.zip(nodes.iter().chain(&edges)).map(|(&a, b)| (f64::from(a) - b).abs());
    errors.fold(0.0, |worst, error| if error <= worst { worst } else { error }) / largest
}

#[track_caller]
fn assert_right(config: NetworkConfig, scale: f32) {
    let error = error(config, scale, &graphs());
    assert!(error < 1e-5, "{error:e} {config:?} {scale}");
}

#[test]
fn all_sizes_are_right() {
    for width in [1, 8, 16, 20, 32, 40, 64] {
        for mlp_layers in 1..=4 {
            for gn_blocks in 0..=3 {
                assert_right(NetworkConfig { width, mlp_layers, gn_blocks, ..NetworkConfig::default() }, 1.0);
            }
        }
    }
}

#[test]
fn scans_are_right() {
    for scans in [1, 4, 8, 12, 16, 20] {
        for output in [Output::Tanh, Output::Linear] {
            assert_right(NetworkConfig { scans, output, ..NetworkConfig::default() }, 1.0);
            assert_right(NetworkConfig { scans, output, width: 20, mlp_layers: 1, ..NetworkConfig::default() }, 1.0);
        }
    }
}

#[test]
fn all_ways_to_divide_inputs_are_right() {
    for (node_inputs, edge_inputs) in [(1, 1), (14, 5), (16, 19), (35, 16)] {
        for constant in [0.0, 0.5, 1.0] {
            let part = |count: usize| (count as f64 * constant) as usize;
            let config = NetworkConfig {
                node_inputs,
                edge_inputs,
                constant_node_inputs: part(node_inputs),
                constant_edge_inputs: part(edge_inputs),
                ..NetworkConfig::default()
            };
            assert_right(config, 1.0);
            assert_right(NetworkConfig { gn_blocks: 0, ..config }, 1.0);
        }
    }
}

#[test]
fn many_outputs_one_and_none_are_right() {
    for (node_outputs, edge_outputs) in [(1, 6), (16, 17), (40, 1), (6, 0)] {
        for output in [Output::Tanh, Output::Linear] {
            assert_right(NetworkConfig { node_outputs, edge_outputs, output, ..NetworkConfig::default() }, 1.0);
        }
    }
}

#[test]
fn large_outputs_are_right() {
    let linear = NetworkConfig { gn_blocks: 1, output: Output::Linear, ..NetworkConfig::default() };
    assert_right(linear, 4.0);
    // tanh of a sum of large numbers is as good as that sum: a single linear layer behind the encoder keeps it good.
    let saturated = NetworkConfig { gn_blocks: 0, mlp_layers: 1, ..NetworkConfig::default() };
    let weights = weights(saturated, 12.0);
    let graphs = graphs();
    let forward = Inputs::random(&saturated, &graphs, 1).forward(&Arc::new(Packed::new(&weights)), &graphs);
    let outputs = || forward.node_outputs().iter().chain(forward.edge_outputs());
    assert!(outputs().all(|x| x.abs() <= 1.0));
    assert!(outputs().filter(|x| x.abs() > 0.999_999).count() > outputs().count() / 2);
    assert!(error(saturated, 12.0, &graphs) < 1e-4);
}

#[test]
fn tanh_is_good_to_a_millionth() {
    // Nodes pass through: one input, whose multiple by 10 is the only sum.
    let config = NetworkConfig {
        node_inputs: 1,
        constant_node_inputs: 0,
        node_outputs: 1,
        gn_blocks: 0,
        mlp_layers: 1,
        width: 1,
        ..NetworkConfig::default()
    };
    let mut weights = copingnet::Weights::zeros(config);
    for (spec, values) in weights.tensors_mut().filter(|(spec, _)| spec.name.ends_with("node.0.weight")) {
        values.fill(if spec.name.starts_with("encoder") { 1.0 } else { 10.0 });
    }
    let graphs = batch(&[chain(20_000)]);
    let mut inputs = Inputs::random(&config, &graphs, 0);
    inputs.nodes[..5].copy_from_slice(&[0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-20]);
    let forward = inputs.forward(&Arc::new(Packed::new(&weights)), &graphs);
    assert!(forward.node_outputs()[1].is_nan());
    for (&x, &y) in inputs.nodes.iter().zip(forward.node_outputs()).filter(|(x, _)| !x.is_nan()) {
        assert!((f64::from(y) - (10.0 * f64::from(x)).tanh()).abs() < 1e-6, "{x} {y}");
    }
}

#[test]
fn a_batch_gives_the_bits_of_its_graphs() {
    let graphs = [chain(13), tree(9), chain(30), ring(5), chain(1), tree(4), chain(3)];
    for (scans, constant_edge_inputs) in [(0, 5), (6, 2)] {
        let config = NetworkConfig { scans, constant_edge_inputs, ..NetworkConfig::default() };
        let packed = Arc::new(Packed::new(&weights(config, 1.0)));
        let all = batch(&graphs);
        let inputs = Inputs::random(&config, &all, 2);
        let together = inputs.forward(&packed, &all);
        let (mut node, mut edge) = (0, 0);
        for graph in &graphs {
            let (n, m) = (graph.nodes().len(), graph.edges().len());
            let part = |values: &[f32], first: usize, count: usize, columns: usize| {
                values[first * columns..][..count * columns].to_vec()
            };
            let changing_edges = config.edge_inputs - constant_edge_inputs;
            let own = Inputs {
                constant_nodes: part(&inputs.constant_nodes, node, n, config.constant_node_inputs),
                constant_edges: part(&inputs.constant_edges, edge, m, constant_edge_inputs),
                nodes: part(&inputs.nodes, node, n, config.node_inputs - config.constant_node_inputs),
                edges: part(&inputs.edges, edge, m, changing_edges),
            };
            let alone = own.forward(&packed, &batch(std::slice::from_ref(graph)));
            assert_eq!(alone.node_outputs(), part(together.node_outputs(), node, n, config.node_outputs));
            assert_eq!(alone.edge_outputs(), part(together.edge_outputs(), edge, m, config.edge_outputs));
            (node, edge) = (node + n, edge + m);
        }
    }
}

#[test]
fn runs_repeat_and_constants_change_without_allocation() {
    for (scans, constant_edge_inputs) in [(0, 5), (6, 2)] {
        let config = NetworkConfig { scans, constant_edge_inputs, ..NetworkConfig::default() };
        let graphs = graphs();
        let packed = Arc::new(Packed::new(&weights(config, 1.0)));
        let [first, second] = [3, 4].map(|seed| Inputs::random(&config, &graphs, seed));
        let expected = [&first, &second].map(|inputs| inputs.forward(&packed, &graphs));
        let mut forward = Forward::new(packed, &graphs, &first.constant_nodes, &first.constant_edges);
        for (inputs, expected) in [(&second, &expected[1]), (&first, &expected[0]), (&second, &expected[1])] {
            let count = allocation_counter::measure(|| {
                forward.set_constants(&inputs.constant_nodes, &inputs.constant_edges);
                forward.run(&inputs.nodes, &inputs.edges);
            });
            assert_eq!(count.count_total, 0);
            assert_eq!(forward.node_outputs(), expected.node_outputs());
            assert_eq!(forward.edge_outputs(), expected.edge_outputs());
        }
    }
}

#[test]
fn no_graphs_are_no_outputs() {
    let config = NetworkConfig { scans: 3, ..NetworkConfig::default() };
    let forward = Inputs::random(&config, &Batch::default(), 0)
        .forward(&Arc::new(Packed::new(&weights(config, 1.0))), &Batch::default());
    assert!(forward.node_outputs().is_empty() && forward.edge_outputs().is_empty());
}
