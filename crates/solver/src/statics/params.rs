//! What a static analysis is asked for.

use thiserror::Error;

/// When the relaxation ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticParams {
    /// Largest movement of a segment in each of the last steps: in segment lengths, and in radians.
    pub tolerance: f64,
    /// First pseudo time step [s].
    pub first_dt: f64,
    /// Cap on the number of steps.
    pub max_steps: usize,
}

impl Default for StaticParams {
    fn default() -> Self {
        Self { tolerance: 1e-9, first_dt: 1e-2, max_steps: 10_000 }
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
        let Self { tolerance, first_dt, max_steps } = *self;
        positive("tolerance", tolerance)?;
        positive("first_dt", first_dt)?;
        check("max_steps", max_steps as f64, max_steps > 0, ">= 1")
    }
}
