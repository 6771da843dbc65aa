//! What a law remembers from step to step, and what it answers.

use nalgebra::{Matrix3, Vector3};

/// What a law remembers from step to step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InternalVariables {
    /// Strain at the end of the last step [1/m].
    pub strain: Vector3<f64>,
    /// Plastic curvatures and twist [1/m]; or the moment of friction [N m]; or the moments of the branches [N m]. Empty before the first step.
    pub parts: Vec<Vector3<f64>>,
    /// By how much of the first yield moments the yield surface has grown.
    pub hardening: f64,
    /// Work that has been lost so far, per length [J/m].
    pub dissipated: f64,
}

/// What a joint answers a strain with at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Moments about d1 and d2 and torque about d3 [N m].
    pub moment: Vector3<f64>,
    /// Algorithmic tangent, symmetric and positive definite [N m^2].
    pub tangent: Matrix3<f64>,
}

impl InternalVariables {
    /// Makes them those of a joint at rest; what was lost stays lost.
    pub fn forget(&mut self) {
        (self.strain, self.hardening) = (Vector3::zeros(), 0.0);
        self.parts.fill(Vector3::zeros());
    }
}
