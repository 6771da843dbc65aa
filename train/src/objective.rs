//! What is made small: a loss of the network's outputs, with its gradient with respect to them.
//!
//! The gradient goes on through the network by automatic differentiation of `sum(outputs * gradient)`, the gradient
//! standing as a constant: the loss itself need not be made of tensors.

use std::ops::Range;
use std::sync::{Arc, Mutex};

use copingnet::{CgLoss, Encoder, Encoding, Inputs};
use cosserat::internals::component::Component;
use cosserat::internals::jointed::linear::precondition::Preconditioner;
use cosserat::internals::kernels::Spatial;
use cosserat::simulation::PreconditionerKind;
use dataset::{Dataset, Split, Trajectory};

use crate::samples::{Chunk, Samples};

/// Iterations of conjugate gradients that the loss goes through.
const CG_STEPS: usize = 6;

/// A chunk's share of a batch's loss, and its gradient.
pub(crate) struct Evaluated {
    pub(crate) loss: f64,
    /// With respect to the nodes' outputs. `[n, node_outputs]`
    pub(crate) nodes: Vec<f32>,
    /// With respect to the edges' outputs. `[m, edge_outputs]`
    pub(crate) edges: Vec<f32>,
    /// Samples that are left out because their loss is not finite.
    pub(crate) left_out: usize,
}

/// A loss of the outputs on training samples.
pub(crate) enum Objective<'a> {
    /// MSE(V) + MSE(E) (paper, section 3.2), over all components of the batch.
    MeanSquare,
    /// The mean over the samples of ln of the squared error relative to that of outputs that are zero, over nodes and
    /// edges: samples of all sizes count alike.
    LogSquare,
    /// The mean over the samples of ln of |r|^2 / |b|^2 after iterations of block-Jacobi conjugate gradients.
    Cg { dataset: &'a Dataset, systems: Vec<Mutex<LinearSystem>> },
}

/// A trajectory's linear systems, one at a time.
pub(crate) struct LinearSystem {
    component: Component<f64>,
    encoder: Encoder,
    inputs: Inputs<Vec<f32>>,
    loss: CgLoss,
    start: Vec<Spatial<f64>>,
    gradient: Vec<Spatial<f64>>,
}

impl LinearSystem {
    fn new(trajectory: &Trajectory<'_>, encoding: &Arc<Encoding>) -> Self {
        let topology = trajectory.topology();
        let preconditioner = Preconditioner::new(PreconditionerKind::BlockJacobi, topology, None);
        let zero = vec![Spatial::zero(); topology.joints.len()];
        Self {
            component: trajectory.component(),
            encoder: Encoder::new(encoding.clone(), trajectory.graph().clone(), trajectory.planar_normal()),
            inputs: Inputs::default(),
            loss: CgLoss::new(topology, preconditioner, CG_STEPS),
            start: zero.clone(),
            gradient: zero,
        }
    }
}

impl<'a> Objective<'a> {
    /// The loss through conjugate gradients, on a data set's training samples.
    pub(crate) fn cg(dataset: &'a Dataset, encoding: &Arc<Encoding>) -> Self {
        let trajectories = dataset.trajectories(Split::Train);
        let systems = trajectories.map(|trajectory| Mutex::new(LinearSystem::new(&trajectory, encoding))).collect();
        Self::Cg { dataset, systems }
    }

    /// The share of `chunk` in the loss of a batch of `batch` samples, with `rows` nodes and edges, at these outputs.
    pub(crate) fn evaluate(
        &self,
        samples: &Samples,
        chunk: &Chunk,
        outputs: [&[f32]; 2],
        batch: usize,
        rows: [usize; 2],
    ) -> Evaluated {
        match self {
            Self::MeanSquare => mean_square(chunk, outputs, rows),
            Self::LogSquare => log_square(chunk, outputs, batch),
            Self::Cg { dataset, systems } => {
                let mut evaluated = Evaluated::zero(outputs);
                for (&sample, [nodes, edges]) in chunk.samples.iter().zip(ranges(chunk, outputs)) {
                    let [trajectory, k] = samples.place(sample);
                    let sample = dataset.trajectory(Split::Train, trajectory).and_then(|found| found.sample(k));
                    let (Some(sample), Ok(mut system)) = (sample, systems[trajectory].lock()) else { continue };
                    let LinearSystem { component, encoder, inputs, loss, start, gradient } = &mut *system;
                    sample.restore(component);
                    encoder.raw(component, inputs);
                    encoder.dlambda(component, [&outputs[0][nodes.clone()], &outputs[1][edges.clone()]], start);
                    let value = loss.value_and_gradient(&component.system, start, gradient);
                    if !value.is_finite() {
                        // A start so far off that its residual overflows: it has no gradient.
                        evaluated.left_out += 1;
                        continue;
                    }
                    evaluated.loss += value / batch as f64;
                    let (of_nodes, of_edges) = (&mut evaluated.nodes[nodes], &mut evaluated.edges[edges]);
                    encoder.adjoint(component, gradient, of_nodes, of_edges);
                    of_nodes.iter_mut().chain(of_edges).for_each(|g| *g /= batch as f32);
                }
                evaluated
            }
        }
    }
}

impl Evaluated {
    fn zero(outputs: [&[f32]; 2]) -> Self {
        let [nodes, edges] = outputs.map(|outputs| vec![0.0; outputs.len()]);
        Self { loss: 0.0, nodes, edges, left_out: 0 }
    }
}

/// Where the outputs of each of a chunk's samples stand: of nodes, and of edges.
fn ranges(chunk: &Chunk, outputs: [&[f32]; 2]) -> impl Iterator<Item = [Range<usize>; 2]> {
    let graphs = &chunk.graphs;
    let columns = [outputs[0].len() / graphs.nodes().max(1), outputs[1].len() / graphs.edges().max(1)];
    let mut ends = [0; 2];
    graphs.n_node.iter().zip(&graphs.n_edge).map(move |(&n, &m)| {
        let starts = ends;
        ends = [starts[0] + n as usize * columns[0], starts[1] + m as usize * columns[1]];
        [starts[0]..ends[0], starts[1]..ends[1]]
    })
}

/// Share of a sample's squared targets that its squared error is raised by, so that one learned by heart does not
/// outweigh all others.
const LOG_FLOOR: f64 = 1e-6;

fn log_square(chunk: &Chunk, outputs: [&[f32]; 2], batch: usize) -> Evaluated {
    let mut evaluated = Evaluated::zero(outputs);
    let targets = [&chunk.node_targets, &chunk.edge_targets];
    for ranges in ranges(chunk, outputs) {
        let parts = || (0..2).flat_map(|k| outputs[k][ranges[k].clone()].iter().zip(&targets[k][ranges[k].clone()]));
        let apart = |(x, target): (&f32, &f32)| f64::from(x - target);
        let error: f64 = parts().map(|pair| apart(pair).powi(2)).sum();
        let size: f64 = parts().map(|(_, &target)| f64::from(target).powi(2)).sum();
        if !error.is_finite() {
            evaluated.left_out += 1;
            continue;
        }
        if size == 0.0 {
            // There is nothing to learn, and no scale to measure an error by.
            continue;
        }
        let raised = error + LOG_FLOOR * size;
        evaluated.loss += (raised / size).ln() / batch as f64;
        let gradients = [&mut evaluated.nodes, &mut evaluated.edges];
        for (k, gradients) in gradients.into_iter().enumerate() {
            let pairs = outputs[k][ranges[k].clone()].iter().zip(&targets[k][ranges[k].clone()]);
            for (gradient, pair) in gradients[ranges[k].clone()].iter_mut().zip(pairs) {
                *gradient = (2.0 * apart(pair) / raised / batch as f64) as f32;
            }
        }
    }
    evaluated
}

fn mean_square(chunk: &Chunk, outputs: [&[f32]; 2], rows: [usize; 2]) -> Evaluated {
    let mut loss = 0.0;
    let mut part = |outputs: &[f32], targets: &[f32], own_rows: usize, rows: usize| -> Vec<f32> {
        let columns = targets.len() / own_rows.max(1);
        let inverse = 1.0 / (rows * columns).max(1) as f64;
        let each = |(x, target): (&f32, &f32)| {
            let apart = f64::from(x - target);
            loss += apart * apart * inverse;
            (2.0 * apart * inverse) as f32
        };
        outputs.iter().zip(targets).map(each).collect()
    };
    let nodes = part(outputs[0], &chunk.node_targets, chunk.graphs.nodes(), rows[0]);
    let edges = part(outputs[1], &chunk.edge_targets, chunk.graphs.edges(), rows[1]);
    Evaluated { loss, nodes, edges, left_out: 0 }
}
