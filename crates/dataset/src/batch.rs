//! Batches: features and targets of many samples as one graph, in memory that is used again.

use cosserat::internals::kernels::Spatial;
use graph::{Batch, Norms, paper};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::Sample;

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
        let spatial = |x: [f32; 6]| Spatial::from_array(x.map(f64::from));
        let rows = grow(&mut self.node_targets, nodes, paper::NODE_TARGET);
        for (row, dp) in rows.chunks_exact_mut(paper::NODE_TARGET).zip(sample.dp()) {
            norms.fill_node_targets(&[spatial(dp)], row);
        }
        let rows = grow(&mut self.edge_targets, edges, paper::EDGE_TARGET);
        for (row, dlambda) in rows.chunks_exact_mut(paper::EDGE_TARGET).zip(sample.dlambda()) {
            norms.fill_edge_targets(&[spatial(dlambda)], row);
        }
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
