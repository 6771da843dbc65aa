//! Of what predictions of real cables are measured, and what came of it.

use correction::inputs::Kind;
use correction::network::Shape;
use serde::{Deserialize, Serialize};

/// Numbers of recordings to learn from that are compared.
pub(super) const FEWER: [usize; 6] = [1, 2, 5, 10, 30, 56];

/// How a cable is predicted, or what is asked of a prediction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Method {
    /// The first shape, carried along with the grips.
    Blend,
    /// The identified cable.
    Identified,
    /// The same with a finer simulation: so many times the steps, and so many times the segments.
    Refined(usize, usize),
    /// With a correction that was learned from this seed.
    Corrected(u64),
    /// With that of another network.
    By(Kind),
    /// The correction without a simulation.
    WithoutPhysics(Kind),
    /// Identified with a curvature at rest that differs along the cable; with moments of the joints, where it says so.
    Inside { moments: bool },
    /// What a correction's sizes are worth: the error of recordings that training keeps aside.
    Size { kind: Kind, shape: Shape, seed: u64 },
    /// Identified and corrected on half of the recordings, by kinds of motion, and predicted on the other half.
    OtherMotions,
    /// Identified and corrected on the slower half of the recordings, and predicted on the faster half.
    FasterMotions,
    /// Identified and corrected on so many of the recordings, evenly chosen.
    Fewer(usize),
    /// The grips' ways to and fro, so many times.
    ToAndFro(usize),
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct CableKey {
    pub(super) cable: String,
    /// Of all its recordings.
    pub(super) recordings_blake3: String,
    pub(super) method: Method,
}

/// Errors of a coordinate over the recordings that were predicted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Errors {
    /// What was predicted, or by what.
    pub(super) name: String,
    /// Mean over recordings [cm].
    pub(super) mean_cm: f64,
    /// Mean over recordings and free markers, by time [s].
    pub(super) over_time: Vec<(f64, f64)>,
}

/// What came of a method.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Measured {
    pub(super) errors: Vec<Errors>,
    /// Recordings that were learned from, and that were predicted.
    pub(super) recordings: [usize; 2],
    /// Time of searching or of training, beyond that of what it builds on [s].
    pub(super) seconds: f64,
    /// Parameters that were found.
    pub(super) parameters: Vec<(String, f64)>,
}
