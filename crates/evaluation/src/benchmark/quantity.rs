//! What an experiment measures, and whether it is right.

use cosserat::scene::SceneError;
use cosserat::simulation::{SimulationError, Status};
use cosserat::statics::StaticError;
use thiserror::Error;

/// Why an experiment gives no result.
#[derive(Debug, Error)]
pub enum BenchmarkError {
    /// A scene cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A scene cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A scene has no static analysis.
    #[error(transparent)]
    Static(#[from] StaticError),
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
}

/// What an experiment's functions give.
pub(super) type Measured = Result<Vec<Quantity>, BenchmarkError>;

/// A number that an experiment measures.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// What it is, with its unit.
    pub name: &'static str,
    /// Its right value.
    pub right: f64,
    /// Where the right value comes from.
    pub source: &'static str,
    /// What the simulation gives.
    pub measured: f64,
    /// Distance between the two: over the right value where that is not zero, else as it is.
    pub error: f64,
    /// Largest error that counts as right.
    pub allowed: f64,
    /// Errors that others have published of the same experiment.
    pub published: &'static str,
}

impl Quantity {
    /// Measured against its right value; the error is relative where that is not zero.
    pub(super) fn new(name: &'static str, [measured, right]: [f64; 2], allowed: f64, source: &'static str) -> Self {
        let error = (measured - right).abs() / if right == 0.0 { 1.0 } else { right.abs() };
        Self { name, right, source, measured, error, allowed, published: "" }
    }

    /// The same with what others have published.
    pub(super) fn beside(self, published: &'static str) -> Self {
        Self { published, ..self }
    }

    /// Whether the error is within what is allowed; one that is not a number is not.
    pub fn is_right(&self) -> bool {
        self.error <= self.allowed
    }
}

/// What an experiment has given.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// What was measured.
    pub quantities: Vec<Quantity>,
    /// Worst status of any step.
    pub status: Status,
    /// Outer iterations a step of all connected sets, taken-back steps included.
    pub iterations_per_step: f64,
    /// Wall time of all steps [s].
    pub seconds: f64,
}

impl Outcome {
    /// Whether all quantities are right and all steps were solved.
    pub fn is_right(&self) -> bool {
        self.status.is_converged() && self.quantities.iter().all(Quantity::is_right)
    }
}

/// The middle one of some numbers. Forces over time are read so: a step in which contacts are new is one of Euler's rule from
/// velocities that loads alone have changed since the middle of the last step; what joints and contacts give in it makes up for that,
/// and is larger by up to half.
pub(super) fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}
