//! What a step depends on of those before it.

/// Numbers of which the state of a free body consists, six at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// The pose: shift and turn.
    Pose,
    /// Velocities over the last step.
    Velocity,
    /// Velocity and angular momentum at the end of the last step.
    Now,
    /// The same one step earlier.
    Earlier,
    /// The discrete momentum over the last step.
    Over,
}

impl Group {
    /// All; only the first two without a memory of several steps.
    pub const ALL: [Self; 5] = [Self::Pose, Self::Velocity, Self::Now, Self::Earlier, Self::Over];
}

/// Puts entries in their places.
pub fn scatter<T: Copy>(all: &mut [T], part: &[T], places: &[usize]) {
    for (own, &place) in part.iter().zip(places) {
        all[place] = *own;
    }
}
