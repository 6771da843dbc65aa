//! The laws, and how they are broken.

use std::fmt;

use names::names;

/// Rounding of sums of forces or of energies, relative.
pub(crate) const ROUNDING: f64 = 1e-9;
/// Rounding of positions, relative to their size, and of angles [rad].
pub(crate) const EPSILON: f64 = 4.0 * f64::EPSILON;

/// What must hold in every run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Law {
    /// Nothing panics.
    Panic,
    /// All numbers are finite.
    Finite,
    /// Linear momentum changes by the impulses of gravity, loads, grips and contacts.
    LinearMomentum,
    /// Angular momentum changes likewise.
    AngularMomentum,
    /// Energy grows by no more than the work that is done.
    Energy,
    /// Contacts push, and friction stays in its cone.
    Cone,
    /// Friction takes energy.
    Friction,
    /// No axis passes through another one, or into an obstacle.
    Passing,
    /// Where the status says that a step is solved, nothing is deeper in another than its tolerance.
    Depth,
    /// Where the status says that a step is solved, joints are as far from their constraints as its tolerance says.
    Residual,
    /// Joints that gape show in the status.
    Open,
    /// A run that goes on from a snapshot has the same bits.
    Snapshot,
}

names!(Law {
    Panic = "panic",
    Finite = "finite",
    LinearMomentum = "linear-momentum",
    AngularMomentum = "angular-momentum",
    Energy = "energy",
    Cone = "cone",
    Friction = "friction",
    Passing = "passing",
    Depth = "depth",
    Residual = "residual",
    Open = "open",
    Snapshot = "snapshot",
});

/// A law that does not hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// Which.
    pub law: Law,
    /// In which step, from 1; 0 where it is none.
    pub step: usize,
    /// What was found over what is allowed; infinite where nothing is.
    pub ratio: f64,
    /// What was found, with numbers and units.
    pub message: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { law, step, ratio, message } = self;
        write!(f, "{law} broken {ratio:.2} times over in step {step}: {message}")
    }
}
