//! How accurately a way is run.

use cosserat::simulation::{Settings, SolverKind};
use serde::{Deserialize, Serialize};

use super::reference::CONTACT_TOLERANCE;

/// When the outer iterations of a step end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Outer {
    /// At this residual, relative to the prediction's: see [`cosserat::simulation::StepParams::relative_tolerance`].
    Tolerance(f64),
    /// After so many, converged or not, without substeps.
    Iterations(usize),
}

/// A level of accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// When outer iterations end.
    pub outer: Outer,
    /// Tolerance of conjugate gradients; `None` leaves it as it is.
    pub linear: Option<f64>,
    /// Into how many steps each of the problem's is divided; at least 1.
    pub substeps: usize,
}

impl Level {
    /// This end of outer iterations, with the tolerance of conjugate gradients as it is and without substeps.
    pub fn new(outer: Outer) -> Self {
        Self { outer, linear: None, substeps: 1 }
    }

    /// Levels at these outer tolerances. Where `solver` iterates, its tolerance is the same.
    pub fn of_tolerances(solver: SolverKind, tolerances: &[f64]) -> Vec<Self> {
        let linear = |tolerance| matches!(solver, SolverKind::Cg(_)).then_some(tolerance);
        let level = |&tolerance: &f64| Self { linear: linear(tolerance), ..Self::new(Outer::Tolerance(tolerance)) };
        tolerances.iter().map(level).collect()
    }

    /// The settings at this level. The absolute tolerance goes down with the relative one, as far as a thousandth of it;
    /// so does the contacts', from that of the settings on, in proportion to their relative tolerance.
    pub fn settings(&self, base: &Settings) -> Settings {
        let mut settings = *base;
        let step = &mut settings.step;
        match self.outer {
            Outer::Tolerance(tolerance) => {
                let tied = step.contact_tolerance * tolerance / step.relative_tolerance;
                step.contact_tolerance = step.contact_tolerance.min(tied.max(CONTACT_TOLERANCE));
                step.absolute_tolerance = step.absolute_tolerance.min(1e-3 * tolerance);
                (step.relative_tolerance, step.motion_tolerance) = (tolerance, tolerance);
            }
            Outer::Iterations(count) => {
                (step.relative_tolerance, step.absolute_tolerance, step.motion_tolerance) = (0.0, 0.0, 0.0);
                (step.max_iterations, step.max_halvings) = (count, 0);
            }
        }
        if let (SolverKind::Cg(params), Some(tolerance)) = (&mut settings.solver, self.linear) {
            params.tolerance = tolerance;
        }
        settings
    }
}
