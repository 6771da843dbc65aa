//! The seam for initial guesses, and the guesses without learning.
//!
//! A guess can help in two places. The start of a *linear solve* is the paper's correctionGuess (its first equation):
//! the solvers here work on the multipliers, so that dlambda0 is all there is to guess; dp0 = M^-1 J^T dlambda0 follows
//! from it. The start of a *whole step* is where the outer iteration begins (p0, lambda0); only a formulation with a
//! momentum residual corrects it, so it is not offered elsewhere.

mod adaptive;
mod extrapolate;
mod fischer;
mod frozen;
mod history;
mod kind;
mod step;

use component::snapshot::StateVisitor;
use component::{BodyPose, Component};
use jointed::system::System;
use kernels::Spatial;

pub use adaptive::StepAdaptive;
pub use extrapolate::Extrapolation;
pub use fischer::Fischer;
pub use frozen::FrozenGuess;
pub use kind::GuessKind;
pub use step::StepExtrapolation;

/// Proposes where to start. One guess serves one connected set of segments; all its times are counted.
pub trait InitialGuess: Send + Sync {
    /// Whether the guess proposes starts of linear solves.
    fn helps_solves(&self) -> bool {
        false
    }

    /// Whether the guess proposes starts of whole steps.
    fn helps_steps(&self) -> bool {
        false
    }

    /// Whether starts of whole steps need the system evaluated at the prediction; where they do not, its evaluation is left out.
    fn reads_prediction(&self) -> bool {
        true
    }

    /// Proposes dlambda0 for outer iteration `iteration` (from 0) into `dlambda`, one entry a joint, which comes zeroed.
    /// Returns whether it did.
    fn start_solve(&mut self, component: &Component<f64>, iteration: usize, dlambda: &mut [Spatial<f64>]) -> bool {
        let _ = (component, iteration, dlambda);
        false
    }

    /// Learns the solution of outer iteration `iteration`.
    fn observe_solve(&mut self, component: &Component<f64>, iteration: usize) {
        let _ = (component, iteration);
    }

    /// Proposes p0 and lambda0 for a whole step, which come as p* and 0. Returns whether it did. The component's poses
    /// are p*, and its system is evaluated there where the guess [reads](Self::reads_prediction) it; its own predicted poses are lent to `poses` meanwhile. What it says of
    /// fixed bodies is not used.
    fn start_step(
        &mut self,
        component: &Component<f64>,
        poses: &mut [BodyPose<f64>],
        lambda: &mut [Spatial<f64>],
    ) -> bool {
        let _ = (component, poses, lambda);
        false
    }

    /// Learns the end of an accepted step.
    fn observe_step(&mut self, component: &Component<f64>) {
        let _ = component;
    }

    /// Shows a visitor all that it has learned, so that snapshots of the simulation keep it. The default is for a guess that
    /// remembers nothing. Where one that does leaves this out, a simulation goes on from a snapshot as exactly as before,
    /// but not with the same bits.
    fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        let _ = visitor;
    }
}

/// The stretch-shear multipliers in the frame of each joint's body a, where a rod that turns leaves them as they are.
#[inline(always)]
pub(crate) fn to_body_frame(system: &System<f64>, joint: usize, x: Spatial<f64>) -> Spatial<f64> {
    let q_a = system.bodies[system.topology.joints[joint][0] as usize].orientation;
    Spatial { linear: q_a.rotate_back(x.linear), angular: x.angular }
}

/// The inverse of [`to_body_frame`].
#[inline(always)]
pub(crate) fn from_body_frame(system: &System<f64>, joint: usize, x: Spatial<f64>) -> Spatial<f64> {
    let q_a = system.bodies[system.topology.joints[joint][0] as usize].orientation;
    Spatial { linear: q_a.rotate(x.linear), angular: x.angular }
}
