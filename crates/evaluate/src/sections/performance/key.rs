//! Of what performance is measured.

use dataset::Scenario;
use serde::{Deserialize, Serialize};

/// The section's name.
pub(super) const ID: &str = "performance";

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct PerformanceKey {
    pub(super) scenario: Scenario,
    /// "segments", "stiffness" or "tolerance"; all else is drawn as in Table 1.
    pub(super) varied: String,
    pub(super) value: f64,
    pub(super) preconditioner: String,
    pub(super) tolerance: f64,
    pub(super) simulations: usize,
    pub(super) steps: usize,
    /// Of all, for times: see [`evaluation::paper::performance::measure`].
    pub(super) repeats: usize,
    pub(super) seed: u64,
}

/// Tolerance where it is not varied: the cell in which the paper's figures can be had.
pub(super) const TOLERANCE: f64 = 1e-4;
