//! What can go wrong.

use std::io;

use dynamics::simulation::SimulationError;
use thiserror::Error;

/// Why a live view cannot start or go on, or why an input is refused.
#[derive(Debug, Error)]
pub enum LiveError {
    /// The port cannot be had.
    #[error("port {port} of this machine cannot be listened to: {source}")]
    Port {
        /// The port asked for; 0 for any.
        port: u16,
        /// What the system says.
        source: io::Error,
    },
    /// No random numbers for the address.
    #[error("the system gives no random numbers for the address: {0}")]
    Random(getrandom::Error),
    /// The page cannot be made.
    #[error("the page cannot be made: {0}")]
    Page(io::Error),
    /// The simulation cannot go on.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// An input that does not fit the model or the moment.
    #[error("{0}")]
    Refused(String),
    /// A recording that does not fit.
    #[error("the recording is of another {0}")]
    Recording(&'static str),
}

impl LiveError {
    /// An input that is refused, and why.
    pub(crate) fn refused(why: impl Into<String>) -> Self {
        Self::Refused(why.into())
    }
}
