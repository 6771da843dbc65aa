//! Whether variations fit a model.

use component::variation::{StateVariation, Variation};
use rod::Model;

use super::error::{DerivativeError, refuse};

fn check_lists(variation: &StateVariation, expected: usize) -> Result<(), DerivativeError> {
    variation.lists().iter().try_for_each(|(what, list)| check(what, list.len(), expected))
}

/// Whether a variation of states fits a model.
pub(super) fn check_state(variation: &StateVariation, model: &Model) -> Result<(), DerivativeError> {
    check_lists(variation, model.segments.len())?;
    let forces = variation.forces.len();
    if forces == 0 { Ok(()) } else { check("forces of joints", forces, model.joints.len()) }
}

/// Whether a variation fits a model.
pub(super) fn check_all(variation: &Variation, model: &Model) -> Result<(), DerivativeError> {
    check("joints", variation.joints.len(), model.joints.len())?;
    check("segments", variation.segments.len(), model.segments.len())?;
    check("loads", variation.loads.len(), model.loads.len())?;
    let there = model.contacts.obstacles.len();
    refuse(variation.obstacles.iter().any(|own| own.obstacle >= there), "obstacles that are not there")?;
    check("forces of joints at the start", variation.start.forces.len(), 0)?;
    check_lists(&variation.start, model.segments.len())
}

fn check(what: &'static str, found: usize, expected: usize) -> Result<(), DerivativeError> {
    if found == expected { Ok(()) } else { Err(DerivativeError::Size { what, found, expected }) }
}
