//! What is made small: a loss of the network's outputs, with its gradient with respect to them.
//!
//! The gradient goes back through the network by automatic differentiation of `sum(outputs * gradient)`, the gradient
//! standing as a constant: the loss itself need not be made of tensors.

use crate::samples::Chunk;

/// A loss summed over a chunk's samples, and its gradient.
pub(crate) struct Evaluated {
    /// Sum over the samples.
    pub(crate) loss: f64,
    /// With respect to the nodes' outputs. `[n, node_outputs]`
    pub(crate) nodes: Vec<f32>,
    /// With respect to the edges' outputs. `[m, edge_outputs]`
    pub(crate) edges: Vec<f32>,
}

/// MSE(V) + MSE(E) (paper, section 3.2), each mean over the components of all rows of the *chunk's* share of the batch:
/// the sums over chunks divided by the batch's rows are the batch's means. Returns the sum of both over the chunk.
pub(crate) fn mean_square(chunk: &Chunk, outputs: [&[f32]; 2], counts: [usize; 2]) -> Evaluated {
    let mut loss = 0.0;
    let mut part = |outputs: &[f32], targets: &[f32], count: usize| {
        let inverse = 1.0 / count.max(1) as f64;
        let apart = outputs.iter().zip(targets).map(|(x, target)| f64::from(x - target));
        apart
            .map(|apart| {
                loss += apart * apart * inverse;
                (2.0 * apart * inverse) as f32
            })
            .collect()
    };
    let nodes = part(outputs[0], &chunk.node_targets, counts[0]);
    let edges = part(outputs[1], &chunk.edge_targets, counts[1]);
    Evaluated { loss, nodes, edges }
}
