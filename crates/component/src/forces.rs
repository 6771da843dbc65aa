//! Loads, gravity and rest shapes: what they are in the step under way.

mod step;

use std::sync::Arc;

use rod::Track;

/// A load, gravity or rest shape that changes over time, in one lane.
#[derive(Clone, Debug)]
pub(super) struct Varying {
    pub(super) lane: usize,
    of: Target,
    track: Arc<Track>,
}

/// What changes: loads and joints by their places in the component.
#[derive(Clone, Copy, Debug)]
enum Target {
    Gravity,
    Load(usize),
    Torque(usize),
    Rest(usize),
}

impl Varying {
    /// The same of a component of its own.
    pub(super) fn alone(&self) -> Self {
        Self { lane: 0, ..self.clone() }
    }
}
