//! Where a network comes from.

use serde::Serialize;

/// Which network a guess is.
#[derive(Clone, Debug, Serialize)]
pub struct Origin {
    /// Its recipe, its training, and where it comes from, in words.
    pub network: String,
    /// BLAKE3 hash of its weights' file, as its card has it.
    pub weights_blake3: String,
}
