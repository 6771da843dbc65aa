//! Batches: features and targets of many samples as one graph, in memory that is used again.

use graph::body_frame::{self, Features};
use graph::{Batch, Norms, paper};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use solver::component::Component;
use solver::system::Six;

use crate::{Sample, Trajectory};

/// The paper's features and targets of samples, one after the other.
#[derive(Clone, Debug, Default)]
pub struct PaperBatch {
    /// Sizes and connectivity.
    pub graphs: Batch,
    /// `[nodes, 14]`
    pub nodes: Vec<f32>,
    /// `[edges, 5]`
    pub edges: Vec<f32>,
    /// dp over the norms. `[nodes, 6]`
    pub node_targets: Vec<f32>,
    /// dlambda over the norms. `[edges, 6]`
    pub edge_targets: Vec<f32>,
}

/// Appends `rows` rows to `values` and returns them.
fn grow(values: &mut Vec<f32>, rows: usize, columns: usize) -> &mut [f32] {
    let start = values.len();
    values.resize(start + rows * columns, 0.0);
    &mut values[start..]
}

impl PaperBatch {
    /// Removes all samples and keeps the memory.
    pub fn clear(&mut self) {
        self.graphs.clear();
        [&mut self.nodes, &mut self.edges, &mut self.node_targets, &mut self.edge_targets]
            .into_iter()
            .for_each(Vec::clear);
    }

    /// Appends a sample.
    pub fn push(&mut self, sample: &Sample<'_>, norms: &Norms) {
        let (trajectory, graph) = (sample.trajectory(), sample.trajectory().graph());
        let (nodes, edges) = (graph.nodes().len(), graph.edges().len());
        self.graphs.push(graph);
        let rows = grow(&mut self.nodes, nodes, paper::NODE);
        paper::fill_constant_nodes(graph, rows);
        let anchors = trajectory.model().anchors.iter().map(|anchor| {
            let (x, q) = (anchor.position, anchor.orientation.coords);
            [x.x, x.y, x.z, q.x, q.y, q.z, q.w]
        });
        for (row, pose) in rows.chunks_exact_mut(paper::NODE).zip(sample.pose_rows().chain(anchors)) {
            for (out, value) in row.iter_mut().zip(pose) {
                *out = value as f32;
            }
        }
        paper::fill_edges(graph, grow(&mut self.edges, edges, paper::EDGE));
        let six = |x: [f32; 6]| Six::from_array(x.map(f64::from));
        let rows = grow(&mut self.node_targets, nodes, paper::NODE_TARGET);
        for (row, dp) in rows.chunks_exact_mut(paper::NODE_TARGET).zip(sample.dp()) {
            norms.fill_node_targets(&[six(dp)], row);
        }
        let rows = grow(&mut self.edge_targets, edges, paper::EDGE_TARGET);
        for (row, dlambda) in rows.chunks_exact_mut(paper::EDGE_TARGET).zip(sample.dlambda()) {
            norms.fill_edge_targets(&[six(dlambda)], row);
        }
    }
}

/// What one trajectory needs to have its body-frame features made: make it once for each.
#[derive(Clone, Debug)]
pub struct Workspace {
    /// The component with the sample restored last.
    pub component: Component<f64>,
    /// Memory for its features.
    pub features: Features,
    dp: Vec<Six<f64>>,
}

impl Workspace {
    /// For the samples of a trajectory.
    pub fn new(trajectory: &Trajectory<'_>) -> Self {
        let graph = trajectory.graph();
        let dp = vec![Six::zero(); graph.nodes().len()];
        Self { component: trajectory.component(), features: Features::new(graph), dp }
    }
}

/// Body-frame features and targets of samples, one after the other, neither whitened nor masked.
#[derive(Clone, Debug, Default)]
pub struct BodyFrameBatch {
    /// Sizes and connectivity.
    pub graphs: Batch,
    /// Scale s of each sample's right-hand side [m]. `[graphs]`
    pub scales: Vec<f64>,
    /// `[nodes, 7]`
    pub constant_nodes: Vec<f32>,
    /// `[nodes, 9]`
    pub nodes: Vec<f32>,
    /// `[edges, 9]`
    pub constant_edges: Vec<f32>,
    /// `[edges, 18]`
    pub edges: Vec<f32>,
    /// dp at the scale s. `[nodes, 6]`
    pub node_targets: Vec<f32>,
    /// dlambda at the scale s. `[edges, 6]`
    pub edge_targets: Vec<f32>,
}

impl BodyFrameBatch {
    /// Removes all samples and keeps the memory.
    pub fn clear(&mut self) {
        let Self { graphs, scales, constant_nodes, nodes, constant_edges, edges, node_targets, edge_targets } = self;
        graphs.clear();
        scales.clear();
        [constant_nodes, nodes, constant_edges, edges, node_targets, edge_targets].into_iter().for_each(Vec::clear);
    }

    /// Appends a sample, which stays restored in its trajectory's workspace.
    pub fn push(&mut self, sample: &Sample<'_>, workspace: &mut Workspace) {
        let graph = sample.trajectory().graph();
        let (nodes, edges) = (graph.nodes().len(), graph.edges().len());
        let Workspace { component, features, dp } = workspace;
        sample.restore(component);
        dp.fill(Six::zero());
        dp.iter_mut().zip(sample.dp()).for_each(|(own, stored)| *own = Six::from_array(stored.map(f64::from)));
        self.graphs.push(graph);
        body_frame::fill_constant_nodes(graph, grow(&mut self.constant_nodes, nodes, body_frame::NODE_CONSTANT));
        let constant = grow(&mut self.constant_edges, edges, body_frame::EDGE_CONSTANT);
        body_frame::fill_constant_edges(graph, sample.dt(), constant);
        let scale = features.fill(
            graph,
            component,
            grow(&mut self.nodes, nodes, body_frame::NODE_CHANGING),
            grow(&mut self.edges, edges, body_frame::EDGE_CHANGING),
        );
        self.scales.push(scale);
        let targets = grow(&mut self.node_targets, nodes, body_frame::NODE_TARGET);
        features.fill_node_targets(graph, component, scale, dp, targets);
        let targets = grow(&mut self.edge_targets, edges, body_frame::EDGE_TARGET);
        features.fill_edge_targets(graph, component, scale, &component.dlambda, targets);
    }
}

/// The numbers 0 to `count - 1` in random order, which depends on the seed and the epoch alone.
pub fn shuffled(count: usize, seed: u64, epoch: u64) -> Vec<usize> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(epoch);
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        // A share of 2^64: its bias is beyond measure.
        let other = (u128::from(random.next_u64()) * (last as u128 + 1)) >> 64;
        order.swap(last, other as usize);
    }
    order
}
