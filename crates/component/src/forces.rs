//! Loads and gravity: what they are in the step under way.

mod step;

use std::sync::Arc;

use rod::Track;

/// A load or gravity that changes over time, in one lane.
#[derive(Clone, Debug)]
pub(super) struct ChangingForce {
    pub(super) lane: usize,
    of: Force,
    track: Arc<Track>,
}

/// What changes: loads by their places in the component.
#[derive(Clone, Copy, Debug)]
enum Force {
    Gravity,
    Load(usize),
    Torque(usize),
}

impl ChangingForce {
    /// The same of a component of its own.
    pub(super) fn alone(&self) -> Self {
        Self { lane: 0, ..self.clone() }
    }
}
