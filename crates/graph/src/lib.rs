//! The solver's state as a graph: what a learned guess reads, and the numbers it predicts (paper, section 3.1).
//!
//! A [`Graph`] is what stays the same of one connected set of segments: bodies are nodes, joints are edges from their
//! body a (the sender) to their body b (the receiver). Two kinds of features are made of it and of the solver's state:
//!
//! - [`paper`]: the paper's 14 inputs a node and 5 an edge, in world axes and SI units, with its norms;
//! - [`body_frame`]: inputs that neither a shift nor a rotation of the scene changes, with the right-hand side on the
//!   edges and outputs in a scale of their own.
//!
//! [`semi`] makes multipliers of fewer outputs, and takes gradients back through that. For guesses of whole steps,
//! [`turns`] remembers what the last steps came to, and [`Lift`] makes a whole state of orientations.
//!
//! Arrays are `f32`, row by row (`[nodes, k]` is `nodes` rows of `k` numbers), and lie in buffers of the caller's, so
//! that no call allocates. What stays the same over a scene is filled apart from what changes with every solve. Ragged
//! graphs are joined by [`Batch`].
//!
//! This crate knows the solver. It knows no network and no file format. It is for learning: programs that only use what was
//! learned have it from `cosserat`.

mod batch;
pub mod body_frame;
mod channel;
mod graph;
mod lift;
pub mod paper;
mod particular;
mod planar;
pub mod semi;
pub mod turns;
mod whitening;

pub use batch::Batch;
pub use channel::{Channel, mask};
pub use graph::{Edge, Graph, Node, Visit};
pub use lift::Lift;
pub use paper::Norms;
pub use planar::{Normal, planar_normal, project_to_plane};
pub use whitening::Whitening;

use component::Component;
use kernels::Spatial;

/// `dp = M^-1 J^T dlambda`: the corrections (dx [m], dphi [rad], world axes) that multipliers bring about, one entry a
/// node, zero where it is fixed. The system in `component` must be the one that `dlambda` solves.
pub fn corrections(component: &Component<f64>, dlambda: &[Spatial<f64>], dp: &mut [Spatial<f64>]) {
    let system = &component.system;
    dp.fill(Spatial::zero());
    for (j, (&dlambda, &[a, _])) in dlambda.iter().zip(&system.topology.joints).enumerate() {
        let q_a = system.bodies[a as usize].orientation;
        system.add_impulse(j, system.joints[j].multipliers_to_world(dlambda, q_a), dp);
    }
    for (body, dp) in dp.iter_mut().enumerate() {
        *dp = system.correction(body, *dp);
    }
}

/// Writes numbers to the start of `out`, in single precision.
#[inline(always)]
fn put<const N: usize>(out: &mut [f32], values: [f64; N]) {
    for (out, value) in out.iter_mut().zip(values) {
        *out = value as f32;
    }
}
