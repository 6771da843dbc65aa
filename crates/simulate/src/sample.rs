//! Single frames of a run in numbers: energy, length, what their steps cost.

use cosserat::simulation::{Counters, Simulation, StageTimes};
use cosserat::state::measure::{self, Energy};
use cosserat::state::{Model, State};

/// Frames that are sampled, at most, beside the first.
const MOST: usize = 1000;

/// A frame in numbers. Of steps, the mean since the sample before.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    /// Time [s].
    pub(crate) time: f64,
    pub(crate) energy: Energy,
    /// Length of all rods together over that of the start.
    pub(crate) length_ratio: f64,
    /// Outer iterations a step and connected set.
    pub(crate) iterations: f64,
    /// Time of each stage a step [us], by name.
    pub(crate) stages_us: [(&'static str, f64); 7],
}

/// Takes samples of a run.
pub(crate) struct Sampler {
    every: usize,
    first_length: f64,
    step: usize,
    counters: Counters,
}

impl Sampler {
    /// For a run of so many `steps`, of which one in `kept` is kept, from `state` at `time` [s], with the sample of its
    /// start.
    pub(crate) fn new(model: &Model, state: &State, steps: usize, kept: usize, time: f64) -> (Self, Sample) {
        let first_length = length(model, state);
        let every = kept * (steps / kept).div_ceil(MOST).max(1);
        let sampler = Self { every, first_length, step: 0, counters: Counters::default() };
        let energy = measure::energy(model, state);
        let stages_us = StageTimes::default().by_name().map(|(name, _)| (name, 0.0));
        let start = Sample { time, energy, length_ratio: 1.0, iterations: 0.0, stages_us };
        (sampler, start)
    }

    /// Whether the frame after so many steps is one to sample.
    pub(crate) fn wants(&self, step: usize) -> bool {
        step.is_multiple_of(self.every)
    }

    /// The sample after so many steps, of which `state` is the end. A simulation that was built anew on the way counts from then on.
    pub(crate) fn sample(&mut self, model: &Model, state: &State, simulation: &Simulation, step: usize) -> Sample {
        let counters = simulation.counters();
        let steps = (step - std::mem::replace(&mut self.step, step)).max(1) as f64;
        let before = std::mem::replace(&mut self.counters, counters);
        let (now, then) = (counters.times.by_name(), before.times.by_name());
        Sample {
            time: simulation.time(),
            energy: measure::energy(model, state),
            length_ratio: length(model, state) / self.first_length,
            iterations: counters.iterations.saturating_sub(before.iterations) as f64
                / (steps * simulation.components() as f64),
            stages_us: std::array::from_fn(|k| {
                (now[k].0, 1e6 * now[k].1.saturating_sub(then[k].1).as_secs_f64() / steps)
            }),
        }
    }
}

/// Length of all rods together [m].
pub(crate) fn length(model: &Model, state: &State) -> f64 {
    measure::rod_lengths(model, state).iter().sum()
}
