//! What is made small: a loss of the network's outputs, with its gradient with respect to them.
//!
//! The gradient goes on through the network by automatic differentiation of `sum(outputs * gradient)`, the gradient
//! standing as a constant: the loss itself need not be made of tensors.

use std::sync::{Arc, Mutex};

use copingnet::{CgLoss, Encoder, Encoding, Inputs};
use dataset::{Dataset, Split, Trajectory};
use solver::component::Component;
use solver::linear::precondition::{Preconditioner, PreconditionerKind};
use solver::system::Six;

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
}

/// A loss of the outputs on training samples.
pub(crate) enum Objective<'a> {
    /// MSE(V) + MSE(E) (paper, section 3.2), over all components of the batch.
    MeanSquare,
    /// The mean over the samples of ln of |r|^2 / |b|^2 after iterations of block-Jacobi conjugate gradients.
    Cg { dataset: &'a Dataset, systems: Vec<Mutex<LinearSystem>> },
}

/// A trajectory's linear systems, one at a time.
pub(crate) struct LinearSystem {
    component: Component<f64>,
    encoder: Encoder,
    inputs: Inputs<Vec<f32>>,
    loss: CgLoss,
    start: Vec<Six<f64>>,
    gradient: Vec<Six<f64>>,
}

impl LinearSystem {
    fn new(trajectory: &Trajectory<'_>, encoding: &Arc<Encoding>) -> Self {
        let topology = trajectory.topology();
        let preconditioner = Preconditioner::new(PreconditionerKind::BlockJacobi, topology, None);
        let zero = vec![Six::zero(); topology.joints.len()];
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
            Self::Cg { dataset, systems } => {
                let mut evaluated =
                    Evaluated { loss: 0.0, nodes: vec![0.0; outputs[0].len()], edges: vec![0.0; outputs[1].len()] };
                let [mut node, mut edge] = [0; 2];
                for (&sample, (&n, &m)) in
                    chunk.samples.iter().zip(chunk.graphs.n_node.iter().zip(&chunk.graphs.n_edge))
                {
                    let [trajectory, k] = samples.place(sample);
                    let nodes = node..node + n as usize * outputs[0].len() / chunk.graphs.nodes();
                    let edges = edge..edge + m as usize * outputs[1].len() / chunk.graphs.edges();
                    (node, edge) = (nodes.end, edges.end);
                    let sample = dataset.trajectory(Split::Train, trajectory).and_then(|found| found.sample(k));
                    let (Some(sample), Ok(mut system)) = (sample, systems[trajectory].lock()) else { continue };
                    let LinearSystem { component, encoder, inputs, loss, start, gradient } = &mut *system;
                    sample.restore(component);
                    encoder.raw(component, inputs);
                    encoder.dlambda(component, [&outputs[0][nodes.clone()], &outputs[1][edges.clone()]], start);
                    let value = loss.value_and_gradient(&component.system, start, gradient);
                    if !value.is_finite() {
                        // A start so far off that its residual overflows: it has no gradient, and is left out.
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
    Evaluated { loss, nodes, edges }
}
