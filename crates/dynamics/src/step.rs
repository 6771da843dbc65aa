//! What a step is asked for and how it ends: parameters, intervals of time, statuses.

use thiserror::Error;

pub use component::Interval;

use rod::Integrator;

use crate::contact_params::ContactParams;
use crate::formulation::{ContactProjection, Formulation, Tangent};

/// When the outer iterations end and how far a step may be divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepParams {
    /// Equations to solve.
    pub formulation: Formulation,
    /// Matrix of formulation `newton`. With the positive one rods stay in lanes where one is held that others are not.
    pub tangent: Tangent,
    /// How the motion goes on from step to step.
    pub integrator: Integrator,
    /// Residual to reach, relative to that of the predicted state with lambda = 0 (so that a better start does not buy a
    /// stricter target) or to 1, whichever is less (so that a prediction far off does not make a bad step good enough).
    /// Scaled units: gaps in segment lengths, angles in radians.
    pub relative_tolerance: f64,
    /// With a momentum residual, where nothing can touch, in place of the residuals: by how much the surface of any body may still be off, as a
    /// share of the body's length; no more than gravity moves in a step.
    pub motion_tolerance: f64,
    /// Residual that is always good enough, in the same scaled units.
    pub absolute_tolerance: f64,
    /// Error of a contact that is good enough: penetration, or slip where it should stick, relative to the smaller radius.
    ///
    /// With a momentum residual, where bodies can touch, [`ContactParams::motion_tolerance`] times this takes the place of those above, as a share of
    /// the radius.
    pub contact_tolerance: f64,
    /// How contacts are projected.
    pub contact_projection: ContactProjection,
    /// How contacts are found and solved, in numbers.
    pub contact: ContactParams,
    /// Cap on the outer iterations of a step; where it may be halved, one that still converges at the cap may take as many
    /// again, which costs less than doing it over.
    pub max_iterations: usize,
    /// How many times a step that does not converge may be halved.
    pub max_halvings: u32,
}

impl StepParams {
    /// Those that a simulation has unless told otherwise.
    pub const DEFAULT: Self = Self {
        formulation: Formulation::Newton,
        tangent: Tangent::Auto,
        integrator: Integrator::Bdf2,
        relative_tolerance: 1e-6,
        motion_tolerance: 1e-3,
        absolute_tolerance: 1e-9,
        contact_tolerance: 1e-3,
        contact_projection: ContactProjection::Coupled,
        contact: ContactParams::DEFAULT,
        max_iterations: 30,
        max_halvings: 6,
    };
}

/// A parameter of steps that is not allowed.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("{name} = {value}, but it must be {allowed}")]
pub struct StepParamsError {
    /// Name of the parameter.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed.
    pub allowed: &'static str,
}

/// Halvings beyond this many leave nothing of a step but rounding errors.
const MOST_HALVINGS: u32 = 30;

impl StepParams {
    /// By how much the surface of a body may still be off when a step of formulation `newton` ends: as a share of its radius where bodies
    /// can `touch`, of its length elsewhere; and no more than gravity moves in a step.
    pub fn allowed_motion(&self, touch: bool) -> f64 {
        match touch {
            true => self.contact.motion_tolerance * self.contact_tolerance,
            false => self.motion_tolerance,
        }
    }

    /// Whether iterations may take the exact tangent, where contacts and loops allow it.
    pub(crate) fn may_be_exact(&self) -> bool {
        self.formulation.momentum() && self.tangent != Tangent::Positive
    }

    /// Checks every number. A relative and an absolute tolerance of 0 ask for as many iterations as there may be.
    ///
    /// # Errors
    /// The first parameter that is not allowed.
    pub fn validate(&self) -> Result<(), StepParamsError> {
        let check = |name, value: f64, is_allowed: bool, allowed| {
            if is_allowed { Ok(()) } else { Err(StepParamsError { name, value, allowed }) }
        };
        let Self { relative_tolerance, absolute_tolerance, motion_tolerance, .. } = *self;
        let Self { contact_tolerance, max_iterations, max_halvings, .. } = *self;
        let not_negative = |name, x: f64| check(name, x, x.is_finite() && x >= 0.0, "finite and >= 0");
        not_negative("relative_tolerance", relative_tolerance)?;
        not_negative("absolute_tolerance", absolute_tolerance)?;
        not_negative("motion_tolerance", motion_tolerance)?;
        let is_positive = contact_tolerance.is_finite() && contact_tolerance > 0.0;
        check("contact_tolerance", contact_tolerance, is_positive, "finite and > 0")?;
        check("max_iterations", max_iterations as f64, max_iterations > 0, ">= 1")?;
        check("max_halvings", f64::from(max_halvings), max_halvings <= MOST_HALVINGS, "<= 30")
    }
}

impl Default for StepParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// To the tolerance.
    Converged,
    /// To the tolerance, in substeps.
    ConvergedInSubsteps,
    /// To the tolerance, but a joint with a rest strain, a law or inner damping has turned past half a turn. Its strain begins again on the other side
    /// there, and so its energy jumps: the motion from there on is that of another rod.
    PastHalfTurn,
    /// The cap on iterations came first, even with the smallest substep. Where contacts were off by more than
    /// [`ContactParams::max_error`] radii then, what moves freely in their island was left where it was, at rest.
    OutOfIterations,
    /// Joints gape by more than a tenth of their length: something that is held is led where the rods cannot follow, into an
    /// obstacle or further than they reach. Where joints that do not stretch (compliances of 1e-10 m/N at most) answer with
    /// such a force, the equations are solved, and what they say is no motion of a rod. Where contacts leave nothing to solve,
    /// even with the smallest substep, what moves freely in the connected sets whose joints gape was left where it was, at
    /// rest.
    Apart,
    /// More contacts press at once than there is memory for; the segments were left where they were. Shorter steps would not
    /// help, so that there are none.
    TooManyContacts,
    /// The numbers were not finite, even with the smallest substep; the segments were left where they were.
    NonFinite,
}

impl Status {
    /// The status in words.
    pub fn name(self) -> &'static str {
        match self {
            Status::Converged => "converged",
            Status::ConvergedInSubsteps => "converged in substeps",
            Status::PastHalfTurn => "joints past half a turn",
            Status::OutOfIterations => "out of iterations",
            Status::Apart => "joints apart",
            Status::TooManyContacts => "too many contacts",
            Status::NonFinite => "not finite",
        }
    }

    /// Whether the step met its tolerance, in substeps or not, and is a step of the same rods: all but [`Status::PastHalfTurn`] of
    /// [`Self::is_solved`].
    pub fn is_converged(self) -> bool {
        self <= Status::ConvergedInSubsteps
    }

    /// Whether the step's equations are solved to the tolerance.
    pub fn is_solved(self) -> bool {
        self <= Status::PastHalfTurn
    }

    /// Whether segments were left where they were.
    pub fn is_stuck(self) -> bool {
        matches!(self, Status::TooManyContacts | Status::NonFinite)
    }

    /// Whether a shorter step may do better.
    pub(crate) fn may_be_halved(self) -> bool {
        matches!(self, Status::OutOfIterations | Status::NonFinite)
    }
}
