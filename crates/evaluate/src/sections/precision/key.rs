//! Of what error and run time are measured, and what came of it.

use evaluation::precision::{Budget, Curve, Level};
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct PrecisionKey {
    pub(super) scene: String,
    pub(super) way: String,
    pub(super) steps: usize,
    pub(super) factors: Vec<usize>,
    pub(super) levels: Vec<Level>,
    pub(super) budget: Budget,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    pub(super) curve: Curve,
    /// The converged reference's own error, the largest of all samples; `None` where there is none.
    pub(super) floor: Option<f64>,
    /// Worst status of the exact reference of the way's formulation.
    pub(super) reference: String,
}
