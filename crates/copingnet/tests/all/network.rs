//! The network in burn beside its packed forward pass and the plain one in f64: outputs, gradients, reach.

use std::sync::Arc;

use crate::common::{Inputs, batch, branched, chain, reference, ring, rows, tree, weights};
use burn::module::{Module, ModuleVisitor, Param};
use burn::tensor::{Device, Tensor, TensorData};
use copingnet::inference::Packed;
use copingnet::{Backend, GraphTensors, Network, NetworkConfig, Output, Weights};
use graph::{Batch, Graph};

fn numbers(tensor: &Tensor<2>) -> Vec<f32> {
    tensor.clone().into_data().iter::<f32>().collect()
}

fn tensors(config: &NetworkConfig, graphs: &Batch, inputs: &Inputs, device: &Device) -> GraphTensors {
    let nodes = rows(&inputs.nodes, &inputs.constant_nodes, graphs.nodes());
    let edges = rows(&inputs.edges, &inputs.constant_edges, graphs.edges());
    GraphTensors::new(graphs, &nodes, &edges, config.scans > 0, device)
}

/// Outputs of nodes and of edges.
fn burned(weights: &Weights, graphs: &Batch, inputs: &Inputs, device: &Device) -> [Vec<f32>; 2] {
    let tensors = tensors(weights.config(), graphs, inputs, device);
    let (nodes, edges) = Network::new(weights, device).forward(&tensors);
    [numbers(&nodes), edges.as_ref().map_or_else(Vec::new, numbers)]
}

fn packed(weights: &Weights, graphs: &Batch, inputs: &Inputs) -> [Vec<f32>; 2] {
    let forward = inputs.forward(&Arc::new(Packed::new(weights)), graphs);
    [forward.node_outputs().to_vec(), forward.edge_outputs().to_vec()]
}

/// Largest difference over the largest number of `expected`, or over 1 where that is smaller.
fn apart(found: &[f32], expected: &[f32]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().fold(1.0_f64, |largest, &x| largest.max(f64::from(x).abs()));
    let worst = |worst: f64, error: f64| if error <= worst { worst } else { error };
    found.iter().zip(expected).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, worst) / largest
}

#[track_caller]
fn assert_packed_is_right(weights: &Weights, graphs: &Batch) -> [Vec<f32>; 2] {
    let inputs = Inputs::random(weights.config(), graphs, 1);
    let expected = burned(weights, graphs, &inputs, &Backend::Ndarray.device());
    for (found, expected) in packed(weights, graphs, &inputs).iter().zip(&expected) {
        let apart = apart(found, expected);
        assert!(apart < 1e-5, "{apart:e} {:?}", weights.config());
    }
    expected
}

#[test]
fn the_packed_pass_gives_the_same() {
    let sets = [vec![chain(13)], vec![tree(9)], vec![chain(13), tree(9), ring(7), chain(1), chain(2), tree(2)]];
    for graphs in sets.map(|graphs| batch(&graphs)) {
        for width in [8, 16, 32] {
            for (scans, output) in [0, 5, 16].into_iter().flat_map(|n| [(n, Output::Tanh), (n, Output::Linear)]) {
                let config = NetworkConfig { width, scans, output, ..NetworkConfig::default() };
                assert_packed_is_right(&weights(config, 1.0), &graphs);
            }
        }
        let of_nodes_alone = NetworkConfig { node_outputs: 3, edge_outputs: 0, scans: 4, ..NetworkConfig::default() };
        let [nodes, edges] = assert_packed_is_right(&weights(of_nodes_alone, 1.0), &graphs);
        assert_eq!((nodes.len(), edges.len()), (3 * graphs.nodes(), 0));
    }
}

#[test]
fn the_packed_pass_gives_the_same_where_outputs_saturate() {
    let graphs = batch(&[chain(13), tree(9)]);
    let config = NetworkConfig { scans: 4, ..NetworkConfig::default() };
    let mut weights = weights(config, 1.0);
    for (_, values) in
        weights.tensors_mut().filter(|(spec, _)| spec.name.starts_with("decoder") && spec.name.ends_with("1.bias"))
    {
        values.copy_from_slice(&[-12.0, -8.0, -4.0, 4.0, 8.0, 12.0]);
    }
    let outputs = assert_packed_is_right(&weights, &graphs);
    assert!(outputs.iter().flatten().all(|x| x.abs() <= 1.0));
    assert!(outputs.iter().flatten().filter(|x| x.abs() > 0.999_999).count() > graphs.nodes() * 4);
}

/// Weights of outputs in a loss: without a pattern, of size 1.
fn constants(count: usize) -> Vec<f32> {
    (0..count).map(|k| (12.9 * k as f32).sin()).collect()
}

/// Gradients of the outputs' weighted sum with respect to all parameters.
fn gradients(weights: &Weights, graphs: &Batch, inputs: &Inputs, device: &Device) -> Vec<f32> {
    let device = &device.clone().autodiff();
    let network = Network::new(weights, device);
    let (nodes, edges) = network.forward(&tensors(weights.config(), graphs, inputs, device));
    let sum = |outputs: Tensor<2>| {
        let shape = outputs.dims();
        let constants = TensorData::new(constants(shape[0] * shape[1]), shape);
        (outputs * Tensor::<2>::from_data(constants, device)).sum()
    };
    let edges = edges.map(sum);
    let nodes = sum(nodes);
    network.gradients(&edges.map_or_else(|| nodes.clone(), |edges| edges + nodes.clone()).backward())
}

/// A small network of every kind of tensor.
fn small(output: Output) -> NetworkConfig {
    NetworkConfig {
        width: 8,
        gn_blocks: 2,
        scans: 3,
        node_outputs: 3,
        edge_outputs: 2,
        output,
        ..NetworkConfig::default()
    }
}

#[test]
fn gradients_are_those_of_central_differences() {
    // Differences of the plain pass in f64, so that steps can be small enough for no ReLU to turn within them.
    const STEP: f32 = 1.0 / 1_048_576.0;
    let graphs = batch(&[chain(6), tree(2), ring(3)]);
    for output in [Output::Tanh, Output::Linear] {
        let mut weights = weights(small(output), 1.0);
        let inputs = Inputs::random(weights.config(), &graphs, 1);
        let found = gradients(&weights, &graphs, &inputs, &Backend::Ndarray.device());
        assert_eq!(found.len(), weights.values().len());
        let sum = |weights: &Weights| -> f64 {
            let outputs = reference(weights, &graphs, &inputs);
            let sum = |x: &Vec<f64>| x.iter().zip(constants(x.len())).map(|(x, c)| x * f64::from(c)).sum::<f64>();
            outputs.iter().map(sum).sum()
        };
        let specs: Vec<_> = weights.tensors().map(|(spec, _)| spec.clone()).collect();
        let mut parameters = found.iter().enumerate();
        for spec in specs {
            let (mut error, mut largest) = (0.0_f64, 0.0_f64);
            for (k, &found) in parameters.by_ref().take(spec.len()) {
                let x = weights.values()[k];
                let [low, high] = [x - STEP, x + STEP];
                let [below, above] = [low, high].map(|x| {
                    weights.values_mut()[k] = x;
                    sum(&weights)
                });
                weights.values_mut()[k] = x;
                let expected = (above - below) / (f64::from(high) - f64::from(low));
                error = error.max((f64::from(found) - expected).abs());
                largest = largest.max(expected.abs());
            }
            // Sums over all rows in single precision.
            assert!(error < 1e-5 * largest, "{}: {error:e} of {largest:e}", spec.name);
        }
    }
}

#[test]
fn parameters_without_influence_have_the_gradient_zero() {
    let device = &Backend::Ndarray.device().autodiff();
    let graphs = batch(&[chain(6)]);
    let weights = weights(small(Output::Linear), 1.0);
    let network = Network::new(&weights, device);
    let inputs = Inputs::random(weights.config(), &graphs, 1);
    let (nodes, _) = network.forward(&tensors(weights.config(), &graphs, &inputs, device));
    let mut found = Weights::zeros(*weights.config());
    found.values_mut().copy_from_slice(&network.gradients(&nodes.sum().backward()));
    for (spec, values) in found.tensors() {
        let is_zero = values.iter().all(|&g| g == 0.0);
        assert_eq!(is_zero, spec.name.starts_with("decoder.edge"), "{}", spec.name);
    }
}

#[cfg(feature = "flex")]
#[test]
fn both_backends_on_the_processor_give_the_same() {
    let graphs = batch(&[chain(13), tree(9), ring(7), chain(1)]);
    let [ndarray, flex] = [Backend::Ndarray, Backend::Flex].map(Backend::device);
    for (scans, output) in [0, 5].into_iter().flat_map(|n| [(n, Output::Tanh), (n, Output::Linear)]) {
        let weights = weights(NetworkConfig { scans, output, ..NetworkConfig::default() }, 1.0);
        let inputs = Inputs::random(weights.config(), &graphs, 1);
        let outputs = [&ndarray, &flex].map(|device| burned(&weights, &graphs, &inputs, device).concat());
        assert!(apart(&outputs[1], &outputs[0]) < 1e-5);
        let gradients = [&ndarray, &flex].map(|device| gradients(&weights, &graphs, &inputs, device));
        let mut first = 0;
        for (spec, _) in weights.tensors() {
            let [a, b] = [0, 1].map(|k: usize| &gradients[k][first..first + spec.len()]);
            first += spec.len();
            let largest = a.iter().fold(0.0_f32, |largest, x| largest.max(x.abs()));
            let worst = a.iter().zip(b).fold(0.0_f32, |worst, (a, b)| worst.max((a - b).abs()));
            assert!(largest > 0.0 && worst < 1e-5 * largest, "{}: {worst:e} of {largest:e}", spec.name);
        }
    }
}

/// Shapes of all parameters in burn's order.
struct Shapes(Vec<Vec<usize>>);

impl ModuleVisitor for Shapes {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.0.push(param.dims().to_vec());
    }
}

#[test]
fn parameters_come_back_in_their_order() {
    let device = &Backend::Ndarray.device();
    for (scans, mlp_layers, gn_blocks) in [(0, 2, 3), (4, 1, 2), (3, 3, 0), (1, 2, 1)] {
        let config = NetworkConfig { scans, mlp_layers, gn_blocks, ..NetworkConfig::default() };
        let [first, second] = [1, 2].map(|seed| Weights::random(config, seed));
        let network = Network::new(&first, device);
        assert_eq!(network.values(), first.values());
        let network = network.set(second.values());
        assert_eq!(network.values(), second.values());
        let mut shapes = Shapes(Vec::new());
        network.visit(&mut shapes);
        assert!(shapes.0.iter().eq(config.tensors().iter().map(|spec| &spec.shape)));
    }
}

/// Which rows of `columns` numbers differ in any bit.
fn changed(a: &[f32], b: &[f32], columns: usize) -> Vec<usize> {
    let differs = |(_, (a, b)): &(usize, (&[f32], &[f32]))| a.iter().zip(*b).any(|(a, b)| a.to_bits() != b.to_bits());
    a.chunks(columns).zip(b.chunks(columns)).enumerate().filter(differs).map(|(row, _)| row).collect()
}

/// The nodes and edges whose outputs change with the inputs of a node, in both passes. Weights are large enough for
/// what comes from afar not to be rounded away.
fn reached(config: NetworkConfig, graphs: &Batch, node: usize) -> [Vec<usize>; 2] {
    let weights = weights(NetworkConfig { output: Output::Linear, ..config }, 2.0);
    let inputs = Inputs::random(&config, graphs, 1);
    let mut other = Inputs::random(&config, graphs, 1);
    let columns = other.nodes.len() / graphs.nodes();
    other.nodes[node * columns..(node + 1) * columns].iter_mut().for_each(|x| *x = -*x);
    let burned = |inputs: &Inputs| burned(&weights, graphs, inputs, &Backend::Ndarray.device());
    let [found, expected] =
        [[packed(&weights, graphs, &inputs), packed(&weights, graphs, &other)], [burned(&inputs), burned(&other)]]
            .map(|[a, b]| [changed(&a[0], &b[0], config.node_outputs), changed(&a[1], &b[1], config.edge_outputs)]);
    assert_eq!(found, expected);
    found
}

#[test]
fn messages_go_as_many_hops_as_there_are_blocks_both_ways() {
    // Another graph of the batch hears nothing.
    let (n, graphs) = (13, batch(&[chain(13), ring(4)]));
    for gn_blocks in 0..=4 {
        let config = NetworkConfig { gn_blocks, width: 16, ..NetworkConfig::default() };
        // An edge hears of both its ends in the first block already.
        assert_eq!(reached(config, &graphs, 0), [(0..=gn_blocks).collect::<Vec<_>>(), (0..gn_blocks).collect()]);
        let [nodes, edges] = [n - 1 - gn_blocks..n, n - 1 - gn_blocks..n - 1].map(Iterator::collect::<Vec<_>>);
        assert_eq!(reached(config, &graphs, n - 1), [nodes, edges]);
        let (low, high) = (6 - gn_blocks, 6 + gn_blocks);
        assert_eq!(reached(config, &graphs, 6), [(low..=high).collect::<Vec<_>>(), (low..high).collect()]);
    }
}

#[test]
fn scans_carry_to_the_ends_both_ways() {
    let (n, graphs) = (13, batch(&[chain(13), ring(4)]));
    let config = NetworkConfig { gn_blocks: 1, scans: 4, width: 16, ..NetworkConfig::default() };
    for node in [0, 6, n - 1] {
        let [nodes, edges] = reached(config, &graphs, node);
        assert_eq!(nodes, (0..n).collect::<Vec<_>>());
        // Edges do not see what scans bring before the next block.
        assert!(edges.iter().all(|&edge| edge == node || edge + 1 == node), "{edges:?}");
    }
    let config = NetworkConfig { gn_blocks: 2, ..config };
    assert_eq!(reached(config, &graphs, 0)[1], (0..n - 1).collect::<Vec<_>>());
}

#[test]
fn scans_go_along_branches_alone() {
    // Branches of 3 segments each, which end in 0.
    let graph = tree(4);
    let tips: Vec<usize> = (0..graph.nodes().len()).filter(|&node| graph.nodes()[node].height == 1).collect();
    let config = NetworkConfig { gn_blocks: 1, scans: 4, width: 16, ..NetworkConfig::default() };
    let [nodes, _] = reached(config, &batch(std::slice::from_ref(&graph)), tips[0]);
    // Inwards to the root; no other branch hears of it.
    let mut way = vec![tips[0]];
    while let Some(visit) = graph.visits().iter().find(|visit| visit.node as usize == way[way.len() - 1]) {
        way.push(visit.parent as usize);
    }
    way.sort_unstable();
    assert_eq!(nodes, way);
}

#[test]
fn other_numbers_for_the_nodes_permute_the_outputs() {
    let [a, b] = [false, true].map(branched);
    // Trunk 0..6, then a branch of 4 and one of 3, or the other way round; the anchor is last.
    let place = |node: u32| match node {
        6..10 => node + 3,
        10..13 => node - 4,
        _ => node,
    };
    let ends = |graph: &Graph, k: usize| [graph.senders()[k], graph.receivers()[k]];
    let edge = |k: usize| {
        let ends_there = ends(&a, k).map(place);
        (0..b.edges().len()).find(|&other| ends(&b, other) == ends_there).unwrap()
    };
    let nodes: Vec<usize> = (0..a.nodes().len() as u32).map(|node| place(node) as usize).collect();
    let edges: Vec<usize> = (0..a.edges().len()).map(edge).collect();
    assert_ne!(edges, (0..edges.len()).collect::<Vec<_>>());
    let permuted = |values: &[f32], places: &[usize]| {
        let columns = values.len() / places.len();
        let mut out = vec![0.0; values.len()];
        for (row, &place) in values.chunks(columns.max(1)).zip(places) {
            out[place * columns..][..columns].copy_from_slice(row);
        }
        out
    };
    let [a, b] = [a, b].map(|graph| batch(&[graph]));
    for scans in [0, 5] {
        let weights = weights(NetworkConfig { scans, ..NetworkConfig::default() }, 1.0);
        let inputs = Inputs::random(weights.config(), &a, 1);
        let other = Inputs {
            constant_nodes: permuted(&inputs.constant_nodes, &nodes),
            constant_edges: permuted(&inputs.constant_edges, &edges),
            nodes: permuted(&inputs.nodes, &nodes),
            edges: permuted(&inputs.edges, &edges),
        };
        let device = Backend::Ndarray.device();
        for [x, y] in [
            [packed(&weights, &a, &inputs), packed(&weights, &b, &other)],
            [burned(&weights, &a, &inputs, &device), burned(&weights, &b, &other, &device)],
        ] {
            // Sums over a node's edges run in another order.
            assert!(apart(&y[0], &permuted(&x[0], &nodes)) < 1e-5);
            assert!(apart(&y[1], &permuted(&x[1], &edges)) < 1e-5);
        }
    }
}
