//! The learned start of a whole step, for the formulation with a momentum residual, which corrects it.
//!
//! The network sees the prediction p*, its constraints and the turns of the last steps, and says what to add to their
//! continuation. Positions and multipliers follow from the orientations ([`graph::Lift`]): a network's errors would open
//! the joints, and stretching is a thousand times stiffer than bending.

use std::sync::Arc;

use graph::turns::{NODE_OUTPUT, Turns};
use graph::{Graph, Lift, Normal, body_frame};
use solver::component::{Component, Pose};
use solver::guess::InitialGuess;
use solver::system::Six;

use crate::encoding::{Encode, mask_outputs};
use crate::guess::Prediction;
use crate::{Encoding, Inputs, Trained};

/// Memory to encode the starts of one graph's steps and to decode the outputs for them. Only the first call of
/// [`Self::encode`] allocates.
#[derive(Clone, Debug)]
pub struct StepEncoder {
    encoding: Arc<Encoding>,
    graph: Graph,
    /// Of a planar set: what is predicted stays in its plane.
    normal: Option<Normal>,
    features: body_frame::Features,
    turns: Turns,
    /// Scale s of the right-hand side encoded last [m].
    scale: f64,
}

impl StepEncoder {
    /// For one connected set of segments and an encoding of history features. Where a normal of its plane is given,
    /// predictions are exactly planar.
    pub fn new(encoding: Arc<Encoding>, graph: Graph, normal: Option<Normal>) -> Self {
        let (features, turns) = (body_frame::Features::new(&graph), Turns::new(&graph));
        Self { encoding, graph, normal, features, turns, scale: 0.0 }
    }

    /// Fills all inputs, neither whitened nor clipped, for a step from the prediction at which the component's system is
    /// evaluated. Sizes the lists.
    pub fn raw(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        inputs.begin(self.encoding.features, &self.graph, component.dt());
        self.raw_changing(component, inputs);
    }

    fn raw_changing(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        let Self { graph, features, turns, scale, .. } = self;
        *scale = features.fill(graph, component, &mut inputs.nodes, &mut inputs.edges);
        turns.begin(component.dt());
        turns.fill(graph, *scale, body_frame::NODE_CHANGING, &mut inputs.nodes);
    }

    /// The outputs that stand for the component's step, encoded last and just done. Sizes the list.
    pub fn targets(&self, component: &Component<f64>, nodes: &mut Vec<f32>) {
        nodes.resize(self.graph.nodes().len() * NODE_OUTPUT, 0.0);
        self.turns.fill_targets(&self.graph, component, self.scale, nodes);
        mask_outputs(self.encoding.head, self.normal, nodes, &mut []);
    }

    /// Turns `poses`, which come as the prediction, by what the nodes' outputs say.
    fn turn(&self, outputs: &[f32], poses: &mut [Pose<f64>]) {
        for (i, (pose, outputs)) in poses.iter_mut().zip(outputs.chunks_exact(NODE_OUTPUT)).enumerate() {
            if self.graph.is_fixed(i) {
                continue;
            }
            let mut outputs = [outputs[0], outputs[1], outputs[2]];
            mask_outputs(self.encoding.head, self.normal, &mut outputs, &mut []);
            let turn = self.turns.decode(&self.graph, self.scale, i, &outputs);
            pose.q = pose.q.turned(pose.q.rotate(turn));
        }
    }

    /// Learns how the step ended that was encoded last; one that was not done whole leaves no history.
    pub fn observe(&mut self, component: &Component<f64>, is_whole: bool) {
        if is_whole {
            self.turns.push(component);
        } else {
            self.turns.clear();
        }
    }
}

impl Encode for StepEncoder {
    fn graph(&self) -> &Graph {
        &self.graph
    }

    fn encode(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        self.raw(component, inputs);
        self.encoding.whiten(inputs);
    }

    fn encode_changing(&mut self, component: &Component<f64>, inputs: &mut Inputs<Vec<f32>>) {
        self.raw_changing(component, inputs);
        self.encoding.whiten_changing(inputs);
    }
}

/// Starts whole steps from a network's prediction. Only the first call allocates.
#[derive(Debug)]
pub struct GnStepGuess {
    prediction: Prediction,
    encoder: StepEncoder,
    lift: Lift,
    /// Starts asked for in the step under way: more than one where it is done in substeps.
    asked: u32,
}

impl GnStepGuess {
    /// The guess for one connected set of segments, by a network with history features. Where the set is planar, `normal`
    /// says how.
    pub fn new(trained: &Trained, graph: Graph, normal: Option<Normal>) -> Self {
        let lift = Lift::new(&graph);
        let encoder = StepEncoder::new(trained.encoding.clone(), graph, normal);
        Self { prediction: Prediction::new(trained), encoder, lift, asked: 0 }
    }
}

impl InitialGuess for GnStepGuess {
    fn helps_steps(&self) -> bool {
        true
    }

    /// The residual says little about a start: errors of the turns that are ten times smaller than an extrapolation's still
    /// have a greater residual, because they bend neighbours against each other.
    fn trust(&self) -> f64 {
        std::env::var("TRUST").map_or(1e3, |x| x.parse().unwrap())
    }

    fn start_step(&mut self, component: &Component<f64>, poses: &mut [Pose<f64>], lambda: &mut [Six<f64>]) -> bool {
        self.asked += 1;
        if self.asked > 1 {
            return false;
        }
        let [nodes, _] = self.prediction.run(&mut self.encoder, component);
        self.encoder.turn(nodes, poses);
        self.lift.fill(&self.encoder.graph, component, poses, lambda);
        true
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        let is_whole = std::mem::take(&mut self.asked) <= 1;
        self.encoder.observe(component, is_whole);
    }
}
