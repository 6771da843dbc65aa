//! Why there is no derivative.

use dynamics::simulation::SimulationError;
use dynamics::step::Status;
use thiserror::Error;

/// Why there is no derivative.
#[derive(Debug, Error)]
pub enum DerivativeError {
    /// The simulation cannot start, or go on.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// There is no static analysis.
    #[error(transparent)]
    Static(#[from] statics::StaticError),
    /// Something that is not differentiated.
    #[error("derivatives know no {0}")]
    Unknown(&'static str),
    /// A formulation whose steps are not solved to the end.
    #[error("derivatives need formulation newton, whose steps are solved to the end")]
    Formulation,
    /// Checkpoints that are no step apart.
    #[error("checkpoints must be a step apart at least")]
    Stretch,
    /// A step that is not solved.
    #[error("step {step} has no derivative: {}", .status.name())]
    Step {
        /// The step, from 1.
        step: usize,
        /// How it ended.
        status: Status,
    },
    /// A step whose equations are singular where it ends, as at a fold.
    #[error("step {step} has no derivative: its equations are singular")]
    Singular {
        /// The step, from 1.
        step: usize,
    },
    /// An equilibrium that was not found.
    #[error("the equilibrium has no derivative: the search for it has not come to rest")]
    NotAtRest,
    /// An equilibrium that is not the only one nearby: at a fold, or where a motion meets no resistance.
    #[error(
        "the equilibrium has no derivative: its equations are singular, as at a fold or where a motion meets no resistance"
    )]
    Neutral,
    /// A list of a variation that does not fit the model.
    #[error("a variation with {found} {what}, but there are {expected}")]
    Size {
        /// What the list holds.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there must be.
        expected: usize,
    },
}

/// Refuses what is not differentiated, where it is there.
pub(super) fn refuse(is_there: bool, what: &'static str) -> Result<(), DerivativeError> {
    if is_there { Err(DerivativeError::Unknown(what)) } else { Ok(()) }
}
