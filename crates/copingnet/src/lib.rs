//! COPINGNet: the graph network in burn, its checkpoints, its fast inference and its guesses (paper, section 3.2).

mod cg_loss;
mod config;
mod weights;

pub use cg_loss::CgLoss;
pub use config::{NetworkConfig, Output, TensorSpec};
pub use weights::Weights;
