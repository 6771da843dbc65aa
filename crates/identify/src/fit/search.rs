//! What is searched for, and in which stages.

use serde::{Deserialize, Serialize};

use crate::parameter::Parameter;
use crate::quantity::Quantity;
use crate::specimen::{Numbers, Specimen};

/// What a specimen has numbers of.
pub type Of<S> = <<S as Specimen>::Numbers as Numbers>::Quantity;

/// How to search.
#[derive(Clone, Debug, PartialEq)]
pub struct Search<Q> {
    /// What is searched for; all else is held where the search begins.
    pub free: Vec<Q>,
    /// What is searched for beside it from the last stage on.
    pub later: Vec<Q>,
    /// What is looked at, one after the other: little first, which leads to the basin.
    pub stages: Vec<Stage>,
    /// Distance of a coordinate [m] from which on it counts linearly and no longer squared.
    pub huber: f64,
    /// Steps from frame to frame.
    pub steps: usize,
    /// Most iterations at the end with a finer simulation, where there is one.
    pub finer: usize,
    /// The dispersion of the loss beside what is expected of quantities.
    pub dispersion: Dispersion,
    /// How long parts of a recording are that count as independent of each other [s]; infinite: each recording is one.
    pub independent: f64,
}

/// How the dispersion of the loss over recordings is estimated: what its gradients vary by, over what they would by independent residuals of unit
/// variance (quasi-likelihood; Wedderburn, Biometrika 61, 1974).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dispersion {
    /// By how gradients of recordings scatter: the variance of a residual where all are independent, and as much more as they are alike.
    Scatter,
    /// The mean loss of a recording: its residuals are taken for alike, so that a prior weighs as much as one more recording. For few recordings of
    /// many numbers: with it branched cables BDLO2 and BDLO3 are predicted 5 and 7 % nearer than by scatter.
    Recording,
}

/// A part of the recordings that is looked at until the loss falls no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stage {
    /// Frames from the start that count, of which a recording may have fewer; `None`: all.
    pub frames: Option<usize>,
    /// One recording in so many counts.
    pub every: usize,
    /// Most iterations.
    pub iterations: usize,
}

impl Stage {
    /// So many frames of every recording.
    pub const fn of_all(frames: usize, iterations: usize) -> Self {
        Self { frames: Some(frames), every: 1, iterations }
    }
}

impl Default for Search<Parameter> {
    fn default() -> Self {
        let stages = vec![
            Stage { frames: Some(100), every: 4, iterations: 12 },
            Stage { frames: None, every: 4, iterations: 10 },
            Stage { frames: None, every: 1, iterations: 12 },
        ];
        Self { finer: 2, ..Self::of(Parameter::DEFAULT.to_vec(), stages) }
    }
}

impl<Q: Quantity> Search<Q> {
    /// A search for some quantities, without an end with a finer simulation.
    pub fn of(free: Vec<Q>, stages: Vec<Stage>) -> Self {
        Self {
            free,
            later: Vec::new(),
            stages,
            huber: 5e-3,
            steps: 1,
            finer: 0,
            dispersion: Dispersion::Scatter,
            independent: f64::INFINITY,
        }
    }

    /// Most iterations: of all stages, and of the end.
    pub fn iterations(&self) -> usize {
        self.finer + self.stages.iter().map(|stage| stage.iterations).sum::<usize>()
    }
}
