//! What the stages of steps take.

use std::time::Duration;

use cosserat::simulation::{Counters, StageTimes};
use serde::{Deserialize, Serialize};

use crate::guesses::Spread;

/// Wall time of each stage of a step [us], summed over threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stages {
    /// Wind and drag.
    pub drag: f64,
    /// Prediction and velocities.
    pub predict: f64,
    /// Starts, what they learn included.
    pub guess: f64,
    /// Constraints, residuals, Jacobians, mass matrices.
    pub assemble: f64,
    /// Linear solves.
    pub solve: f64,
    /// Update of multipliers and poses.
    pub update: f64,
    /// Contacts.
    pub contact: f64,
    /// All of them; its median is not the sum of theirs.
    pub total: f64,
}

impl Stages {
    /// Each stage by name in the order of a step, the total last.
    pub fn by_name(&self) -> [(&'static str, f64); 8] {
        let Self { drag, predict, guess, assemble, solve, update, contact, total } = *self;
        let names = ["drag", "predict", "guess", "assemble", "solve", "update", "contact", "total"];
        let times = [drag, predict, guess, assemble, solve, update, contact, total];
        std::array::from_fn(|k| (names[k], times[k]))
    }

    /// Of what was done between two readings.
    pub(crate) fn between(before: &Counters, after: &Counters) -> Self {
        let us = |stage: fn(&StageTimes) -> Duration| 1e6 * (stage(&after.times) - stage(&before.times)).as_secs_f64();
        Self {
            drag: us(|times| times.drag),
            predict: us(|times| times.predict),
            guess: us(|times| times.guess),
            assemble: us(|times| times.assemble),
            solve: us(|times| times.solve),
            update: us(|times| times.update),
            contact: us(|times| times.contact),
            total: us(StageTimes::total),
        }
    }

    /// The median of each stage by itself; zero without steps.
    pub(crate) fn medians(steps: &[Self]) -> Self {
        let of = |stage: usize| Spread::of(steps.iter().map(|step| step.by_name()[stage].1));
        let median = |stage| of(stage).map_or(0.0, |spread| spread.median);
        let [drag, predict, guess, assemble, solve, update, contact, total] = std::array::from_fn(median);
        Self { drag, predict, guess, assemble, solve, update, contact, total }
    }
}
