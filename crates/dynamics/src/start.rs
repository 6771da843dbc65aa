//! Where a step and its linear solves begin: how an attempt asks a guess, and what it takes of the answer.

use component::Component;
use kernels::Spatial;
use kernels::lane::Real;

use crate::counters::Counters;
use crate::guess::InitialGuess;

/// Where a step began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// At the prediction.
    Prediction,
    /// At a guess.
    Guess,
    /// At the prediction, with multipliers of a guess whose poses were dropped.
    Multipliers,
}

/// A guess as the step sees it: one rod may have one, rods side by side have none.
pub trait StepGuess<T: Real> {
    /// Whether there is a guess at all: what does not exist takes no time.
    fn exists(&self) -> bool {
        true
    }
    /// Whether it reads the system at the prediction for that.
    fn reads_prediction(&self) -> bool {
        false
    }
    /// Lets the guess replace p* and lambda = 0. Returns whether it did.
    fn start_step(&mut self, component: &mut Component<T>, counters: &mut Counters) -> bool;
    /// Lets the guess fill the start of a linear solve. Returns whether it did.
    fn start_solve(&mut self, component: &mut Component<T>, iteration: usize, counters: &mut Counters) -> bool;
    /// Shows the guess a solution.
    fn observe_solve(&mut self, component: &Component<T>, iteration: usize);
}

/// No guess: every start is zero.
#[derive(Clone, Copy, Debug)]
pub struct NoGuess;

impl<T: Real> StepGuess<T> for NoGuess {
    fn exists(&self) -> bool {
        false
    }
    fn start_step(&mut self, _: &mut Component<T>, _: &mut Counters) -> bool {
        false
    }
    fn start_solve(&mut self, _: &mut Component<T>, _: usize, _: &mut Counters) -> bool {
        false
    }
    fn observe_solve(&mut self, _: &Component<T>, _: usize) {}
}

impl StepGuess<f64> for Box<dyn InitialGuess> {
    fn reads_prediction(&self) -> bool {
        self.helps_steps() && self.as_ref().reads_prediction()
    }

    fn start_step(&mut self, component: &mut Component<f64>, counters: &mut Counters) -> bool {
        if !self.helps_steps() {
            return false;
        }
        // The prediction stands twice in the component: one of the two becomes the start.
        let mut poses = std::mem::take(&mut component.predicted);
        let mut lambda = std::mem::take(&mut component.lambda);
        let given = self.as_mut().start_step(component, &mut poses, &mut lambda);
        for (body, (pose, predicted)) in poses.iter_mut().zip(&component.poses).enumerate() {
            if component.is_fixed(body, 0) {
                *pose = *predicted;
            }
        }
        let finite = lambda.iter().all(is_finite)
            && poses.iter().all(|p| p.x.dot(p.x).is_finite() && (p.q.v.dot(p.q.v) + p.q.w * p.q.w).is_finite());
        component.predicted = std::mem::replace(&mut component.poses, poses);
        component.lambda = lambda;
        if given && !finite {
            component.poses.copy_from_slice(&component.predicted);
            component.lambda.fill(Spatial::zero());
        }
        keep(given, finite, counters)
    }

    fn start_solve(&mut self, component: &mut Component<f64>, iteration: usize, counters: &mut Counters) -> bool {
        if !self.helps_solves() {
            return false;
        }
        let mut dlambda = std::mem::take(&mut component.dlambda);
        dlambda.fill(Spatial::zero());
        let given = self.as_mut().start_solve(component, iteration, &mut dlambda);
        let finite = dlambda.iter().all(is_finite);
        component.dlambda = dlambda;
        keep(given, finite, counters)
    }

    fn observe_solve(&mut self, component: &Component<f64>, iteration: usize) {
        if self.helps_solves() {
            self.as_mut().observe_solve(component, iteration);
        }
    }
}

pub(crate) fn is_finite(x: &Spatial<f64>) -> bool {
    x.dot(*x).is_finite()
}

/// Whether to begin at what a guess has `given`; what is not finite is dropped.
fn keep(given: bool, finite: bool, counters: &mut Counters) -> bool {
    counters.guesses_dropped += u64::from(given && !finite);
    given && finite
}
