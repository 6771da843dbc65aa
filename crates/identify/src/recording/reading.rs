//! How files are read, and what is read.

use nalgebra::Vector3;

use super::Grips;

/// How files are read that do not say it themselves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Frames a second of files without times.
    pub rate: f64,
    /// The file's unit of length [m].
    pub unit: f64,
    /// Which markers the grips hold, where a file has branches.
    pub grips: Grips,
}

impl Default for Reading {
    fn default() -> Self {
        Self { rate: 100.0, unit: 1.0, grips: Grips::Ends }
    }
}

/// Times [s] and markers by frame.
pub(super) type Frames = (Vec<f64>, Vec<Vec<Vector3<f64>>>);
