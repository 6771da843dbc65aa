//! Of what stability is measured, and what came of it.

use evaluation::stress::CaseRun;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct StabilityKey {
    pub(super) case: String,
    pub(super) formulation: String,
    /// Name of the start; of a learned one, "rod" or "helix" first.
    pub(super) start: String,
    pub(super) solver: String,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    pub(super) row: CaseRun,
}

pub(super) const DIRECT: &str = "direct";

pub(super) const ZERO: &str = "zero";
