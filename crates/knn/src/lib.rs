//! The k-nearest-neighbour guess of the paper's supplement, with k = 3 as its section 3.2 has it.
//!
//! A data point is a node with one incident edge: 14 + 5 of the paper's inputs, and the 6 + 6 outputs of both over the
//! recorded norms. A prediction interpolates the outputs of the nearest points; an edge's is the mean of what its nodes
//! predict. What the paper leaves open:
//!
//! - *Distance*: Euclidean in inputs of unit spread; in the raw ones metres, kg/m^3 and quaternions would be added up.
//! - *Interpolation*: weights go with 1 / distance, so that a data point predicts itself.
//! - *Which edge*: nodes as senders and nodes as receivers are searched apart. The 19 inputs of a straight rod's node do
//!   not say on which of its sides the edge is, and the outputs on both differ.
//!   A clamped segment's inputs never change, so that the edge next to it is predicted by half as well as others.
//! - *How many points*: all of them would make 3.3 million for the paper's rods; every [`Params::every`]-th sample is
//!   taken.
//!
//! Features and targets come from the crates `graph` and `dataset`. The search is exact (`tree`), and each edge
//! takes two of them, which is far more than the direct solve of all edges takes. The example `speed` measures this, and the
//! iterations that the guess saves (`cargo run -p knn --example speed`).

pub mod tree;

use std::sync::Arc;

use cosserat::guess::InitialGuess;
use cosserat::internals::component::Component;
use cosserat::internals::dynamics::projection::Projection;
use cosserat::internals::kernels::Spatial;
use dataset::{Dataset, PaperBatch, Split};
use graph::{Channel, Graph, Normal, Norms, Whitening, paper, project_to_plane};
use tree::{Nearest, Tree};

/// Inputs of a data point.
pub const INPUTS: usize = paper::NODE + paper::EDGE;
/// Outputs of a data point.
const OUTPUTS: usize = paper::NODE_TARGET + paper::EDGE_TARGET;

/// How to build the guess.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Params {
    /// Number of neighbours.
    pub neighbours: usize,
    /// Of how many training samples one is taken.
    pub every: usize,
}

impl Default for Params {
    fn default() -> Self {
        Self { neighbours: 3, every: 8 }
    }
}

/// The data points of one role.
#[derive(Clone, Debug)]
struct Points {
    tree: Tree<INPUTS>,
    outputs: Vec<[f32; OUTPUTS]>,
}

/// The data points, shared by all guesses.
#[derive(Clone, Debug)]
pub struct Knn {
    /// Of nodes as senders, and as receivers.
    roles: [Points; 2],
    whitening: Whitening,
    norms: Norms,
    neighbours: usize,
}

impl Knn {
    /// Collects the data points of a data set's training split.
    pub fn new(dataset: &Dataset, params: Params) -> Self {
        let norms = dataset.norms();
        let mut batch = PaperBatch::default();
        for index in (0..dataset.sample_count(Split::Train)).step_by(params.every.max(1)) {
            if let Some(sample) = dataset.sample(Split::Train, index) {
                batch.push(&sample, &norms);
            }
        }
        let ends = [&batch.graphs.senders, &batch.graphs.receivers];
        let inputs = ends.map(|nodes| collect(nodes, &batch.nodes, &batch.edges));
        let outputs = ends.map(|nodes| collect(nodes, &batch.node_targets, &batch.edge_targets));
        let whitening = Whitening::fit(&[Channel::Scalar; INPUTS], inputs.iter().map(|rows| rows.as_flattened()));
        let points = |(mut inputs, outputs): (Vec<[f32; INPUTS]>, Vec<[f32; OUTPUTS]>)| {
            whitening.apply(inputs.as_flattened_mut());
            Points { tree: Tree::new(&inputs), outputs }
        };
        let [senders, receivers] = inputs;
        let [of_senders, of_receivers] = outputs;
        let roles = [points((senders, of_senders)), points((receivers, of_receivers))];
        Self { roles, whitening, norms, neighbours: params.neighbours.max(1) }
    }

    /// Number of data points of each role.
    pub fn len(&self) -> usize {
        self.roles[0].outputs.len()
    }

    /// Whether there is no data point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The interpolated outputs of one node with one edge in a role (0 sender, 1 receiver), over the norms.
    fn predict(&self, role: usize, input: &mut [f32; INPUTS], nearest: &mut Nearest) -> [f32; OUTPUTS] {
        self.whitening.apply(input);
        let points = &self.roles[role];
        points.tree.nearest(input, self.neighbours, nearest);
        let (mut sum, mut weights) = ([0.0; OUTPUTS], 0.0);
        for &(squared, id) in nearest.iter() {
            // Where a point lies on a data point, that one outweighs the others.
            let weight = 1.0 / squared.sqrt().max(1e-12);
            weights += weight;
            for (sum, output) in sum.iter_mut().zip(&points.outputs[id as usize]) {
                *sum += weight * output;
            }
        }
        if weights > 0.0 { sum.map(|x| x / weights) } else { sum }
    }

    /// Predicts dp `[nodes, 6]` and dlambda `[edges, 6]` over the norms, from inputs `[nodes, 14]` and `[edges, 5]`.
    ///
    /// A node's dp is the mean over its edges. `nearest` is memory for the search.
    fn fill(&self, graph: &Graph, nodes: &[f32], edges: &[f32], outputs: &mut Outputs) {
        let Outputs { dp, dlambda, counts, nearest } = outputs;
        dp.fill(0.0);
        counts.fill(0.0);
        let (sent, received) = (graph.senders().iter(), graph.receivers().iter());
        for (((&a, &b), edge), out) in
            sent.zip(received).zip(edges.chunks_exact(paper::EDGE)).zip(dlambda.chunks_exact_mut(paper::EDGE_TARGET))
        {
            out.fill(0.0);
            for (role, node) in [a as usize, b as usize].into_iter().enumerate() {
                let mut input = join(&nodes[node * paper::NODE..][..paper::NODE], edge);
                let found = self.predict(role, &mut input, nearest);
                let (of_node, of_edge) = found.split_at(paper::NODE_TARGET);
                out.iter_mut().zip(of_edge).for_each(|(out, x)| *out += 0.5 * x);
                dp[node * paper::NODE_TARGET..].iter_mut().zip(of_node).for_each(|(dp, x)| *dp += x);
                counts[node] += 1.0;
            }
        }
        for (dp, count) in dp.chunks_exact_mut(paper::NODE_TARGET).zip(counts.iter()) {
            dp.iter_mut().for_each(|x| *x /= count.max(1.0));
        }
    }
}

/// Rows of `nodes`, picked, joined with those of `edges`.
fn collect<const N: usize>(picked: &[u32], nodes: &[f32], edges: &[f32]) -> Vec<[f32; N]> {
    let count = picked.len().max(1);
    let edge_columns = edges.len() / count;
    let node_columns = N - edge_columns;
    let row = |(&node, edge)| join(&nodes[node as usize * node_columns..][..node_columns], edge);
    picked.iter().zip(edges.chunks_exact(edge_columns.max(1))).map(row).collect()
}

fn join<const N: usize>(node: &[f32], edge: &[f32]) -> [f32; N] {
    let mut row = [0.0; N];
    row.iter_mut().zip(node.iter().chain(edge)).for_each(|(out, &x)| *out = x);
    row
}

/// A prediction, and the memory for making it.
#[derive(Clone, Debug)]
struct Outputs {
    dp: Vec<f32>,
    dlambda: Vec<f32>,
    counts: Vec<f32>,
    nearest: Nearest,
}

/// Starts linear solves from the neighbours' solutions, or replaces them altogether (the paper's "end-to-end").
#[derive(Clone, Debug)]
pub struct KnnGuess {
    knn: Arc<Knn>,
    graph: Graph,
    plane: Option<Normal>,
    nodes: Vec<f32>,
    edges: Vec<f32>,
    outputs: Outputs,
}

impl KnnGuess {
    /// The guess for one connected set of segments; with `plane`, a planar one's, predictions are restricted to its
    /// plane (the paper's figure on temporal evolution).
    pub fn new(knn: Arc<Knn>, graph: Graph, plane: Option<Normal>) -> Self {
        let (n, m) = (graph.nodes().len(), graph.edges().len());
        let (mut nodes, mut edges) = (vec![0.0; n * paper::NODE], vec![0.0; m * paper::EDGE]);
        paper::fill_constant_nodes(&graph, &mut nodes);
        paper::fill_edges(&graph, &mut edges);
        let outputs = Outputs {
            dp: vec![0.0; n * paper::NODE_TARGET],
            dlambda: vec![0.0; m * paper::EDGE_TARGET],
            counts: vec![0.0; n],
            nearest: Nearest::with_capacity(knn.neighbours),
        };
        Self { knn, graph, plane, nodes, edges, outputs }
    }

    /// Predicts corrections and multipliers for a component's poses; either may be empty. Returns whether there is
    /// anything to predict from.
    fn predict(&mut self, component: &Component<f64>, dp: &mut [Spatial<f64>], dlambda: &mut [Spatial<f64>]) -> bool {
        paper::fill_changing_nodes(&component.poses, &mut self.nodes);
        self.knn.fill(&self.graph, &self.nodes, &self.edges, &mut self.outputs);
        self.knn.norms.dp(&self.outputs.dp, dp);
        self.knn.norms.dlambda(&self.outputs.dlambda, dlambda);
        if let Some(normal) = self.plane {
            project_to_plane(component, normal, dp, dlambda);
        }
        !self.knn.is_empty()
    }
}

impl InitialGuess for KnnGuess {
    fn helps_solves(&self) -> bool {
        true
    }

    fn start_solve(&mut self, component: &Component<f64>, _: usize, dlambda: &mut [Spatial<f64>]) -> bool {
        self.predict(component, &mut [], dlambda)
    }
}

impl Projection for KnnGuess {
    fn project(&mut self, component: &Component<f64>, _: usize, dp: &mut [Spatial<f64>], dlambda: &mut [Spatial<f64>]) {
        self.predict(component, dp, dlambda);
    }
}
