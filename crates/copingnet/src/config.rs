//! Sizes of a network, and the order of its parameters.

use serde::{Deserialize, Serialize};

/// What the outputs pass through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Output {
    /// tanh: outputs in [-1, 1] (paper, section 3.2).
    #[default]
    Tanh,
    /// Nothing.
    Linear,
}

/// Sizes of a network. The default is the paper's: 3 GN blocks of two-layer perceptrons of width 32.
///
/// With MLP a perceptron of `mlp_layers` linear layers, ReLU between them, and width `width` within:
///
/// ```text
/// V = MLP_node(nodes)                                   encoder    nodes [n, node_inputs]
/// E = MLP_edge(edges)                                              edges [m, edge_inputs]
/// E' = MLP_edge([E, V[senders], V[receivers]])          GN block, gn_blocks times
/// H  = scans of V W + w                                            [n, 2 scans], where scans > 0
/// V' = MLP_node([V, sum of E' sent, sum of E' received, H])
/// V <- V + V',  E <- E + E'                                        residuals
/// V_out = output(MLP_node(V))                           decoder    [n, node_outputs]
/// E_out = output(MLP_edge(E))                                      [m, edge_outputs]
/// ```
///
/// Scans (not in the paper) carry what message passing cannot in a few hops: with u = V W + w and decays a in (0, 1),
/// the first `scans` channels run outwards from the roots, `h_i = (1 - a) u_i + a h_parent(i)`, the others inwards,
/// `h_i = (1 - a) u_i + a (sum of h over i's children)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkConfig {
    /// Inputs a node.
    pub node_inputs: usize,
    /// How many of them, the last ones, stay the same over a scene.
    pub constant_node_inputs: usize,
    /// Inputs an edge.
    pub edge_inputs: usize,
    /// How many of them, the last ones, stay the same over a scene.
    pub constant_edge_inputs: usize,
    /// Outputs a node.
    pub node_outputs: usize,
    /// Outputs an edge; with 0 there is no decoder for edges.
    pub edge_outputs: usize,
    /// GN blocks M.
    pub gn_blocks: usize,
    /// Linear layers of every perceptron, at least 1.
    pub mlp_layers: usize,
    /// Latent size l.
    pub width: usize,
    /// Scans outwards, and as many inwards, in every GN block; 0 for none.
    pub scans: usize,
    /// What the outputs pass through.
    pub output: Output,
}

impl Default for NetworkConfig {
    fn default() -> Self {
        Self {
            node_inputs: graph::paper::NODE,
            constant_node_inputs: graph::paper::NODE - graph::paper::NODE_CHANGING,
            edge_inputs: graph::paper::EDGE,
            constant_edge_inputs: graph::paper::EDGE,
            node_outputs: graph::paper::NODE_TARGET,
            edge_outputs: graph::paper::EDGE_TARGET,
            gn_blocks: 3,
            mlp_layers: 2,
            width: 32,
            scans: 0,
            output: Output::Tanh,
        }
    }
}

/// One parameter tensor of a network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TensorSpec {
    /// Name, such as `block.0.edge.1.weight`.
    pub name: String,
    /// Shape: `[inputs, outputs]` of a weight, `[outputs]` of a bias, `[2 scans]` of decays.
    pub shape: Vec<usize>,
}

impl TensorSpec {
    /// Number of values.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl NetworkConfig {
    /// Whether no input of an edge changes over a scene, so that edges are encoded once.
    pub fn has_constant_edges(&self) -> bool {
        self.constant_edge_inputs == self.edge_inputs
    }

    /// Inputs and outputs of each layer of a perceptron.
    pub fn mlp(&self, inputs: usize, outputs: usize) -> Vec<[usize; 2]> {
        let last = self.mlp_layers.saturating_sub(1);
        (0..=last)
            .map(|k| [if k == 0 { inputs } else { self.width }, if k == last { outputs } else { self.width }])
            .collect()
    }

    /// All parameter tensors, in the order in which [`crate::Weights`] holds them: of the encoder's `encoder.node` and
    /// `encoder.edge`, of each block `block.K.edge`, `block.K.scan` (weight, bias, decay; where there are scans) and
    /// `block.K.node`, of the decoder `decoder.node` and, where edges have outputs, `decoder.edge`; of
    /// each layer weight, then bias.
    pub fn tensors(&self) -> Vec<TensorSpec> {
        let (l, mut specs) = (self.width, Vec::new());
        self.push_mlp("encoder.node", self.node_inputs, l, &mut specs);
        self.push_mlp("encoder.edge", self.edge_inputs, l, &mut specs);
        for k in 0..self.gn_blocks {
            self.push_mlp(&format!("block.{k}.edge"), 3 * l, l, &mut specs);
            if self.scans > 0 {
                let mut push =
                    |name: &str, shape| specs.push(TensorSpec { name: format!("block.{k}.scan.{name}"), shape });
                push("weight", vec![l, 2 * self.scans]);
                push("bias", vec![2 * self.scans]);
                push("decay", vec![2 * self.scans]);
            }
            self.push_mlp(&format!("block.{k}.node"), 3 * l + 2 * self.scans, l, &mut specs);
        }
        self.push_mlp("decoder.node", l, self.node_outputs, &mut specs);
        if self.edge_outputs > 0 {
            self.push_mlp("decoder.edge", l, self.edge_outputs, &mut specs);
        }
        specs
    }

    fn push_mlp(&self, name: &str, inputs: usize, outputs: usize, specs: &mut Vec<TensorSpec>) {
        for (k, [i, o]) in self.mlp(inputs, outputs).into_iter().enumerate() {
            specs.push(TensorSpec { name: format!("{name}.{k}.weight"), shape: vec![i, o] });
            specs.push(TensorSpec { name: format!("{name}.{k}.bias"), shape: vec![o] });
        }
    }
}
