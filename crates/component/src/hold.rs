//! Bodies that are held or let go between two steps: segments that become fixed or free, grips that open or close.

mod step;

use rod::Driven;

/// What becomes of a body between two steps.
#[derive(Clone, Copy, Debug)]
pub enum Change<'a> {
    /// It is held where it is.
    Hold,
    /// It is let go: a segment goes on with the velocity that it has, an anchor is open.
    LetGo,
    /// It is in a store: held in line with the next segment of its rod that is outside, and touched by nothing.
    Store,
    /// It is held and driven from the next step on.
    Drive(&'a Driven),
}

/// The inertia of a fixed segment in a lane, which counts once it is free.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resting {
    pub(super) lane: usize,
    body: usize,
    inverse_mass: f64,
    transverse: f64,
    axial: f64,
}

impl Resting {
    /// The same of a component of its own.
    pub(super) fn alone(&self) -> Self {
        Self { lane: 0, ..*self }
    }
}
