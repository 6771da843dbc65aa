//! Predictions in the place of the constraint projection: the paper's "end-to-end" comparison (section 4, Long-term
//! Stability).
//!
//! Line 9 of Algorithm 1 solves nothing here. What a [`Projection`] says goes to poses and multipliers as it is, so that
//! its errors stay in the motion; residuals are evaluated all the same, and a step's status is as bad as they are. There
//! are no substeps: a shorter step would be another prediction, not a better one.
//!
//! Where segments can touch, contacts follow each prediction with the bodies' own masses (line 11 of Algorithm 1): how the
//! rods would answer them is what is predicted, and not known.

use component::{Component, Members};
use jointed::topology::Topology;
use kernels::Spatial;
use rod::Model;

use crate::attempt::{Attempt, begin, evaluate};
use crate::counters::{Counters, Stopwatch};
use crate::formulation::Formulation;
use crate::start::{NoGuess, is_finite};
use crate::step::{Interval, StepParams};

/// Predicts what a constraint projection would come to. One serves one connected set of segments.
pub trait Projection: Send + Sync {
    /// Predicts `dp = M^-1 J^T dlambda` (dx [m], dphi [rad] in world axes, one entry a body; those of fixed bodies are
    /// not used) and `dlambda` (one entry a joint, as [`Component::lambda`]) for outer iteration `iteration`, from 0.
    /// Both come zeroed. The component's system is the one that a solver would solve.
    fn project(
        &mut self,
        component: &Component<f64>,
        iteration: usize,
        dp: &mut [Spatial<f64>],
        dlambda: &mut [Spatial<f64>],
    );
}

/// Makes the projection of one connected set of segments.
pub type ProjectionFactory<'a> = &'a dyn Fn(&Model, &Members, &Topology) -> Box<dyn Projection>;

/// A projection with the memory for what it predicts.
pub(crate) struct Predictor {
    projection: Box<dyn Projection>,
    dp: Vec<Spatial<f64>>,
}

impl Predictor {
    /// A predictor for a set of so many bodies.
    pub(crate) fn new(projection: Box<dyn Projection>, bodies: usize) -> Self {
        Self { projection, dp: vec![Spatial::zero(); bodies] }
    }

    /// Attempts a step over `interval` with at most `params.max_iterations` predictions, fewer where the tolerance is met
    /// before.
    pub(crate) fn attempt(
        &mut self,
        component: &mut Component<f64>,
        interval: Interval,
        params: &StepParams,
        counters: &mut Counters,
    ) -> Attempt<f64> {
        let formulation = params.formulation;
        let mut result = begin(component, interval, params, &mut NoGuess, counters);
        for iteration in 0..params.max_iterations {
            if !result.residuals.check.is_finite() || result.error <= result.target {
                break;
            }
            self.project(component, iteration, formulation, counters);
            let mut watch = Stopwatch::start();
            let residuals = evaluate(component, formulation, counters);
            watch.mark(&mut counters.times.assemble);
            result.take(residuals, f64::INFINITY, 1.0);
        }
        result
    }

    /// Predicts outer iteration `iteration` and moves `component` by it. What is not finite is dropped.
    pub(crate) fn project(
        &mut self,
        component: &mut Component<f64>,
        iteration: usize,
        formulation: Formulation,
        counters: &mut Counters,
    ) {
        let Self { projection, dp } = self;
        let mut watch = Stopwatch::start();
        let mut dlambda = std::mem::take(&mut component.dlambda);
        dlambda.fill(Spatial::zero());
        dp.fill(Spatial::zero());
        projection.project(component, iteration, dp, &mut dlambda);
        let finite = dp[..component.segments()].iter().chain(&dlambda).all(is_finite);
        if !finite {
            dlambda.fill(Spatial::zero());
            dp.fill(Spatial::zero());
        }
        counters.guesses_used += u64::from(finite);
        counters.guesses_dropped += u64::from(!finite);
        component.dlambda = dlambda;
        watch.mark(&mut counters.times.guess);
        component.correct(formulation, dp);
        watch.mark(&mut counters.times.update);
        counters.iterations += 1;
        counters.segment_iterations += component.segments() as u64;
    }
}
