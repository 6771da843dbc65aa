//! Scenes in motion, with encoders and guesses for them.
#![allow(dead_code, missing_docs, unreachable_pub)]

#[path = "../../../../graph/tests/all/common/mod.rs"]
pub mod scenes;

use component::Component;
use copingnet::{Encoder, Encoding, Features, GnGuess, Head, Inputs, NetworkConfig, Trained, Weights};
use graph::{Channel, Normal, Norms, Whitening, corrections, planar_normal};
use jointed::linear::LinearSolver;
use jointed::linear::direct::Direct;
use kernels::Spatial;
use nalgebra::{UnitQuaternion, Vector3};
use rod::{Assembly, Material, Model, RodSpec, State, shape};
use scenes::{advance, component, helix, moved, rod, tree, zeros};

use crate::common;

pub const KINDS: [(Features, Head); 3] =
    [(Features::Paper, Head::Full), (Features::BodyFrame, Head::Full), (Features::BodyFrame, Head::Semi)];

/// A planar rod, a helix, a tree, and a planar rod in a plane that is not that of any two axes.
pub fn in_motion(which: usize) -> (Model, State) {
    let (mut model, mut state) = match which {
        1 => helix(40),
        2 => tree(false),
        _ => rod(12, 0.4),
    };
    if which == 3 {
        let turn = UnitQuaternion::from_euler_angles(0.7, 0.3, 1.1);
        (model, state) = moved(&model, &state, turn, Vector3::new(1.0, -2.0, 0.5));
    }
    advance(&model, &mut state, 7);
    (model, state)
}

/// A rod fixed at one end, in the plane of this level direction and z.
pub fn lying(level: Vector3<f64>) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let nodes = shape::straight(Vector3::zeros(), level + 0.4 * Vector3::z(), 3.0, 12);
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 2e5, density: 100.0 };
    let rod = assembly.rod(&RodSpec::new(nodes, 0.05, material));
    assembly.fix(rod.start);
    assembly.finish()
}

/// A component with the exact solution in `dlambda`, an encoder for it, and a guess with random weights.
pub struct Prepared {
    pub encoding: Encoding,
    pub weights: Weights,
    pub normal: Option<Normal>,
    pub component: Component<f64>,
    pub encoder: Encoder,
    pub guess: GnGuess,
}

/// Inputs are whitened by those of the scene itself.
pub fn prepared(kind: (Features, Head), model: &Model, state: &State) -> Prepared {
    let (mut component, graph, _) = component(model, state);
    let mut exact = zeros(graph.edges().len());
    Direct::new(&component.system.topology).unwrap().solve(&component.system, false, &mut exact);
    component.dlambda.copy_from_slice(&exact);
    let mut dp = zeros(graph.nodes().len());
    corrections(&component, &exact, &mut dp);
    let (features, head) = kind;
    let mut encoding = Encoding { features, head, norms: Norms::default(), whitening: features.unwhitened() };
    encoding.norms.include(&dp, &exact);
    let normal = planar_normal(model, state);
    let mut inputs = Inputs::default();
    Encoder::new(encoding.clone().into(), graph.clone(), normal).raw(&component, &mut inputs);
    let fit = |channels: &[Channel], rows: &Vec<f32>| Whitening::fit(channels, [rows.as_slice()]);
    let channels = features.channels();
    encoding.whitening = Inputs {
        nodes: fit(channels.nodes, &inputs.nodes),
        constant_nodes: fit(channels.constant_nodes, &inputs.constant_nodes),
        edges: fit(channels.edges, &inputs.edges),
        constant_edges: fit(channels.constant_edges, &inputs.constant_edges),
    };
    let config = features.configure(head, NetworkConfig { width: 16, scans: 4, ..NetworkConfig::default() });
    let weights = common::weights(config, 1.0);
    let encoder = Encoder::new(encoding.clone().into(), graph.clone(), normal);
    let guess = GnGuess::new(&Trained::new(&weights, encoding.clone()), graph, normal);
    Prepared { encoding, weights, normal, component, encoder, guess }
}

impl Prepared {
    /// What the guess says.
    pub fn predicted(&mut self) -> Vec<Spatial<f64>> {
        let mut dlambda = zeros(self.component.dlambda.len());
        self.guess.predict(&self.component, &mut dlambda);
        dlambda
    }

    /// Numbers of outputs of all nodes, and of all edges.
    pub fn outputs(&self, head: Head) -> [usize; 2] {
        let graph = self.encoder.graph();
        let [of_node, of_edge] = head.outputs();
        [graph.nodes().len() * of_node, graph.edges().len() * of_edge]
    }

    /// Encodes the state, so that outputs can be read.
    pub fn encode(&mut self) {
        self.encoder.encode(&self.component, &mut Inputs::default());
    }
}

/// Largest differences of stretch-shear and of bend-twist multipliers, over the largest expected ones.
pub fn apart(found: &[Spatial<f64>], expected: &[Spatial<f64>]) -> [f64; 2] {
    let norms = |x: Spatial<f64>| [x.linear, x.angular].map(|x| x.norm_squared().sqrt());
    let largest = |[a, b]: [f64; 2], [x, y]: [f64; 2]| [a.max(x), b.max(y)];
    let sizes = expected.iter().copied().map(norms).fold([0.0; 2], largest);
    let errors = found.iter().zip(expected).map(|(a, b)| norms(a.plus(*b, -1.0))).fold([0.0; 2], largest);
    assert!(found.iter().all(|x| x.dot(*x).is_finite()));
    [errors[0] / sizes[0], errors[1] / sizes[1]]
}

/// `count` numbers in [-1, 1] without a pattern.
pub fn numbers(count: usize, seed: f64) -> Vec<f32> {
    (0..count).map(|i| (17.3 * i as f64 + seed).sin() as f32).collect()
}
