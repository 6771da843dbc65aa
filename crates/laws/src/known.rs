//! Faults that are known.

use crate::case::{Case, CaseError};
use crate::laws::Law;

/// A fault of the simulator that is known and not mended yet.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// The law that breaks.
    pub law: Law,
    /// What is wrong.
    pub why: &'static str,
    /// Scenes of seed 1 below 100 that break the law for this reason.
    pub scenes: &'static [u64],
    /// The smallest scene that breaks the law, as [`Case::file`] writes it.
    pub text: &'static str,
}

/// All of them.
pub const KNOWN: &[Known] = &[];

impl Known {
    /// Its case.
    ///
    /// # Errors
    /// If its first line says no way.
    pub fn case(&self) -> Result<Case, CaseError> {
        Case::parse(self.text, self.law.name())
    }
}
