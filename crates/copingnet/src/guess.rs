//! The learned start of a linear solve (the paper's correctionGuess, its first equation).
//!
//! Networks are trained on the first outer iteration of every step and start that one alone. What a second iteration
//! asks for is hundreds of times smaller, but the paper's inputs, poses, hardly tell the two apart: trained on both, its
//! network learns almost nothing.

use std::sync::Arc;

use component::Component;
use dynamics::guess::InitialGuess;
use dynamics::projection::Projection;
use graph::{Batch, Graph, Normal};
use kernels::Spatial;

use crate::encoding::Encode;
use crate::inference::{Forward, Packed};
use crate::{Encoder, Encoding, Inputs, Weights};

/// A trained network ready for use, to be shared by all guesses.
#[derive(Clone, Debug)]
pub struct Trained {
    packed: Arc<Packed>,
    pub(crate) encoding: Arc<Encoding>,
}

impl Trained {
    /// From weights and what their inputs and outputs mean.
    pub fn new(weights: &Weights, encoding: Encoding) -> Self {
        Self { packed: Arc::new(Packed::new(weights)), encoding: Arc::new(encoding) }
    }

    /// What its inputs and outputs mean.
    pub fn encoding(&self) -> &Encoding {
        &self.encoding
    }
}

/// A network at work on one graph. Only the first call allocates.
#[derive(Debug)]
pub(crate) struct Prediction {
    packed: Arc<Packed>,
    inputs: Inputs<Vec<f32>>,
    /// The forward pass, and the time step [s] that its constant inputs are for.
    forward: Option<(Forward, f64)>,
}

impl Prediction {
    pub(crate) fn new(trained: &Trained) -> Self {
        Self { packed: trained.packed.clone(), inputs: Inputs::default(), forward: None }
    }

    /// The outputs of nodes and of edges for the component's system and time step.
    pub(crate) fn run(&mut self, encoder: &mut impl Encode, component: &Component<f64>) -> [&[f32]; 2] {
        let Self { packed, inputs, forward } = self;
        let dt = component.dt();
        let forward = match forward {
            Some((forward, last)) => {
                if *last == dt {
                    encoder.encode_changing(component, inputs);
                } else {
                    encoder.encode(component, inputs);
                    forward.set_constants(&inputs.constant_nodes, &inputs.constant_edges);
                    *last = dt;
                }
                forward
            }
            None => {
                encoder.encode(component, inputs);
                let mut graphs = Batch::default();
                graphs.push(encoder.graph());
                let (nodes, edges) = (&inputs.constant_nodes, &inputs.constant_edges);
                let new = Forward::new(packed.clone(), &graphs, nodes, edges);
                &mut forward.insert((new, dt)).0
            }
        };
        forward.run(&inputs.nodes, &inputs.edges);
        [forward.node_outputs(), forward.edge_outputs()]
    }

    /// The outputs of the last run; none before the first.
    fn outputs(&self) -> Option<[&[f32]; 2]> {
        self.forward.as_ref().map(|(forward, _)| [forward.node_outputs(), forward.edge_outputs()])
    }
}

/// Starts linear solves from a network's prediction. Only the first call allocates.
#[derive(Debug)]
pub struct GnGuess {
    prediction: Prediction,
    encoder: Encoder,
}

impl GnGuess {
    /// The guess for one connected set of segments. Where it is planar, `normal` says how.
    pub fn new(trained: &Trained, graph: Graph, normal: Option<Normal>) -> Self {
        Self { prediction: Prediction::new(trained), encoder: Encoder::new(trained.encoding.clone(), graph, normal) }
    }

    /// Predicts dlambda for the component's system, one entry an edge.
    pub fn predict(&mut self, component: &Component<f64>, dlambda: &mut [Spatial<f64>]) {
        let outputs = self.prediction.run(&mut self.encoder, component);
        self.encoder.dlambda(component, outputs, dlambda);
    }
}

impl Projection for GnGuess {
    fn project(&mut self, component: &Component<f64>, _: usize, dp: &mut [Spatial<f64>], dlambda: &mut [Spatial<f64>]) {
        self.predict(component, dlambda);
        if let Some(outputs) = self.prediction.outputs() {
            self.encoder.dp(component, outputs, dlambda, dp);
        }
    }
}

impl InitialGuess for GnGuess {
    fn helps_solves(&self) -> bool {
        true
    }

    fn start_solve(&mut self, component: &Component<f64>, iteration: usize, dlambda: &mut [Spatial<f64>]) -> bool {
        let is_first = iteration == 0;
        if is_first {
            self.predict(component, dlambda);
        }
        is_first
    }
}
