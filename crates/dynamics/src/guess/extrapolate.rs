//! The solutions of the same outer iteration of the last steps, continued as a constant, a line or a parabola.

use component::Component;
use component::snapshot::StateVisitor;
use kernels::Spatial;

use super::history::SolveHistory;
use super::{InitialGuess, from_body_frame};

/// Starts linear solves from an extrapolation in body frames.
#[derive(Clone, Debug)]
pub struct Extrapolation {
    order: usize,
    history: SolveHistory,
}

impl Extrapolation {
    /// An extrapolation of `order` 0 (the previous solution), 1 or 2, for a set of segments with this many joints.
    pub(crate) fn new(order: usize, joints: usize) -> Self {
        let order = order.min(2);
        Self { order, history: SolveHistory::new(joints, order + 1) }
    }
}

impl InitialGuess for Extrapolation {
    fn helps_solves(&self) -> bool {
        true
    }

    fn start_solve(&mut self, component: &Component<f64>, iteration: usize, dlambda: &mut [Spatial<f64>]) -> bool {
        self.history.begin(component.effective_dt(), iteration);
        let Some(ring) = self.history.ring(iteration) else { return false };
        let (weights, count) = ring.extrapolation(self.history.attempt(), component.effective_dt(), self.order);
        for (weight, entry) in weights.iter().zip((0..count).filter_map(|age| ring.get(age))) {
            for (x, value) in dlambda.iter_mut().zip(&entry.values) {
                *x = x.plus(*value, *weight);
            }
        }
        for (joint, x) in dlambda.iter_mut().enumerate() {
            *x = from_body_frame(&component.system, joint, *x);
        }
        count > 0
    }

    fn observe_solve(&mut self, component: &Component<f64>, iteration: usize) {
        self.history.observe(component, iteration);
    }

    fn observe_step(&mut self, _: &Component<f64>) {
        self.history.accept();
    }

    fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.history.visit_state(visitor);
    }
}
