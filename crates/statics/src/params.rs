//! What a static analysis is asked for.

use names::names;
use thiserror::Error;

/// How equilibria are found. They are the same where a state is near one; elsewhere the two may come to different ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StaticMethod {
    /// Newton's method with the exact tangent on chains, trees and rings; the flow for sets with several loops, and where
    /// Newton's method does not come to rest.
    #[default]
    Newton,
    /// The flow alone.
    Flow,
}

names!(StaticMethod { Newton = "newton", Flow = "flow" });

/// How an equilibrium is found, and when the search ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticParams {
    /// How it is found.
    pub method: StaticMethod,
    /// Whether Newton's method leaves an unstable equilibrium that it comes to; else that is the result.
    pub leave_unstable: bool,
    /// Largest movement of a segment in the last step, in segment lengths and in radians; in each of the last five of the flow.
    pub tolerance: f64,
    /// First pseudo time step of the flow [s].
    pub first_dt: f64,
    /// Cap on the number of steps.
    pub max_steps: usize,
}

impl Default for StaticParams {
    fn default() -> Self {
        Self {
            method: StaticMethod::default(),
            leave_unstable: true,
            tolerance: 1e-9,
            first_dt: 1e-2,
            max_steps: 10_000,
        }
    }
}

/// A parameter of a static analysis that is not allowed.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("{name} = {value}, but it must be {allowed}")]
pub struct StaticParamsError {
    /// Name of the parameter.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What is allowed.
    pub allowed: &'static str,
}

impl StaticParams {
    /// Checks every number.
    ///
    /// # Errors
    /// The first parameter that is not allowed.
    pub fn validate(&self) -> Result<(), StaticParamsError> {
        let check = |name, value: f64, is_allowed: bool, allowed| {
            if is_allowed { Ok(()) } else { Err(StaticParamsError { name, value, allowed }) }
        };
        let positive = |name, x: f64| check(name, x, x.is_finite() && x > 0.0, "finite and > 0");
        let Self { method: _, leave_unstable: _, tolerance, first_dt, max_steps } = *self;
        positive("tolerance", tolerance)?;
        positive("first_dt", first_dt)?;
        check("max_steps", max_steps as f64, max_steps > 0, ">= 1")
    }
}
