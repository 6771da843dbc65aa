//! Of what needs are measured.

use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct NeedsKey {
    pub(super) scene: String,
    pub(super) formulation: String,
    pub(super) steps: usize,
}
