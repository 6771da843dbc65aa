//! Of what error and run time over the time step are measured.

use cosserat::simulation::{Formulation, Integrator};
use evaluation::time_step::Point;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct TimeStepKey {
    pub(super) scene: String,
    /// Steps at the scene's time step; `None` for a case with a right value, which says so itself.
    pub(super) steps: Option<usize>,
    pub(super) formulation: String,
    pub(super) integrator: String,
    /// How many steps are made for one of the scene's.
    pub(super) substeps: Vec<f64>,
    pub(super) repetitions: usize,
}

impl TimeStepKey {
    /// Whether it is what a user gets who asks for nothing.
    pub(super) fn is_default(&self) -> bool {
        self.formulation == Formulation::default().name() && self.integrator == Integrator::default().name()
    }

    pub(super) fn way(&self) -> String {
        format!("{}, {}", self.formulation, self.integrator)
    }
}

/// What was measured of one scene in one way.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    /// Names of the errors.
    pub(super) errors: Vec<String>,
    /// Where the right value comes from.
    pub(super) right: String,
    /// The refined run's own errors; empty against theory.
    pub(super) floor: Vec<f64>,
    pub(super) points: Vec<Point>,
}
