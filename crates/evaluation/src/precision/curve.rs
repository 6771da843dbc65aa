//! What a way came to, level by level. Files may hold it: all but the times is the same on every run.

use serde::{Deserialize, Serialize};

use super::level::Level;
use super::pareto::{Line, Place};
use crate::guesses::Spread;

/// What an error is measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// The same formulation at the same time step, solved to rounding errors.
    Exact,
    /// The reference that is converged in time step and segment length.
    Converged,
}

/// Why a level was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GivenUp {
    /// It took more than its budget of time.
    OverBudget,
    /// A step did not converge, and its linear solver had run out of iterations.
    LinearSolver,
    /// The numbers were not finite.
    NotFinite,
}

/// A way at one level of accuracy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Level.
    pub level: Level,
    /// Worst status of any step; "out of iterations" is what a fixed number of iterations ends with.
    pub status: String,
    /// The step, from 1, in which it was given up, and why; its errors are those of the samples before.
    pub given_up: Option<(usize, GivenUp)>,
    /// Time per simulated second [s/s], over the repetitions; `None` where it was given up.
    pub time: Option<Spread>,
    /// The same relative to the yardstick's median.
    pub ratio: Option<Spread>,
    /// Outer iterations per step of the problem's (substeps together) and connected set.
    pub outer_per_step: f64,
    /// Iterations of the linear solver per step and connected set; 0 for direct solvers.
    pub linear_per_step: f64,
    /// Errors ([`super::metrics::position_error`]) at the samples, against the exact reference of the way's formulation;
    /// `None` where the problem has none, and with substeps, which are another motion.
    pub exact: Option<Vec<f64>>,
    /// Errors against the converged reference; `None` where the problem has none.
    pub converged: Option<Vec<f64>>,
}

/// A way at all its levels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Name of the scene.
    pub scene: String,
    /// Name of the way.
    pub way: String,
    /// What sort of way it is.
    pub kind: String,
    /// Time step [s].
    pub dt: f64,
    /// Number of steps.
    pub steps: usize,
    /// Steps, from 1, after which errors were measured.
    pub samples: Vec<usize>,
    /// How many of them come before the first contact in any of the references.
    pub samples_before_contact: usize,
    /// Time of the yardstick per simulated second [s/s], over the repetitions; see [`super::run_way`].
    pub yardstick: Option<Spread>,
    /// One point a level.
    pub points: Vec<Point>,
}

impl Point {
    /// The largest error at any of the first `count` samples; `None` where it was given up, or nothing was measured.
    pub fn error(&self, against: Against, count: usize) -> Option<f64> {
        let errors = match against {
            Against::Exact => &self.exact,
            Against::Converged => &self.converged,
        };
        errors.as_ref().filter(|_| self.given_up.is_none())?.iter().take(count).copied().reduce(f64::max)
    }
}

impl Curve {
    /// Error, as [`Point::error`], and time of each point that has both; times are relative to the yardstick's.
    pub fn line(&self, against: Against, count: usize) -> Line {
        let place = |point: &Point| Some(Place { error: point.error(against, count)?, time: point.ratio?.median });
        let places = self.points.iter().filter_map(place).collect();
        Line { way: self.way.clone(), kind: self.kind.clone(), places }
    }
}
