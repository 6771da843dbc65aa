//! Predictions in the place of the constraint projection: the paper's "end-to-end" comparison (section 4, Long-term
//! Stability).
//!
//! Line 9 of Algorithm 1 solves nothing here. What a [`Projection`] says goes to poses and multipliers as it is, so that
//! its errors stay in the motion; residuals are evaluated all the same, and a step's status is as bad as they are. There
//! are no substeps: a shorter step would be another prediction, not a better one.

use rod::Model;

use crate::component::{Component, Members};
use crate::counters::{Counters, Stopwatch};
use crate::step::{Attempt, Interval, Start, Status, StepParams, evaluate, is_finite, predict, target};
use crate::system::Six;
use crate::topology::Topology;
use crate::unit::{accept, finish};

/// Predicts what a constraint projection would come to. One serves one connected set of segments.
pub trait Projection: Send {
    /// Predicts `dp = M^-1 J^T dlambda` (dx [m], dphi [rad] in world axes, one entry a body; those of fixed bodies are
    /// not used) and `dlambda` (one entry a joint, as [`Component::lambda`]) for outer iteration `iteration`, from 0.
    /// Both come zeroed. The component's system is the one that a solver would solve.
    fn project(&mut self, component: &Component<f64>, iteration: usize, dp: &mut [Six<f64>], dlambda: &mut [Six<f64>]);
}

/// Makes the projection of one connected set of segments.
pub type ProjectionFactory<'a> = &'a dyn Fn(&Model, &Members, &Topology) -> Box<dyn Projection>;

/// One connected set of segments that moves as predicted.
pub(crate) struct Projected {
    pub(crate) component: Component<f64>,
    pub(crate) members: Members,
    projection: Box<dyn Projection>,
    dp: Vec<Six<f64>>,
    pub(crate) counters: Counters,
    pub(crate) status: Status,
}

impl Projected {
    pub(crate) fn new(component: Component<f64>, members: Members, projection: Box<dyn Projection>) -> Self {
        let dp = vec![Six::zero(); component.poses.len()];
        Self { component, members, projection, dp, counters: Counters::default(), status: Status::Converged }
    }

    /// Steps over `interval` with at most `params.max_iterations` predictions, fewer where the tolerance is met before.
    pub(crate) fn advance(&mut self, interval: Interval, params: &StepParams) {
        let Self { component, projection, dp, counters, .. } = self;
        let formulation = params.formulation;
        let mut watch = Stopwatch::start();
        predict(component, interval, formulation, &mut watch, counters);
        let mut residuals = evaluate(component, formulation, counters);
        let target = target(&residuals, params);
        watch.mark(&mut counters.times.assemble);
        for iteration in 0..params.max_iterations {
            if !residuals.check.is_finite() || residuals.worst() <= target {
                break;
            }
            let mut dlambda = std::mem::take(&mut component.dlambda);
            dlambda.fill(Six::zero());
            dp.fill(Six::zero());
            projection.project(component, iteration, dp, &mut dlambda);
            let finite = dp[..component.segments()].iter().chain(&dlambda).all(is_finite);
            if !finite {
                dlambda.fill(Six::zero());
                dp.fill(Six::zero());
            }
            counters.guesses_used += u64::from(finite);
            counters.guesses_dropped += u64::from(!finite);
            component.dlambda = dlambda;
            watch.mark(&mut counters.times.guess);
            component.correct(formulation, dp);
            watch.mark(&mut counters.times.update);
            counters.iterations += 1;
            counters.segment_iterations += component.segments() as u64;
            residuals = evaluate(component, formulation, counters);
            watch.mark(&mut counters.times.assemble);
        }
        let result = Attempt { residuals, target, unsolved: component.unsolved, start: Start::Prediction };
        self.status = result.status(0);
        accept(&result, 0, counters);
        if self.status == Status::NonFinite {
            component.roll_back();
        } else {
            finish(component, formulation, 1.0, counters);
        }
    }
}
