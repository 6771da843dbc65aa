//! What a law remembers from step to step, and what it answers; numbers that laws share.

use nalgebra::{Matrix3, Vector3};

/// Both ratios of hardening add up to this at least, the rest being kinematic: without hardening the tangent is singular in the direction of flow, and
/// nothing but inertia says which joints of a wire flow. A joint that has flowed by 10 times its elastic curvature bears 1 % more than without it. The same wire has 13 of 200 steps
/// halved with this, 22 with a tenth of it.
pub(super) const LEAST_HARDENING: f64 = 1e-3;

/// r of [`super::JointLaw::resolve`] over the elastic stiffness. A steel wire that grips bend to and fro takes 823, 961 and 1088 iterations for 200 steps with
/// 1, 0.1 and 0.01 at a hardening of 0.01, of which 5, 0 and 0 steps are halved; with 0.003 1147, 1125 and 2134, of which 9, 1 and 9.
pub(super) const RESOLVENT: f64 = 0.1;

/// What a law remembers from step to step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InternalVariables {
    /// Strain at the end of the last step [1/m].
    pub strain: Vector3<f64>,
    /// Plastic curvatures and twist [1/m]; or the moment of friction [N m]; or the moments of the branches [N m]; or the places of the frictions of a table [1/m]. Empty before the first step.
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
