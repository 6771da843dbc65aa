//! What viewers do to the motion, as it is recorded.

use serde::{Deserialize, Serialize};

use crate::knobs::Knob;

/// Something done to the motion between two steps. Places are in world axes [m], velocities in [m/s] and [rad/s].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Input {
    /// A hand takes hold of a segment at a place.
    Grab {
        /// The hand, 0 to 9.
        hand: u8,
        /// The segment's index.
        segment: usize,
        /// Where.
        at: [f64; 3],
    },
    /// A hand goes somewhere.
    Move {
        /// The hand.
        hand: u8,
        /// Where to.
        to: [f64; 3],
    },
    /// A hand lets go.
    Drop {
        /// The hand.
        hand: u8,
    },
    /// A segment is held where it is.
    Pin {
        /// The segment's index.
        segment: usize,
    },
    /// A segment is let go, whatever holds it: a pin, or a grip of the model.
    Unpin {
        /// The segment's index.
        segment: usize,
    },
    /// What holds a segment moves on so, until it is told otherwise.
    Drive {
        /// The segment's index.
        segment: usize,
        /// Velocity [m/s].
        velocity: [f64; 3],
        /// Angular velocity [rad/s].
        turn: [f64; 3],
    },
    /// A quantity of the model is changed.
    Set(Knob),
}

/// Version of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Version {
    /// The first.
    #[serde(rename = "live-1")]
    Live1,
}

/// All inputs of a session up to now: with the same model, settings and program they replay to the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recording {
    /// Version of the format.
    pub format: Version,
    /// Segments of the model.
    pub segments: usize,
    /// Time step [s].
    pub dt: f64,
    /// Steps in all.
    pub steps: u64,
    /// Inputs, each before the step that it is numbered with, counted from 0; ascending.
    pub inputs: Vec<(u64, Input)>,
}
