//! COPINGNet: the graph network in burn, its checkpoints, its fast inference and its guesses (paper, section 3.2).

mod config;
pub mod inference;
mod weights;

pub use config::{NetworkConfig, Output, TensorSpec};
pub use weights::Weights;
