//! COPINGNet: the graph network in burn, its checkpoints, its fast inference and its guesses (paper, section 3.2).
//!
//! It is for learning: programs that only use what was learned have it from `cosserat`.

#[cfg(feature = "training")]
mod adam;
#[cfg(feature = "training")]
mod backend;
mod cg_loss;
mod checkpoint;
mod config;
mod encoding;
mod guess;
pub mod inference;
#[cfg(feature = "training")]
mod network;
#[cfg(feature = "training")]
pub mod parameters;
mod step_guess;
#[cfg(feature = "training")]
mod tensors;
mod weights;

#[cfg(feature = "training")]
pub use adam::{Adam, AdamParams};
#[cfg(feature = "training")]
pub use backend::Backend;
pub use cg_loss::CgLoss;
pub use checkpoint::{Card, Checkpoint, CheckpointError, Leg, Measured, Simulated, Training, TrainingState};
pub use config::{NetworkConfig, Output, TensorSpec};
pub use encoding::{Encoder, Encoding, Features, Head, Inputs};
pub use guess::{GnGuess, Trained};
#[cfg(feature = "training")]
pub use network::{GnBlock, Mlp, Network, Scan};
pub use step_guess::{GnStepGuess, StepEncoder};
#[cfg(feature = "training")]
pub use tensors::GraphTensors;
pub use weights::Weights;
