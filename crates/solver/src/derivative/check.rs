//! Whether variations fit a model.

use rod::Model;

use super::error::{DerivativeError, refuse};
use super::variation::{StateVariation, Variation};

impl StateVariation {
    fn check_lists(&self, expected: usize) -> Result<(), DerivativeError> {
        self.lists().iter().try_for_each(|(what, list)| check(what, list.len(), expected))
    }

    /// Whether it fits a model.
    pub(super) fn check(&self, model: &Model) -> Result<(), DerivativeError> {
        self.check_lists(model.segments.len())?;
        if self.forces.is_empty() { Ok(()) } else { check("forces of joints", self.forces.len(), model.joints.len()) }
    }
}

impl Variation {
    /// Whether it fits a model.
    pub(super) fn check(&self, model: &Model) -> Result<(), DerivativeError> {
        check("joints", self.joints.len(), model.joints.len())?;
        check("segments", self.segments.len(), model.segments.len())?;
        check("loads", self.loads.len(), model.loads.len())?;
        let there = model.contacts.obstacles.len();
        refuse(self.obstacles.iter().any(|own| own.obstacle >= there), "obstacles that are not there")?;
        check("forces of joints at the start", self.start.forces.len(), 0)?;
        self.start.check_lists(model.segments.len())
    }
}

fn check(what: &'static str, found: usize, expected: usize) -> Result<(), DerivativeError> {
    if found == expected { Ok(()) } else { Err(DerivativeError::Size { what, found, expected }) }
}
