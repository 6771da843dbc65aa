//! Graphs, random weights, and the network written out plainly in f64.
#![allow(dead_code, missing_docs, unreachable_pub)]

use std::sync::Arc;

use copingnet::inference::{Forward, Packed};
use copingnet::{NetworkConfig, Output, Weights};
use graph::{Batch, Graph};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rod::{Assembly, Material, Model, RodSpec, shape};

const SOFT: Material = Material { youngs_modulus: 1e5, torsion_modulus: 2e5, density: 100.0 };

fn graph(model: &Model) -> Graph {
    let (members, topology) = component::split(model).swap_remove(0);
    Graph::new(model, &members, &topology)
}

/// A rod of `n` segments, its first one fixed.
pub fn chain(n: usize) -> Graph {
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 3.0, n), 0.05, SOFT));
    assembly.fix(rod.start);
    graph(&assembly.finish().0)
}

/// A clamped trunk with `branches` branches of 3 segments, two of them on each of its segments.
pub fn tree(branches: usize) -> Graph {
    let mut assembly = Assembly::new(Vector3::zeros());
    let line = |direction, n| RodSpec::new(shape::straight(Vector3::zeros(), direction, 1.0, n), 0.02, SOFT);
    let trunk = assembly.rod(&line(Vector3::z(), 2 + branches / 2));
    assembly.clamp_start(&trunk);
    for k in 0..branches {
        let branch = assembly.rod(&line(Vector3::x(), 3));
        assembly.branch(k / 2, 0.5, &branch);
    }
    graph(&assembly.finish().0)
}

/// A clamped trunk of 6 segments with branches of 4 and of 3, which come in the other order where they are `swapped`.
pub fn branched(swapped: bool) -> Graph {
    let mut assembly = Assembly::new(Vector3::zeros());
    let line = |direction, n| RodSpec::new(shape::straight(Vector3::zeros(), direction, 1.0, n), 0.02, SOFT);
    let trunk = assembly.rod(&line(Vector3::z(), 6));
    assembly.clamp_start(&trunk);
    let mut branches = [(2, 4), (4, 3)];
    if swapped {
        branches.reverse();
    }
    for (parent, n) in branches {
        let branch = assembly.rod(&line(Vector3::x(), n));
        assembly.branch(parent, 0.5, &branch);
    }
    graph(&assembly.finish().0)
}

/// A ring, on which no body is fixed and one edge is on nobody's way.
pub fn ring(n: usize) -> Graph {
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::ring(Vector3::zeros(), 0.5, n);
    assembly.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.03, SOFT) });
    graph(&assembly.finish().0)
}

pub fn batch(graphs: &[Graph]) -> Batch {
    let mut batch = Batch::default();
    for graph in graphs {
        batch.push(graph);
    }
    batch
}

/// Random weights, all `scale` times as large as they usually are.
pub fn weights(config: NetworkConfig, scale: f32) -> Weights {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut weights = Weights::zeros(config);
    for (spec, values) in weights.tensors_mut() {
        let bound = scale / (spec.shape[0] as f32).sqrt();
        values.iter_mut().for_each(|x| *x = rng.random_range(-bound..bound));
    }
    weights
}

/// Inputs of a batch, constant and changing ones apart.
pub struct Inputs {
    pub constant_nodes: Vec<f32>,
    pub constant_edges: Vec<f32>,
    pub nodes: Vec<f32>,
    pub edges: Vec<f32>,
}

impl Inputs {
    pub fn random(config: &NetworkConfig, graphs: &Batch, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut random = |count: usize| (0..count).map(|_| rng.random_range(-1.0..1.0)).collect();
        let (n, m) = (graphs.nodes(), graphs.edges());
        Self {
            constant_nodes: random(n * config.constant_node_inputs),
            constant_edges: random(m * config.constant_edge_inputs),
            nodes: random(n * (config.node_inputs - config.constant_node_inputs)),
            edges: random(m * (config.edge_inputs - config.constant_edge_inputs)),
        }
    }

    pub fn forward(&self, packed: &Arc<Packed>, graphs: &Batch) -> Forward {
        let mut forward = Forward::new(packed.clone(), graphs, &self.constant_nodes, &self.constant_edges);
        forward.run(&self.nodes, &self.edges);
        forward
    }
}

/// Row by row.
type Matrix = Vec<Vec<f64>>;

fn joined(parts: &[&[f64]]) -> Vec<f64> {
    parts.concat()
}

/// Whole rows: inputs that change, then those that do not.
pub fn rows(changing: &[f32], constant: &[f32], count: usize) -> Vec<f32> {
    let row = |values: &[f32], i| values[i * values.len() / count..(i + 1) * values.len() / count].to_vec();
    (0..count).flat_map(|i| [row(changing, i), row(constant, i)].concat()).collect()
}

fn matrix(changing: &[f32], constant: &[f32], count: usize) -> Matrix {
    let rows = rows(changing, constant, count);
    let row = |i| rows[i * rows.len() / count..(i + 1) * rows.len() / count].iter().map(|&x| f64::from(x)).collect();
    (0..count).map(row).collect()
}

fn linear(x: &[f64], weight: &[f32], bias: &[f32]) -> Vec<f64> {
    let mut y: Vec<f64> = bias.iter().map(|&b| f64::from(b)).collect();
    for (x, row) in x.iter().zip(weight.chunks(bias.len().max(1))) {
        y.iter_mut().zip(row).for_each(|(y, &w)| *y += x * f64::from(w));
    }
    y
}

fn added(a: &mut [f64], b: &[f64]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
}

fn perceptron<'a>(layers: usize, next: &mut impl FnMut() -> &'a [f32], mut rows: Matrix) -> Matrix {
    for k in 0..layers {
        let (weight, bias) = (next(), next());
        for row in &mut rows {
            *row = linear(row, weight, bias);
            if k + 1 < layers {
                row.iter_mut().for_each(|x| *x = x.max(0.0));
            }
        }
    }
    rows
}

/// Outputs of nodes and of edges.
pub fn reference(weights: &Weights, graphs: &Batch, inputs: &Inputs) -> [Vec<f64>; 2] {
    let config = *weights.config();
    let (n, m) = (graphs.nodes(), graphs.edges());
    let mut tensors = weights.tensors().map(|(_, values)| values);
    let mut next = || tensors.next().unwrap();
    let layers = config.mlp_layers;
    let mut v = perceptron(layers, &mut next, matrix(&inputs.nodes, &inputs.constant_nodes, n));
    let mut e = perceptron(layers, &mut next, matrix(&inputs.edges, &inputs.constant_edges, m));
    let ends = || graphs.senders.iter().zip(&graphs.receivers).map(|(&a, &b)| (a as usize, b as usize));
    for _ in 0..config.gn_blocks {
        let edges = e.iter().zip(ends()).map(|(e, (a, b))| joined(&[e, &v[a], &v[b]])).collect();
        let messages = perceptron(layers, &mut next, edges);
        let mut h = vec![Vec::new(); n];
        if config.scans > 0 {
            let (weight, bias, decays) = (next(), next(), next());
            let a: Vec<f64> = decays.iter().map(|&d| 1.0 / (1.0 + f64::from(-d).exp())).collect();
            h = v.iter().map(|v| linear(v, weight, bias)).collect();
            h.iter_mut().for_each(|h| h.iter_mut().zip(&a).for_each(|(h, a)| *h *= 1.0 - a));
            for &[node, parent] in &graphs.visits {
                for c in 0..config.scans {
                    h[node as usize][c] += a[c] * h[parent as usize][c];
                }
            }
            for &[node, parent] in graphs.visits.iter().rev() {
                for c in config.scans..2 * config.scans {
                    h[parent as usize][c] += a[c] * h[node as usize][c];
                }
            }
        }
        let mut sums = [(); 2].map(|()| vec![vec![0.0; config.width]; n]);
        for (message, (a, b)) in messages.iter().zip(ends()) {
            added(&mut sums[0][a], message);
            added(&mut sums[1][b], message);
        }
        let nodes = (0..n).map(|i| joined(&[&v[i], &sums[0][i], &sums[1][i], &h[i]])).collect();
        let change = perceptron(layers, &mut next, nodes);
        v.iter_mut().zip(&change).for_each(|(v, change)| added(v, change));
        e.iter_mut().zip(&messages).for_each(|(e, change)| added(e, change));
    }
    let output = |x: f64| if config.output == Output::Tanh { x.tanh() } else { x };
    // Without outputs there is no decoder.
    if config.edge_outputs == 0 {
        e.clear();
    }
    [v, e].map(|rows| match rows.len() {
        0 => Vec::new(),
        _ => perceptron(layers, &mut next, rows).into_iter().flatten().map(output).collect(),
    })
}
