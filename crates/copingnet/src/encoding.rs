//! From the solver's state to the network's inputs, and from its outputs to multipliers.

use std::sync::Arc;

use component::Component;
use graph::semi::{self, Semi};
use graph::{Channel, Graph, Normal, Norms, Whitening, body_frame, corrections, mask, paper, project_to_plane, turns};
use kernels::Spatial;
use names::names;
use serde::{Deserialize, Serialize};

use crate::{NetworkConfig, Output};

/// Which inputs a network reads, and in which units and axes its outputs are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Features {
    /// The paper's, in world axes, outputs over the recorded norms ([`graph::paper`]).
    Paper,
    /// Our own, in body frames, with the right-hand side and in its scale ([`graph::body_frame`]).
    BodyFrame,
    /// The same, and what the last steps turned the segments by ([`graph::turns`]); for whole steps only.
    History,
}

/// What the outputs are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Head {
    /// dp and dlambda, 6 a node and 6 an edge (paper, section 3.1).
    Full,
    /// Turns and a part of the moments, 3 a node and 3 an edge, from which kinematics, statics and the bend-twist rows
    /// make the rest ([`graph::semi`]); with body-frame features only.
    Semi,
    /// Turns of a whole step, 3 a node, added to the last steps' ([`graph::turns`]), from which a whole state is made
    /// ([`graph::Lift`]); with history features only.
    Turns,
}

names!(Head { Full = "full", Semi = "semi", Turns = "turns" });

impl Head {
    /// Outputs of a node, and of an edge.
    pub fn outputs(self) -> [usize; 2] {
        match self {
            Self::Full => [paper::NODE_TARGET, paper::EDGE_TARGET],
            Self::Semi => [semi::NODE_OUTPUT, semi::EDGE_OUTPUT],
            Self::Turns => [turns::NODE_OUTPUT, 0],
        }
    }

    /// Whether the outputs can be made of these inputs.
    pub fn fits(self, features: Features) -> bool {
        match features {
            Features::Paper => self == Self::Full,
            Features::BodyFrame => self != Self::Turns,
            Features::History => self == Self::Turns,
        }
    }
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

/// Kinds of the changing inputs of a node, history included.
const HISTORY_CHANNELS: [Channel; body_frame::NODE_CHANGING + turns::NODE_HISTORY] = {
    let mut channels = [Channel::Scalar; body_frame::NODE_CHANGING + turns::NODE_HISTORY];
    let (own, history) = channels.split_at_mut(body_frame::NODE_CHANGING);
    own.copy_from_slice(&body_frame::NODE_CHANGING_CHANNELS);
    history.copy_from_slice(&turns::NODE_HISTORY_CHANNELS);
    channels
};

names!(Features { Paper = "paper", BodyFrame = "body-frame", History = "history" });

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
            Self::History => Inputs { nodes: &HISTORY_CHANNELS, ..Self::BodyFrame.channels() },
        }
    }

    /// Whitening that leaves the inputs as they are.
    pub fn unwhitened(self) -> Inputs<Whitening> {
        self.channels().map(|channels| Whitening::identity(channels.len()))
    }

    /// Puts the numbers of inputs and outputs into a network's configuration.
    pub fn configure(self, head: Head, config: NetworkConfig) -> NetworkConfig {
        let sizes = self.channels().map(|channels| channels.len());
        NetworkConfig {
            node_inputs: sizes.nodes + sizes.constant_nodes,
            constant_node_inputs: sizes.constant_nodes,
            edge_inputs: sizes.edges + sizes.constant_edges,
            constant_edge_inputs: sizes.constant_edges,
            node_outputs: head.outputs()[0],
            edge_outputs: head.outputs()[1],
            output: if self == Self::Paper { Output::Tanh } else { Output::Linear },
            ..config
        }
    }
}

/// Fills a network's inputs for one graph.
pub(crate) trait Encode {
    /// The graph.
    fn graph(&self) -> &Graph;

    /// Fills all inputs for the component's system and time step, and sizes the lists.
    fn encode(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>);

    /// Fills the inputs that change, in lists that [`Self::encode`] has sized.
    fn encode_changing(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>);
}

impl Encode for Encoder {
    fn graph(&self) -> &Graph {
        &self.graph
    }

    fn encode(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        Encoder::encode(self, component, inputs);
    }

    fn encode_changing(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        Encoder::encode_changing(self, component, inputs);
    }
}

impl Encoding {
    /// Whitens all inputs.
    pub fn whiten(&self, inputs: &mut Inputs<Vec<f32>>) {
        self.whiten_changing(inputs);
        self.whitening.constant_nodes.apply(&mut inputs.constant_nodes);
        self.whitening.constant_edges.apply(&mut inputs.constant_edges);
    }

    /// Whitens the inputs that change.
    pub(crate) fn whiten_changing(&self, inputs: &mut Inputs<Vec<f32>>) {
        self.whitening.nodes.apply(&mut inputs.nodes);
        self.whitening.edges.apply(&mut inputs.edges);
    }
}

impl Inputs<Vec<f32>> {
    /// Makes room for the inputs of a graph, and fills those that stay the same over a scene and a time step `dt` [s].
    pub(crate) fn begin(&mut self, features: Features, graph: &Graph, dt: f64) {
        let (n, m) = (graph.nodes().len(), graph.edges().len());
        let sizes = features.channels().map(|channels| channels.len());
        self.nodes.resize(n * sizes.nodes, 0.0);
        self.constant_nodes.resize(n * sizes.constant_nodes, 0.0);
        self.edges.resize(m * sizes.edges, 0.0);
        self.constant_edges.resize(m * sizes.constant_edges, 0.0);
        let (nodes, edges) = (&mut self.constant_nodes, &mut self.constant_edges);
        match features {
            Features::Paper => {
                paper::fill_constant_nodes(graph, nodes);
                paper::fill_edges(graph, edges);
            }
            Features::BodyFrame | Features::History => {
                body_frame::fill_constant_nodes(graph, nodes);
                body_frame::fill_constant_edges(graph, dt, edges);
            }
        }
    }
}

/// Memory to encode one graph's states and to decode the outputs for them. After the first call nothing allocates.
#[derive(Clone, Debug)]
pub struct Encoder {
    encoding: Arc<Encoding>,
    graph: Graph,
    /// Of a planar set: what is predicted stays in its plane.
    normal: Option<Normal>,
    /// Our own features, with the head that makes multipliers of their outputs.
    body_frame: Option<BodyFrame>,
    dp: Vec<Spatial<f64>>,
    /// A gradient within the plane.
    gradient: Vec<Spatial<f64>>,
}

#[derive(Clone, Debug)]
struct BodyFrame {
    features: body_frame::Features,
    semi: Option<Semi>,
    /// Outputs of nodes and of edges, masked.
    outputs: [Vec<f32>; 2],
    /// Scale s of the right-hand side encoded last [m].
    scale: f64,
}

/// Outputs out of a planar set's plane are zero.
pub(crate) fn mask_outputs(head: Head, normal: Option<Normal>, nodes: &mut [f32], edges: &mut [f32]) {
    if let Some(normal) = normal {
        match head {
            Head::Full => {
                mask(&body_frame::NODE_TARGET_CHANNELS, normal, nodes);
                mask(&body_frame::EDGE_TARGET_CHANNELS, normal, edges);
            }
            Head::Semi => {
                mask(&semi::NODE_OUTPUT_CHANNELS, normal, nodes);
                mask(&semi::EDGE_OUTPUT_CHANNELS, normal, edges);
            }
            Head::Turns => mask(&turns::NODE_OUTPUT_CHANNELS, normal, nodes),
        }
    }
}

impl Encoder {
    /// For one connected set of segments. Where a normal of its plane is given, predictions are exactly planar.
    pub fn new(encoding: Arc<Encoding>, graph: Graph, normal: Option<Normal>) -> Self {
        let body_frame = (encoding.features == Features::BodyFrame).then(|| BodyFrame {
            features: body_frame::Features::new(&graph),
            semi: (encoding.head == Head::Semi).then(|| Semi::new(&graph)),
            outputs: [
                vec![0.0; encoding.head.outputs()[0] * graph.nodes().len()],
                vec![0.0; encoding.head.outputs()[1] * graph.edges().len()],
            ],
            scale: 0.0,
        });
        let [dp, gradient] = [graph.nodes().len(), graph.edges().len()].map(|rows| vec![Spatial::zero(); rows]);
        Self { encoding, graph, normal, body_frame, dp, gradient }
    }

    /// The graph.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// Fills all inputs, neither whitened nor clipped, for the component's system and time step. Sizes the lists.
    pub fn raw(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        inputs.begin(self.encoding.features, &self.graph, component.dt());
        self.raw_changing(component, inputs);
    }

    fn raw_changing(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        let (nodes, edges) = (&mut inputs.nodes, &mut inputs.edges);
        match &mut self.body_frame {
            None => paper::fill_changing_nodes(&component.poses, nodes),
            Some(own) => own.scale = own.features.fill(&self.graph, component, nodes, edges),
        }
    }

    /// Fills all inputs for the component's system and time step, and sizes the lists.
    pub fn encode(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        self.raw(component, inputs);
        self.encoding.whiten(inputs);
    }

    /// Fills the inputs that change, in lists that [`Self::encode`] has sized.
    pub fn encode_changing(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        self.raw_changing(component, inputs);
        self.encoding.whiten_changing(inputs);
    }

    /// The outputs that stand for the component's `dlambda`, for the state encoded last: of nodes and of edges, as many
    /// as [`Head::outputs`] a row. Sizes the lists.
    pub fn targets(&mut self, component: &Component<f64>, nodes: &mut Vec<f32>, edges: &mut Vec<f32>) {
        let Self { encoding, graph, normal, body_frame, dp, .. } = self;
        let [of_node, of_edge] = encoding.head.outputs();
        nodes.resize(graph.nodes().len() * of_node, 0.0);
        edges.resize(graph.edges().len() * of_edge, 0.0);
        let dlambda = &component.dlambda;
        corrections(component, dlambda, dp);
        match body_frame {
            None => {
                encoding.norms.fill_node_targets(dp, nodes);
                encoding.norms.fill_edge_targets(dlambda, edges);
            }
            Some(own) => {
                let BodyFrame { features, scale, semi, .. } = own;
                match semi {
                    None => {
                        features.fill_node_targets(graph, component, *scale, dp, nodes);
                        features.fill_edge_targets(graph, component, *scale, dlambda, edges);
                    }
                    Some(_) => {
                        semi::fill_node_targets(graph, component, *scale, dp, nodes);
                        // The rows give the moments of exact turns exactly.
                        edges.fill(0.0);
                    }
                }
                mask_outputs(encoding.head, *normal, nodes, edges);
            }
        }
    }

    /// The multipliers that outputs of nodes and of edges stand for, for the state encoded last.
    pub fn dlambda(&mut self, component: &Component<f64>, outputs: [&[f32]; 2], dlambda: &mut [Spatial<f64>]) {
        let Self { encoding, graph, normal, body_frame, .. } = self;
        let Some(own) = body_frame else {
            encoding.norms.dlambda(outputs[1], dlambda);
            if let Some(normal) = *normal {
                project_to_plane(component, normal, &mut [], dlambda);
            }
            return;
        };
        let [mut nodes, mut edges] = std::mem::take(&mut own.outputs);
        nodes.copy_from_slice(outputs[0]);
        edges.copy_from_slice(outputs[1]);
        mask_outputs(encoding.head, *normal, &mut nodes, &mut edges);
        let BodyFrame { features, scale, semi, .. } = own;
        match semi {
            None => features.dlambda(graph, component, *scale, &edges, dlambda),
            Some(semi) => semi.dlambda(graph, component, features, *scale, &nodes, &edges, dlambda),
        }
        own.outputs = [nodes, edges];
    }

    /// The corrections `dp = M^-1 J^T dlambda` that outputs stand for, for the state encoded last: the paper's own outputs,
    /// and for body-frame outputs what follows from `dlambda`.
    pub fn dp(
        &self,
        component: &Component<f64>,
        outputs: [&[f32]; 2],
        dlambda: &[Spatial<f64>],
        dp: &mut [Spatial<f64>],
    ) {
        if self.body_frame.is_some() {
            corrections(component, dlambda, dp);
            return;
        }
        self.encoding.norms.dp(outputs[0], dp);
        if let Some(normal) = self.normal {
            project_to_plane(component, normal, dp, &mut []);
        }
    }

    /// Gradients of a number with respect to the outputs of nodes and of edges, from its `gradient` with respect to the
    /// multipliers that [`Self::dlambda`] made of them.
    pub fn adjoint(
        &mut self,
        component: &Component<f64>,
        gradient: &[Spatial<f64>],
        nodes: &mut [f32],
        edges: &mut [f32],
    ) {
        let Self { encoding, graph, normal, body_frame, gradient: projected, .. } = self;
        match body_frame {
            None => {
                nodes.fill(0.0);
                // The projection to a plane is symmetric: it is its own adjoint.
                projected.copy_from_slice(gradient);
                if let Some(normal) = *normal {
                    project_to_plane(component, normal, &mut [], projected);
                }
                encoding.norms.dlambda_adjoint(projected, edges);
            }
            Some(own) => {
                let BodyFrame { features, scale, semi, .. } = own;
                match semi {
                    None => {
                        nodes.fill(0.0);
                        features.dlambda_adjoint(graph, component, *scale, gradient, edges);
                    }
                    Some(semi) => semi.adjoint(graph, component, features, *scale, gradient, nodes, edges),
                }
                mask_outputs(encoding.head, *normal, nodes, edges);
            }
        }
    }
}
