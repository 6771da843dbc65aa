//! The forward pass on the processor: f32, one core, widest vectors, no allocation.
//!
//! Every perceptron runs over a few rows at a time, all its layers in turn, so that what lies between them stays in the
//! first cache: the rows' inputs are gathered (a node's own row, those of an edge's ends, sums over a node's edges),
//! multiplied by weights in panels of vector registers, and what comes out is added or written where it belongs.
//! A row's numbers never depend on the rows beside it, so that a batch gives the same bits as its graphs alone.

mod connections;
mod forward;
mod layer;
mod memory;
mod packed;
mod scan;
mod sweep;

pub use forward::Forward;
pub use packed::Packed;
