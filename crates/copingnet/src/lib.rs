//! COPINGNet: the graph network in burn, its checkpoints, its fast inference and its guesses (paper, section 3.2).

mod backend;
mod cg_loss;
mod checkpoint;
mod config;
mod encoding;
mod guess;
pub mod inference;
mod network;
mod parameters;
mod tensors;
mod weights;

pub use backend::Backend;
pub use cg_loss::CgLoss;
pub use checkpoint::{Card, Checkpoint, CheckpointError, Measured, Training, TrainingState};
pub use config::{NetworkConfig, Output, TensorSpec};
pub use encoding::{Encoder, Encoding, Features, Head, Inputs};
pub use guess::{GnGuess, Trained};
pub use network::{GnBlock, Mlp, Network, Scan};
pub use tensors::GraphTensors;
pub use weights::Weights;
