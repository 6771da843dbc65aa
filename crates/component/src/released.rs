//! Joints that leave something free: ball joints, hinges, open grips, joints that have broken.
//!
//! Where a joint is free its multiplier is zero and it has no constraint. The rows of the linear system stay: their residual
//! is zero, their compliance so large that they hardly answer, and what they answer all the same is dropped after the solve.
//! So the iteration's matrix is a little off, and the solution that it converges to is exact. An open grip goes with the
//! face that it may hold, so that there is nothing to close when it does; the bodies of a joint that has broken go on by themselves.

mod step;

use rod::{Body, Freedom, Model};

/// A joint of a lane that leaves something free: a few joints, which grips on the way join and leave, where the lists of
/// [`super::joint_extras::JointExtras`] have an entry for every joint of every lane and stay as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Released {
    pub(super) lane: usize,
    joint: usize,
    turns: Turns,
    /// Whether it transmits nothing because it holds on to an anchor that is open, or to a segment that is stored.
    open: bool,
    /// Whether it transmits nothing because it has broken.
    broken: bool,
}

/// Turns that are free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turns {
    None,
    All,
    /// About d3 of body a.
    One,
}

impl Released {
    /// The same of a component of its own.
    pub(super) fn alone(&self) -> Self {
        Self { lane: 0, ..*self }
    }

    /// Whether it transmits nothing.
    fn is_apart(&self) -> bool {
        self.open || self.broken
    }

    /// Whether it is this joint, and transmits nothing.
    pub(super) fn opens(&self, joint: usize) -> bool {
        self.is_apart() && self.joint == joint
    }
}

/// Whether a model has joints that leave something free, at the start or later.
pub fn has_loose(model: &Model) -> bool {
    let lets_go = |driven: &rod::Driven| driven.is_timed() && matches!(driven.body, Body::Anchor(_));
    !model.open.is_empty()
        || !model.breakable.is_empty()
        || model.joints.iter().any(|joint| joint.freedom != Freedom::None)
        || model.motions.iter().any(lets_go)
}
