//! How a path is followed.

use crate::{StaticParams, StaticParamsError};

/// How a path is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathParams {
    /// How the first equilibrium is found, and when an equilibrium counts as found.
    pub rest: StaticParams,
    /// Where the path ends [s].
    pub until: f64,
    /// Longest step: the root of the sum of squares of the time over that of the whole path, of the shifts over the length
    /// and of the turns in rad, the latter two as the mean over the segments.
    pub longest_step: f64,
    /// Most equilibria.
    pub most_points: usize,
}

impl PathParams {
    /// A path until a time [s].
    pub fn until(until: f64) -> Self {
        Self { rest: StaticParams::default(), until, longest_step: 0.02, most_points: 5000 }
    }

    pub(super) fn validate(&self) -> Result<(), StaticParamsError> {
        self.rest.validate()?;
        for (name, value) in [("until", self.until), ("longest_step", self.longest_step)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(StaticParamsError { name, value, allowed: "finite and > 0" });
            }
        }
        Ok(())
    }
}
