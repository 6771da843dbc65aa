//! Why a model cannot be simulated.

use thiserror::Error;

use crate::Body;

/// Why a model cannot be simulated.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ModelError {
    /// A number is not finite or outside of what is allowed.
    #[error("{what} {index}: {quantity} = {value}, but it must be {allowed}")]
    Value {
        /// "segment", "joint", "anchor", "load", "obstacle", "contact between segments" or "model".
        what: &'static str,
        /// Index of the offender.
        index: usize,
        /// Which quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// An index points outside of the model.
    #[error("{what} {index}: {target} {to} does not exist (there are {count})")]
    Index {
        /// What points there: "joint", "load", "segment", or a step of an assembly.
        what: &'static str,
        /// Index of the offender; in an assembly, of the next joint.
        index: usize,
        /// "segment", "anchor" or "rod".
        target: &'static str,
        /// The index it points to.
        to: usize,
        /// How many of the target there are.
        count: usize,
    },
    /// A list of an assembly's step is too short or too long.
    #[error("{what} {index}: {found} {quantity}, but there must be {allowed}")]
    Count {
        /// "rod", "branch", "clamp" or "copy".
        what: &'static str,
        /// Index of the rod, or of the next joint.
        index: usize,
        /// What the list holds.
        quantity: &'static str,
        /// How many there are.
        found: usize,
        /// How many there must be.
        allowed: String,
    },
    /// A motion that its body cannot follow.
    #[error("motion {index}: {mistake}")]
    Motion {
        /// Index into [`crate::Model::motions`].
        index: usize,
        /// Why not.
        mistake: DriveError,
    },
    /// A motion that its obstacle cannot follow.
    #[error("the motion of obstacle {index}: {mistake}")]
    ObstacleMotion {
        /// Index into [`crate::Contacts::obstacles`].
        index: usize,
        /// Why not.
        mistake: DriveError,
    },
    /// Two changes of the same load or of gravity.
    #[error("change {index}: change {other} is of the same")]
    Twice {
        /// Index into [`crate::Model::changes`].
        index: usize,
        /// The one before it.
        other: usize,
    },
    /// A joint that holds no segment, or the same segment twice.
    #[error("joint {index}: it must hold two different bodies, at least one of them a segment")]
    Degenerate {
        /// Index of the joint.
        index: usize,
    },
    /// The state's arrays do not fit the model.
    #[error("state has {found} entries for {expected} segments")]
    StateSize {
        /// Entries found.
        found: usize,
        /// Entries expected.
        expected: usize,
    },
}

/// Why a body cannot follow a motion.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum DriveError {
    /// The body moves freely.
    #[error("segment {0} is not fixed, but only what is held can be driven")]
    Free(usize),
    /// Two motions drive one body at the same time.
    #[error("motion {0} drives the same body")]
    Twice(usize),
    /// The body is held from the start, but by no motion that would let it go before this one takes hold.
    #[error("it takes hold of {0} on the way, which is held from the start")]
    Held(Body),
    /// An open grip is to be driven from the start.
    #[error("anchor {0} is open, but only what is held can be driven")]
    Open(usize),
    /// It would let go before it takes hold.
    #[error("it holds its body from {from} s until {until} s, but the second time must be later")]
    Times {
        /// When it takes hold [s].
        from: f64,
        /// When it lets go [s].
        until: f64,
    },
    /// At time 0 the motion is elsewhere.
    #[error("it begins {distance} m and {angle} rad away from where the body is")]
    Elsewhere {
        /// Distance of the two positions [m].
        distance: f64,
        /// Angle between the two orientations [rad].
        angle: f64,
    },
}

/// How far from 1 the norm of a quaternion or of a unit vector may be.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Checks a norm that must be 1.
pub(crate) fn unit(what: &'static str, index: usize, quantity: &'static str, value: f64) -> Result<(), ModelError> {
    if (value - 1.0).abs() <= UNIT_TOLERANCE {
        return Ok(());
    }
    Err(ModelError::Value { what, index, quantity, value, allowed: "1 to within 1e-6" })
}
