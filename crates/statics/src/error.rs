//! Why there is no static analysis.

use rod::{JointForce, Model, ModelError, State, Strength};
use thiserror::Error;

use crate::params::StaticParamsError;

/// Why there is no static analysis.
#[derive(Debug, Error)]
pub enum StaticError {
    /// The model or the state is not valid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Rods that form more loops than one where only one is known.
    #[error("{0} needs rods that form chains, trees and single rings, and these form more loops")]
    Loops(&'static str),
    /// A path of equilibria that is not known.
    #[error("a path of equilibria needs {0}")]
    Path(&'static str),
    /// Several equilibria of what is not known.
    #[error("the search for several equilibria needs {0}")]
    Branches(&'static str),
    /// Modes under torques that turn with nothing: they have no energy, and so the tangent is not symmetric.
    #[error(
        "modal analysis needs loads that are forces fixed in space: torques, and loads that follow their segments, have no energy"
    )]
    Torques,
    /// Contacts that a static analysis does not know.
    #[error("static analysis knows contacts with planes, spheres and capsules, but {0}")]
    UnknownContacts(&'static str),
    /// Eyelets where nothing knows of them.
    #[error("{0} knows no eyelets, but the model has some; run it with damping instead")]
    Sliding(&'static str),
    /// A model with sheaths, for what knows none.
    #[error("{0} knows no sheaths, but the model has some; run it with damping instead")]
    Sheaths(&'static str),
    /// A model with pulleys, for what knows none.
    #[error("{0} knows no pulleys, but the model has some; run it with damping instead")]
    Pulleys(&'static str),
    /// Joints with laws where nothing knows of them.
    #[error("{0} knows elastic joints alone, but joint {1} of the model has a law; run it with damping instead")]
    Inelastic(&'static str, usize),
    /// Joints that can break where nothing knows of them.
    #[error("{0} knows no joints that break, but joint {1} of the model can; run it with damping instead")]
    Breakable(&'static str, usize),
    /// In equilibrium a joint would bear more than it can.
    #[error("joint {joint} breaks: in equilibrium it would bear {of} of {load:e} {unit}, and it bears {most:e} {unit}")]
    Breaks {
        /// The joint of which most is asked for what it bears.
        joint: usize,
        /// What it would bear: a tension [N], a bending moment [N m] or a curvature beyond rest [1/m].
        of: &'static str,
        /// How much.
        load: f64,
        /// How much it bears.
        most: f64,
        /// Of both.
        unit: &'static str,
    },
    /// Forces push what nothing holds.
    #[error(
        "an equilibrium needs grips, clamps or fixed segments, but nothing holds the rods of segment {segment}, and their \
         weight, the loads or the wind drive them off"
    )]
    DrivenOff {
        /// The first of their segments.
        segment: usize,
    },
    /// The linear solver cannot be set up for this graph.
    #[error(transparent)]
    Solver(#[from] jointed::linear::solvers::SolverError),
    /// A parameter of a static analysis is not allowed.
    #[error("static parameter {0}")]
    Params(#[from] StaticParamsError),
    /// Contacts where nothing knows of them.
    #[error(
        "{what} knows no contacts, but the model has some (between segments: {}, obstacles: {obstacles})",
        if *.between_segments { "yes" } else { "no" }
    )]
    Contacts {
        /// What was asked for.
        what: &'static str,
        /// Whether segments can touch each other.
        between_segments: bool,
        /// Number of obstacles.
        obstacles: usize,
    },
}

/// Refuses a model with joints that are not elastic for `what`, which knows none.
pub(super) fn only_elastic(model: &Model, what: &'static str) -> Result<(), StaticError> {
    match model.laws.first() {
        None => Ok(()),
        Some(own) => Err(StaticError::Inelastic(what, own.joint)),
    }
}

/// Refuses a model with rods that run through eyelets or over pulleys for `what`, which knows none.
pub(super) fn without_eyelets(model: &Model, what: &'static str) -> Result<(), StaticError> {
    if !model.pulleys.is_empty() {
        return Err(StaticError::Pulleys(what));
    }
    if !model.contacts.sheaths.is_empty() {
        return Err(StaticError::Sheaths(what));
    }
    if model.sliding_joints.is_empty() { Ok(()) } else { Err(StaticError::Sliding(what)) }
}

/// Refuses a model with joints that can break for `what`, which knows none.
pub(super) fn unbreakable(model: &Model, what: &'static str) -> Result<(), StaticError> {
    match model.breakable.first() {
        None => Ok(()),
        Some(own) => Err(StaticError::Breakable(what, own.joint)),
    }
}

/// Refuses an equilibrium in which a joint bears more than it can.
pub(super) fn refuse_breaks(model: &Model, state: &State, forces: &[JointForce]) -> Result<(), StaticError> {
    let asked = model.breakable.iter().map(|own| {
        let joint = &model.joints[own.joint];
        let load = Strength::asked(model, state, joint, &forces[own.joint]);
        let (share, of) = own.strength.share(&load);
        (share, of, own, load)
    });
    let worst = asked.max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, of, own, load)) = worst.filter(|(share, ..)| *share > 1.0) else { return Ok(()) };
    let (of, unit, load, most) = [
        ("a tension", "N", load.tension, own.strength.tension),
        ("a moment", "N m", load.moment, own.strength.moment),
        ("a curvature", "1/m", load.curvature, own.strength.curvature),
    ][of];
    Err(StaticError::Breaks { joint: own.joint, of, load, most, unit })
}

/// Refuses a model with contacts for `what`, which knows none.
pub(super) fn without_contacts(model: &Model, what: &'static str) -> Result<(), StaticError> {
    if model.contacts.is_empty() {
        return Ok(());
    }
    let (between_segments, obstacles) = (model.contacts.between_segments.is_some(), model.contacts.obstacles.len());
    Err(StaticError::Contacts { what, between_segments, obstacles })
}
