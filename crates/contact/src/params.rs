//! How contacts are found, in numbers.

/// The parameters of the search for contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NarrowPhaseParams {
    /// Room around a segment's way through the step in the search for pairs \[radii\]. Larger: more pairs are looked at.
    /// Smaller: pairs are searched again more often within a step, as segments leave their room.
    pub search_room: f64,
    /// Squared sine of the angle below which two axes count as parallel, so that they touch along a line: its two ends are
    /// held apart. Larger: more contacts for the same pair. Smaller: rods that lie along each other rock.
    pub parallel: f64,
}

impl NarrowPhaseParams {
    /// Those that a simulation has unless told otherwise.
    pub const DEFAULT: Self = Self { search_room: 0.5, parallel: 0.03 };
}

impl Default for NarrowPhaseParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}
