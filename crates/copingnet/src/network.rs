//! The network in burn: encoder, GN blocks with residuals, decoder (paper, section 3.2). [`NetworkConfig`] has the
//! formulas.

use burn::module::{Module, Param};
use burn::nn::Linear;
use burn::tensor::{Device, Gradients, IndexingUpdateOp, Int, Tensor, activation};

use crate::parameters::{gradients, set, values};
use crate::tensors::GraphTensors;
use crate::{NetworkConfig, Output, Weights};

/// A perceptron: linear layers, ReLU between them.
#[derive(Module, Debug)]
pub struct Mlp {
    layers: Vec<Linear>,
}

impl Mlp {
    fn zeros(config: &NetworkConfig, inputs: usize, outputs: usize, device: &Device) -> Self {
        let layer = |[i, o]: [usize; 2]| Linear {
            weight: Param::from_tensor(Tensor::zeros([i, o], device)),
            bias: Some(Param::from_tensor(Tensor::zeros([o], device))),
        };
        Self { layers: config.mlp(inputs, outputs).into_iter().map(layer).collect() }
    }

    /// `[rows, inputs] -> [rows, outputs]`
    pub fn forward(&self, mut x: Tensor<2>) -> Tensor<2> {
        for (k, layer) in self.layers.iter().enumerate() {
            if k > 0 {
                x = activation::relu(x);
            }
            x = layer.forward(x);
        }
        x
    }
}

/// Exponential scans along the rods, outwards and inwards (not in the paper).
#[derive(Module, Debug)]
pub struct Scan {
    weight: Param<Tensor<2>>,
    bias: Param<Tensor<1>>,
    decay: Param<Tensor<1>>,
}

impl Scan {
    fn zeros(config: &NetworkConfig, device: &Device) -> Self {
        let channels = 2 * config.scans;
        Self {
            weight: Param::from_tensor(Tensor::zeros([config.width, channels], device)),
            bias: Param::from_tensor(Tensor::zeros([channels], device)),
            decay: Param::from_tensor(Tensor::zeros([channels], device)),
        }
    }

    /// `[n, width] -> [n, 2 scans]`, by doubling: after k rounds each node has heard of all within 2^k hops.
    fn forward(&self, nodes: Tensor<2>, graph: &GraphTensors) -> Tensor<2> {
        let channels = self.decay.dims()[0];
        let half = channels / 2;
        let decay = activation::sigmoid(self.decay.val()).unsqueeze::<2>(); // [1, 2 scans]
        let input = nodes.matmul(self.weight.val()) + self.bias.val().unsqueeze::<2>();
        let input = input * (-decay.clone() + 1.0); // [n, 2 scans]
        let [mut outwards, mut inwards] =
            [0..half, half..channels].map(|range| input.clone().slice([0..graph.n, range]));
        let [mut a, mut b] = [0..half, half..channels].map(|range| decay.clone().slice([0..1, range]));
        for hop in &graph.hops {
            let heard = outwards.clone().select(0, hop.ancestors.clone()) * hop.exists.clone();
            outwards = outwards + heard * a.clone();
            let told = inwards.clone() * b.clone() * hop.exists.clone();
            inwards = inwards.select_assign(0, hop.ancestors.clone(), told, IndexingUpdateOp::Add);
            (a, b) = (a.clone() * a, b.clone() * b);
        }
        Tensor::cat(vec![outwards, inwards], 1)
    }
}

/// One round of message passing, without its residuals.
#[derive(Module, Debug)]
pub struct GnBlock {
    edge: Mlp,
    scan: Option<Scan>,
    node: Mlp,
}

impl GnBlock {
    fn forward(&self, nodes: Tensor<2>, edges: Tensor<2>, graph: &GraphTensors) -> (Tensor<2>, Tensor<2>) {
        let sender = nodes.clone().select(0, graph.senders.clone()); // [m, width]
        let receiver = nodes.clone().select(0, graph.receivers.clone());
        let edges = self.edge.forward(Tensor::cat(vec![edges, sender, receiver], 1));
        let sum = |ends: &Tensor<1, Int>| {
            Tensor::zeros_like(&nodes).select_assign(0, ends.clone(), edges.clone(), IndexingUpdateOp::Add)
        };
        let mut inputs = vec![nodes.clone(), sum(&graph.senders), sum(&graph.receivers)];
        if let Some(scan) = &self.scan {
            inputs.push(scan.forward(nodes, graph));
        }
        (self.node.forward(Tensor::cat(inputs, 1)), edges)
    }
}

/// The network. Its parameters are visited in the order of [`NetworkConfig::tensors`].
#[derive(Module, Debug)]
pub struct Network {
    encode_node: Mlp,
    encode_edge: Mlp,
    blocks: Vec<GnBlock>,
    decode_node: Mlp,
    decode_edge: Option<Mlp>,
    is_tanh: bool,
}

impl NetworkConfig {
    /// A network of these sizes with all parameters zero; [`Network::set`] fills them.
    pub fn init(&self, device: &Device) -> Network {
        let l = self.width;
        let mlp = |inputs, outputs| Mlp::zeros(self, inputs, outputs, device);
        let block = |_| GnBlock {
            edge: mlp(3 * l, l),
            scan: (self.scans > 0).then(|| Scan::zeros(self, device)),
            node: mlp(3 * l + 2 * self.scans, l),
        };
        Network {
            encode_node: mlp(self.node_inputs, l),
            encode_edge: mlp(self.edge_inputs, l),
            blocks: (0..self.gn_blocks).map(block).collect(),
            decode_node: mlp(l, self.node_outputs),
            decode_edge: (self.edge_outputs > 0).then(|| mlp(l, self.edge_outputs)),
            is_tanh: self.output == Output::Tanh,
        }
    }
}

impl Network {
    /// The network with these parameters.
    pub fn new(weights: &Weights, device: &Device) -> Self {
        weights.config().init(device).set(weights.values())
    }

    /// The same network with other parameters, one tensor after the other in the order of [`NetworkConfig::tensors`].
    pub fn set(self, parameters: &[f32]) -> Self {
        set(self, parameters)
    }

    /// The parameters, in the same order.
    pub fn values(&self) -> Vec<f32> {
        values(self)
    }

    /// Gradients with respect to the parameters, in the same order; zero for those that a loss does not depend on.
    pub fn gradients(&self, of: &Gradients) -> Vec<f32> {
        gradients(self, of)
    }

    /// Outputs of the nodes `[n, node_outputs]` and of the edges `[m, edge_outputs]`, if they have any.
    pub fn forward(&self, graph: &GraphTensors) -> (Tensor<2>, Option<Tensor<2>>) {
        let mut nodes = self.encode_node.forward(graph.nodes.clone());
        let output = |x: Tensor<2>| if self.is_tanh { x.tanh() } else { x };
        if self.blocks.is_empty() && self.decode_edge.is_none() {
            // Nothing reads the edges, of which there may be none.
            return (output(self.decode_node.forward(nodes)), None);
        }
        let mut edges = self.encode_edge.forward(graph.edges.clone());
        for block in &self.blocks {
            let (of_nodes, of_edges) = block.forward(nodes.clone(), edges.clone(), graph);
            nodes = nodes + of_nodes;
            edges = edges + of_edges;
        }
        (
            output(self.decode_node.forward(nodes)),
            self.decode_edge.as_ref().map(|decoder| output(decoder.forward(edges))),
        )
    }
}
