//! Starts of whole steps: what the last steps added to the prediction, continued.
//!
//! Kept are each body's correction p' - p*, as a shift and a rotation vector in the body's predicted frame, and the
//! multipliers in the frame of each joint's body a. Both scale with dt^2. Only the formulation with a momentum residual
//! corrects such a start; elsewhere its error would stay in the motion.
//!
//! A step that did not converge is done again from the prediction, in substeps, and leaves no history: where the last
//! steps say little about the next, a whole-step guess does harm.

use component::snapshot::StateVisitor;
use component::{BodyPose, Component};
use kernels::Spatial;

use super::InitialGuess;
use super::history::Ring;

/// Starts whole steps from an extrapolation in body frames.
#[derive(Clone, Debug)]
pub struct StepExtrapolation {
    order: usize,
    /// Corrections of all bodies, then the multipliers of all joints.
    ring: Ring,
    /// The extrapolation.
    values: Vec<Spatial<f64>>,
    steps: u64,
    /// Attempts at the step under way.
    attempts: u32,
}

impl StepExtrapolation {
    /// An extrapolation of `order` 0 (what the previous step added), 1 or 2.
    pub fn new(order: usize, bodies: usize, joints: usize) -> Self {
        let (order, size) = (order.min(2), bodies + joints);
        let values = vec![Spatial::zero(); size];
        Self { order, ring: Ring::new(size, order + 1), values, steps: 0, attempts: 0 }
    }

    /// Lets a step pass that no start will follow soon enough to need it.
    pub(crate) fn pass_step(&mut self) {
        self.steps += 1;
        self.attempts = 0;
    }

    /// Counts an attempt at a step that begins elsewhere.
    pub(crate) fn stand_back(&mut self) {
        self.attempts += 1;
    }
}

impl InitialGuess for StepExtrapolation {
    fn helps_steps(&self) -> bool {
        true
    }

    fn reads_prediction(&self) -> bool {
        false
    }

    fn start_step(
        &mut self,
        component: &Component<f64>,
        poses: &mut [BodyPose<f64>],
        lambda: &mut [Spatial<f64>],
    ) -> bool {
        let Self { order, ring, values, steps, attempts } = self;
        *attempts += 1;
        if *attempts > 1 {
            return false;
        }
        let (weights, count) = ring.extrapolation(*steps + 1, component.effective_dt(), *order);
        if count == 0 {
            return false;
        }
        values.fill(Spatial::zero());
        for (weight, entry) in weights.iter().zip((0..count).filter_map(|age| ring.get(age))) {
            for (x, value) in values.iter_mut().zip(&entry.values) {
                *x = x.plus(*value, *weight);
            }
        }
        let (corrections, multipliers) = values.split_at(poses.len());
        for (pose, correction) in poses.iter_mut().zip(corrections) {
            let x = pose.x + pose.q.rotate(correction.linear);
            *pose = BodyPose { x, q: pose.q.turned(pose.q.rotate(correction.angular)) };
        }
        for ((own, x), ends) in lambda.iter_mut().zip(multipliers).zip(&component.system.topology.joints) {
            *own = Spatial { linear: poses[ends[0] as usize].q.rotate(x.linear), angular: x.angular };
        }
        true
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        self.steps += 1;
        if std::mem::take(&mut self.attempts) > 1 {
            self.ring.clear();
            return;
        }
        self.ring.push(self.steps, component.effective_dt(), |values| {
            let (corrections, multipliers) = values.split_at_mut(component.poses.len());
            for ((out, pose), predicted) in corrections.iter_mut().zip(&component.poses).zip(&component.predicted) {
                let (q, phi) = (predicted.q, pose.q.turn_since(predicted.q));
                *out = Spatial { linear: q.rotate_back(pose.x - predicted.x), angular: q.rotate_back(phi) };
            }
            let joints = component.lambda.iter().zip(&component.system.topology.joints);
            for (out, (lambda, ends)) in multipliers.iter_mut().zip(joints) {
                let q_a = component.poses[ends[0] as usize].q;
                *out = Spatial { linear: q_a.rotate_back(lambda.linear), angular: lambda.angular };
            }
        });
    }

    fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.ring.visit_state(visitor);
        visitor.word(&mut self.steps);
    }
}
