//! Energy and length of a run's frames.

use cosserat::state::{Model, State, measure};

use crate::braking::Braking;
use crate::sharp::Sharpest;

/// Frames that are measured, at most: a long chain's energy costs as much as one of its steps.
const MEASURED_FRAMES: usize = 200;

/// Energies and lengths of the first frame, of up to [`MEASURED_FRAMES`] evenly spaced ones, and of the last.
pub(crate) struct Measured {
    every: usize,
    first_lengths: Vec<f64>,
    /// Number of frames that were measured, the first included.
    pub(crate) frames: usize,
    /// Total energy of the first frame [J].
    pub(crate) energy_start: f64,
    /// Total energy of the last frame measured [J].
    pub(crate) energy_end: f64,
    /// Highest total energy of all frames measured [J].
    pub(crate) energy_highest: f64,
    /// Largest relative change of any rod's length, as a magnitude.
    pub(crate) length_drift: f64,
    /// How much the integrator brakes what goes round.
    pub(crate) braking: Braking,
    /// The joint that turned furthest.
    pub(crate) sharpest: Sharpest,
}

impl Measured {
    /// From the first state of a run of `steps` steps.
    pub(crate) fn new(model: &Model, state: &State, steps: usize) -> Self {
        let energy = measure::energy(model, state).total();
        let mut sharpest = Sharpest::default();
        sharpest.observe(model, state);
        Self {
            every: steps.div_ceil(MEASURED_FRAMES).max(1),
            first_lengths: measure::rod_lengths(model, state),
            frames: 1,
            energy_start: energy,
            energy_end: energy,
            energy_highest: energy,
            length_drift: 0.0,
            braking: Braking::default(),
            sharpest,
        }
    }

    /// Whether the frame after `step` steps is one to measure.
    pub(crate) fn wants(&self, step: usize) -> bool {
        step.is_multiple_of(self.every)
    }

    /// Whether the frame after `step` steps is a step before one to measure.
    pub(crate) fn wants_before(&self, step: usize) -> bool {
        self.wants(step + 1)
    }

    /// Measures a frame. Returns whether it is finite; where it is not, it is left out.
    pub(crate) fn observe(&mut self, model: &Model, state: &State) -> bool {
        let energy = measure::energy(model, state).total();
        let drift = measure::length_drift(model, state, &self.first_lengths);
        if !(energy.is_finite() && drift.is_finite()) {
            return false;
        }
        self.braking.observe(model, state);
        self.sharpest.observe(model, state);
        self.frames += 1;
        self.energy_end = energy;
        self.energy_highest = self.energy_highest.max(energy);
        self.length_drift = self.length_drift.max(drift);
        true
    }
}
