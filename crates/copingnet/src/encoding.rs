//! From the solver's state to the network's inputs, and from its outputs to multipliers.

use graph::body_frame::{self, Features as BodyFrame};
use graph::{Channel, Graph, Normal, Norms, Whitening, corrections, paper};
use serde::{Deserialize, Serialize};
use solver::component::Component;
use solver::system::Six;

use crate::{NetworkConfig, Output};

/// Which inputs a network reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Features {
    /// The paper's, in world axes ([`graph::paper`]).
    Paper,
    /// Our own, in body frames, with the right-hand side ([`graph::body_frame`]).
    BodyFrame,
}

/// What a network's outputs mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Head {
    /// dp and dlambda, 6 and 6 (paper, section 3.1).
    Full,
    /// dphi and the bend-twist part of dlambda, 3 and 3; the rest follows from the stretch-shear rows and from statics.
    Semi,
}

/// Of each kind of inputs or outputs, one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inputs<T> {
    /// Of nodes, changing from solve to solve.
    pub nodes: T,
    /// Of nodes, the same over a scene.
    pub constant_nodes: T,
    /// Of edges, changing from solve to solve.
    pub edges: T,
    /// Of edges, the same over a scene and a time step.
    pub constant_edges: T,
}

impl<T> Inputs<T> {
    /// All four, in this order.
    pub fn all(&self) -> [&T; 4] {
        [&self.nodes, &self.constant_nodes, &self.edges, &self.constant_edges]
    }

    /// Makes one of each.
    pub fn map<U>(&self, mut f: impl FnMut(&T) -> U) -> Inputs<U> {
        Inputs {
            nodes: f(&self.nodes),
            constant_nodes: f(&self.constant_nodes),
            edges: f(&self.edges),
            constant_edges: f(&self.constant_edges),
        }
    }
}

/// All that is needed beside the weights to read a network's outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Encoding {
    /// Inputs.
    pub features: Features,
    /// Outputs.
    pub head: Head,
    /// What the paper's outputs are multiplied with.
    pub norms: Norms,
    /// How inputs are brought to unit size.
    pub whitening: Inputs<Whitening>,
}

impl Head {
    /// Outputs of a node, and of an edge.
    pub fn outputs(self) -> usize {
        match self {
            Self::Full => 6,
            Self::Semi => 3,
        }
    }
}

impl Features {
    /// Kinds of the inputs.
    pub fn channels(self) -> Inputs<&'static [Channel]> {
        match self {
            Self::Paper => Inputs {
                nodes: &[Channel::Scalar; paper::NODE_CHANGING],
                constant_nodes: &[Channel::Scalar; paper::NODE_CONSTANT],
                edges: &[],
                constant_edges: &[Channel::Scalar; paper::EDGE],
            },
            Self::BodyFrame => Inputs {
                nodes: &body_frame::NODE_CHANGING_CHANNELS,
                constant_nodes: &body_frame::NODE_CONSTANT_CHANNELS,
                edges: &body_frame::EDGE_CHANGING_CHANNELS,
                constant_edges: &body_frame::EDGE_CONSTANT_CHANNELS,
            },
        }
    }

    /// Puts the number of inputs into a network's configuration.
    pub fn configure(self, head: Head, config: NetworkConfig) -> NetworkConfig {
        let sizes = self.channels().map(|channels| channels.len());
        NetworkConfig {
            node_inputs: sizes.nodes + sizes.constant_nodes,
            constant_node_inputs: sizes.constant_nodes,
            edge_inputs: sizes.edges + sizes.constant_edges,
            constant_edge_inputs: sizes.constant_edges,
            node_outputs: head.outputs(),
            edge_outputs: head.outputs(),
            output: if self == Self::Paper { Output::Tanh } else { Output::Linear },
            ..config
        }
    }
}

/// Memory to encode one graph's states and to decode the outputs for them. After the first call nothing allocates.
#[derive(Clone, Debug)]
pub struct Encoder {
    encoding: Encoding,
    graph: Graph,
    /// Of a planar set: outputs out of its plane are zero.
    normal: Option<Normal>,
    features: Option<BodyFrame>,
    /// Scale s of the right-hand side encoded last [m].
    scale: f64,
    dp: Vec<Six<f64>>,
}

impl Encoder {
    /// How states are encoded.
    pub fn encoding(&self) -> &Encoding {
        &self.encoding
    }

    /// For one connected set of segments. `normal` restricts body-frame outputs to a plane.
    pub fn new(encoding: Encoding, graph: Graph, normal: Option<Normal>) -> Self {
        let features = (encoding.features == Features::BodyFrame).then(|| BodyFrame::new(&graph));
        let dp = vec![Six::zero(); graph.nodes().len()];
        Self { encoding, graph, normal, features, scale: 0.0, dp }
    }

    /// The graph.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// Fills all inputs, neither whitened nor clipped, for the component's system and time step. Sizes the lists.
    pub fn raw(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        let (n, m) = (self.graph.nodes().len(), self.graph.edges().len());
        let sizes = self.encoding.features.channels().map(|channels| channels.len());
        inputs.nodes.resize(n * sizes.nodes, 0.0);
        inputs.constant_nodes.resize(n * sizes.constant_nodes, 0.0);
        inputs.edges.resize(m * sizes.edges, 0.0);
        inputs.constant_edges.resize(m * sizes.constant_edges, 0.0);
        self.raw_constants(component.dt(), &mut inputs.constant_nodes, &mut inputs.constant_edges);
        self.raw_changing(component, &mut inputs.nodes, &mut inputs.edges);
    }

    fn raw_constants(&self, dt: f64, nodes: &mut [f32], edges: &mut [f32]) {
        match self.encoding.features {
            Features::Paper => {
                paper::fill_constant_nodes(&self.graph, nodes);
                paper::fill_edges(&self.graph, edges);
            }
            Features::BodyFrame => {
                body_frame::fill_constant_nodes(&self.graph, nodes);
                body_frame::fill_constant_edges(&self.graph, dt, edges);
            }
        }
    }

    fn raw_changing(&mut self, component: &Component<f64>, nodes: &mut [f32], edges: &mut [f32]) {
        match &mut self.features {
            None => paper::fill_changing_nodes(&component.poses, nodes),
            Some(features) => self.scale = features.fill(&self.graph, component, nodes, edges),
        }
    }

    /// Fills the inputs for the component's system and time step, and sizes the lists.
    pub fn encode(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        self.raw(component, inputs);
        let whitening = &self.encoding.whitening;
        whitening.nodes.apply(&mut inputs.nodes);
        whitening.constant_nodes.apply(&mut inputs.constant_nodes);
        whitening.edges.apply(&mut inputs.edges);
        whitening.constant_edges.apply(&mut inputs.constant_edges);
    }

    /// Fills the inputs that change only: of nodes `[n, changing]`, of edges `[m, changing]`.
    pub fn encode_changing(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        self.raw_changing(component, &mut inputs.nodes, &mut inputs.edges);
        self.encoding.whitening.nodes.apply(&mut inputs.nodes);
        self.encoding.whitening.edges.apply(&mut inputs.edges);
    }

    /// The outputs that stand for the component's `dlambda`, for the state encoded last: of nodes, of edges.
    pub fn targets(&mut self, component: &Component<f64>, nodes: &mut Vec<f32>, edges: &mut Vec<f32>) {
        let Self { encoding, graph, features, scale, dp, .. } = self;
        let columns = encoding.head.outputs();
        nodes.resize(graph.nodes().len() * columns, 0.0);
        edges.resize(graph.edges().len() * columns, 0.0);
        corrections(component, &component.dlambda, dp);
        match features {
            None => {
                encoding.norms.fill_node_targets(dp, nodes);
                encoding.norms.fill_edge_targets(&component.dlambda, edges);
            }
            Some(features) => {
                features.fill_node_targets(graph, component, *scale, dp, nodes);
                features.fill_edge_targets(graph, component, *scale, &component.dlambda, edges);
            }
        }
    }

    /// The multipliers that the outputs of nodes and edges stand for, for the state encoded last.
    pub fn dlambda(&mut self, component: &Component<f64>, outputs: [&[f32]; 2], dlambda: &mut [Six<f64>]) {
        let [_, of_edges] = outputs;
        match &self.features {
            None => self.encoding.norms.dlambda(of_edges, dlambda),
            Some(features) => features.dlambda(&self.graph, component, self.scale, of_edges, dlambda),
        }
    }
}
