//! Arithmetic that runs on one rod or on several at once.

pub(crate) mod block;
pub mod dispatch;
pub mod dual;
pub(crate) mod flat;
pub mod lane;
pub mod math;
mod spatial;
pub(crate) mod transfer;

pub use spatial::Spatial;
