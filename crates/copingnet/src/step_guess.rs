//! The learned start of a whole step, for the formulation with a momentum residual, which corrects it.
//!
//! The network sees the prediction p*, its constraints and the turns of the last steps, and says what to add to their
//! continuation. Positions and multipliers follow from the orientations ([`graph::Lift`]): a network's errors would open
//! the joints, and stretching is a thousand times stiffer than bending.

use std::sync::Arc;

use component::{BodyPose, Component};
use dynamics::guess::InitialGuess;
use dynamics::snapshot::StateVisitor;
use graph::turns::{NODE_OUTPUT, NODE_OUTPUT_CHANNELS, Turns};
use graph::{Graph, Lift, Normal, body_frame};
use kernels::Spatial;
use kernels::dispatch::vectorized;
use kernels::math::Vec3;

use crate::encoding::{Encode, mask_outputs};
use crate::guess::Prediction;
use crate::{Encoding, Inputs, Trained};

/// Memory to encode the starts of one graph's steps and to decode the outputs for them.
#[derive(Clone, Debug)]
pub struct StepEncoder {
    encoding: Arc<Encoding>,
    graph: Graph,
    /// Of a planar set: what the network adds stays in its plane.
    normal: Option<Normal>,
    features: body_frame::Features,
    turns: Turns,
    /// Scale s of the right-hand side encoded last [m].
    scale: f64,
}

impl StepEncoder {
    /// For one connected set of segments and an encoding of history features. Where a normal of its plane is given,
    /// what the network adds is exactly planar.
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
        vectorized(
            #[inline(always)]
            || turns.fill(graph, *scale, body_frame::NODE_CHANGING, &mut inputs.nodes),
        );
    }

    /// The outputs that stand for the component's step, encoded last and just done. Sizes the list.
    pub fn targets(&self, component: &Component<f64>, nodes: &mut Vec<f32>) {
        nodes.resize(self.graph.nodes().len() * NODE_OUTPUT, 0.0);
        self.turns.fill_targets(&self.graph, component, self.scale, nodes);
        mask_outputs(self.encoding.head, self.normal, nodes, &mut []);
    }

    /// Turns `poses`, which come as the prediction, by what the nodes' outputs say.
    fn turn(&self, outputs: &[f32], poses: &mut [BodyPose<f64>]) {
        let Self { graph, turns, scale, .. } = self;
        let kept = self.normal.map_or([1.0; 3], |normal| {
            NODE_OUTPUT_CHANNELS.map(|channel| if channel.is_even(normal) { 1.0 } else { 0.0 })
        });
        vectorized(
            #[inline(always)]
            || {
                for (i, (pose, outputs)) in poses.iter_mut().zip(outputs.chunks_exact(NODE_OUTPUT)).enumerate() {
                    if !graph.is_fixed(i) {
                        let outputs = [outputs[0] * kept[0], outputs[1] * kept[1], outputs[2] * kept[2]];
                        let turn = turns.decode(graph, *scale, i, &outputs);
                        pose.q = pose.q.turned(pose.q.rotate(turn));
                    }
                }
            },
        );
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

/// Which stretch-shear multipliers to begin with: those that the start's positions ask for, or the last steps' continued.
///
/// They matter through the geometric stiffness. With small time steps forces change little from step to step, while a small
/// error of the positions asks for large ones; with large time steps it is the other way round. So those are taken that
/// were nearer the last time.
#[derive(Clone, Debug)]
struct Tensions {
    /// Of the last two steps, the newest first, in the frame of body a.
    kept: [Vec<Vec3<f64>>; 2],
    known: usize,
    /// Their time step [s].
    dt: f64,
    /// Of the step under way: what its start's positions ask for, and the last steps' continued, in world axes.
    choices: [Vec<Vec3<f64>>; 2],
    /// Whether the second were nearer the last time.
    takes_continued: bool,
}

impl Tensions {
    fn new(edges: usize) -> Self {
        let zero = || std::array::from_fn(|_| vec![Vec3::zero(); edges]);
        Self { kept: zero(), known: 0, dt: 0.0, choices: zero(), takes_continued: false }
    }

    /// `lambda` comes as what the positions of `poses` ask for.
    fn choose(&mut self, component: &Component<f64>, poses: &[BodyPose<f64>], lambda: &mut [Spatial<f64>]) {
        if component.dt() != self.dt {
            (self.known, self.dt) = (0, component.dt());
        }
        let weights = match self.known {
            0 => return,
            1 => [1.0, 0.0],
            _ => [2.0, -1.0],
        };
        let [asked, continued] = &mut self.choices;
        for (k, (lambda, &[a, _])) in lambda.iter_mut().zip(&component.system.topology.joints).enumerate() {
            asked[k] = lambda.linear;
            continued[k] = poses[a as usize].q.rotate(self.kept[0][k] * weights[0] + self.kept[1][k] * weights[1]);
            if self.takes_continued {
                lambda.linear = continued[k];
            }
        }
    }

    /// Shows a visitor all that is known between steps.
    fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.kept.iter_mut().for_each(|kept| visitor.list(kept, StateVisitor::vector));
        visitor.count(&mut self.known);
        visitor.number(&mut self.dt);
        visitor.flag(&mut self.takes_continued);
    }

    /// Learns how a step ended.
    fn observe(&mut self, component: &Component<f64>, is_whole: bool) {
        if !is_whole {
            self.known = 0;
            return;
        }
        self.kept.rotate_right(1);
        let mut apart = [0.0; 2];
        for (k, (lambda, &[a, _])) in component.lambda.iter().zip(&component.system.topology.joints).enumerate() {
            for (apart, choice) in apart.iter_mut().zip(&self.choices) {
                *apart += (lambda.linear - choice[k]).norm_squared();
            }
            self.kept[0][k] = component.poses[a as usize].q.rotate_back(lambda.linear);
        }
        self.takes_continued = self.known == 0 || apart[1] < apart[0];
        self.known = (self.known + 1).min(2);
    }
}

/// Starts whole steps from a network's prediction. Only the first call allocates.
#[derive(Debug)]
pub struct GnStepGuess {
    prediction: Prediction,
    encoder: StepEncoder,
    lift: Lift,
    tensions: Tensions,
    /// Whether positions follow from orientations: no joint closes a loop or a way between two clamps.
    is_open: bool,
    /// Starts asked for in the step under way: more than one where it is done in substeps.
    asked: u32,
}

impl GnStepGuess {
    /// The guess for one connected set of segments, by a network with history features. Where the set is planar, `normal`
    /// says how.
    pub fn new(trained: &Trained, graph: Graph, normal: Option<Normal>) -> Self {
        let is_open = graph.visits().len() == graph.edges().len();
        let (lift, tensions) = (Lift::new(&graph), Tensions::new(graph.edges().len()));
        let encoder = StepEncoder::new(trained.encoding.clone(), graph, normal);
        Self { prediction: Prediction::new(trained), encoder, lift, tensions, is_open, asked: 0 }
    }
}

impl InitialGuess for GnStepGuess {
    fn helps_steps(&self) -> bool {
        true
    }

    fn start_step(
        &mut self,
        component: &Component<f64>,
        poses: &mut [BodyPose<f64>],
        lambda: &mut [Spatial<f64>],
    ) -> bool {
        self.asked += 1;
        if self.asked > 1 || !self.is_open {
            return false;
        }
        let [nodes, _] = self.prediction.run(&mut self.encoder, component);
        self.encoder.turn(nodes, poses);
        self.lift.fill(&self.encoder.graph, component, poses, lambda);
        self.tensions.choose(component, poses, lambda);
        true
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        if !self.is_open {
            return;
        }
        let is_whole = std::mem::take(&mut self.asked) <= 1;
        self.encoder.observe(component, is_whole);
        self.tensions.observe(component, is_whole);
    }

    fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.encoder.turns.visit_state(visitor);
        self.tensions.visit_state(visitor);
    }
}
