//! What the analysis came to.

use rod::ContactForce;
use rod::JointForce;

/// What the analysis came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StaticReport {
    /// Whether nothing moves any more.
    pub converged: bool,
    /// Steps (linear solves) taken, over all connected sets.
    pub steps: usize,
    /// Loops of Newton's method in wind, over all connected sets: in each the drag stays as it was at its beginning. Without air
    /// one a set.
    pub loops: usize,
    /// Most linear solves of any of these loops.
    pub most_in_loop: usize,
    /// Largest movement in the last step of any connected set.
    pub movement: f64,
    /// Whether the energy is at a minimum, by the signs of the tangent's eigenvalues; in wind, that in the drag as it is there.
    /// What nothing resists counts as stable. `None` where there is no equilibrium, and where the flow found it.
    pub stable: Option<bool>,
    /// What presses on segments of sets that are at rest, in the order of the connected sets.
    pub contacts: Vec<ContactForce>,
    /// What each joint transmits, one entry a joint of the model.
    pub forces: Vec<JointForce>,
}
