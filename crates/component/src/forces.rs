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
    /// A joint's rest: its place, and its index in the model.
    Rest(usize, usize),
}

impl Varying {
    /// The place of the joint whose rest it changes, and its index in the model.
    pub(super) fn rest(&self) -> Option<(usize, usize)> {
        if let Target::Rest(joint, index) = self.of { Some((joint, index)) } else { None }
    }

    /// The same of a component of its own, in which a load of this one has another `place`.
    pub(super) fn alone(&self, place: impl Fn(usize) -> usize) -> Self {
        let of = match self.of {
            Target::Load(load) => Target::Load(place(load)),
            Target::Torque(load) => Target::Torque(place(load)),
            of @ (Target::Gravity | Target::Rest(..)) => of,
        };
        Self { lane: 0, of, track: self.track.clone() }
    }
}
