//! Friction between the strands of a cable that bends: Dahl's model.
//!
//! Beside the elastic moment, which is that of strands that slip, there is one of friction, h in the plane of d1 and d2, that follows the curvature k with
//! the stiffness s as long as strands stick, and comes to M_f where all slip:
//!
//! ```text
//! dh = s (dk - h |dk| / M_f)
//! ```
//!
//! (Dahl, "A solid friction model", 1968, with the exponent 1.) It depends on no rate. Along a straight way from k_0 to k_0 + D it is
//! `h = M_f d + (h_0 - M_f d) exp(-s |D| / M_f)` with d = D / |D|, and a step takes that. Where h does not lie along d the derivative is not
//! symmetric; the tangent is its part that is.

use nalgebra::{Matrix3, Vector3};

use super::variables::{Answer, InternalVariables};

/// Friction between strands, in bending alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrandFriction {
    /// Moment M_f of friction where all strands slip [N m].
    pub moment: f64,
    /// Stiffness s by which sticking strands add to the joint's own [N m^2].
    pub stiffness: f64,
}

/// A step from k_0: its direction, its length over that in which friction builds up, and what of h_0 is left.
struct Way {
    direction: Vector3<f64>,
    left: f64,
    /// (1 - exp(-x)) / x.
    mean: f64,
    friction: Vector3<f64>,
}

impl StrandFriction {
    pub(super) fn mistake(&self) -> Option<(&'static str, f64, &'static str)> {
        let own = [("moment of friction", self.moment), ("stiffness of sticking strands", self.stiffness)];
        let bad = own.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0));
        bad.map(|(quantity, value)| (quantity, value, "finite and > 0"))
    }

    fn friction(at: &InternalVariables) -> Vector3<f64> {
        at.parts.first().copied().unwrap_or_default()
    }

    fn go(&self, strain: &Vector3<f64>, at: &InternalVariables) -> Way {
        let mut by = strain - at.strain;
        by.z = 0.0;
        let length = by.norm();
        let x = length * self.stiffness / self.moment;
        let mean = if x > 1e-8 { -(-x).exp_m1() / x } else { 1.0 - 0.5 * x };
        let friction = Self::friction(at) * (-x).exp() + by * (self.stiffness * mean);
        let direction = if length > 0.0 { by / length } else { by };
        Way { direction, left: (-x).exp(), mean, friction }
    }

    pub(super) fn answer(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> Answer {
        let Way { direction, left, mean, friction } = self.go(strain, at);
        let moment = stiffness.component_mul(strain) + friction;
        let across = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0)) - direction * direction.transpose();
        let along = left * (1.0 - Self::friction(at).dot(&direction) / self.moment);
        let of_friction = (direction * direction.transpose() * along + across * mean) * self.stiffness;
        Answer { moment, tangent: Matrix3::from_diagonal(stiffness) + of_friction }
    }

    /// See [`super::JointLaw::sudden`].
    pub(super) fn sudden(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> Answer {
        let sticking = Vector3::new(self.stiffness, self.stiffness, 0.0);
        let moment =
            stiffness.component_mul(strain) + Self::friction(at) + sticking.component_mul(&(strain - at.strain));
        Answer { moment, tangent: Matrix3::from_diagonal(&(stiffness + sticking)) }
    }

    /// The work along the way is `M_f |D| + (h_0 . d - M_f) (1 - exp(-x)) M_f / s`; what of it is not stored is lost.
    pub(super) fn advance(&self, strain: &Vector3<f64>, at: &mut InternalVariables) {
        let Way { direction, mean, friction, .. } = self.go(strain, at);
        let length = (strain - at.strain).dot(&direction);
        let before = Self::friction(at);
        let work = length * (self.moment + (before.dot(&direction) - self.moment) * mean);
        at.dissipated += work - (friction.norm_squared() - before.norm_squared()) / (2.0 * self.stiffness);
        at.parts[0] = friction;
    }

    pub(super) fn stored(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> f64 {
        let mut by = strain - at.strain;
        by.z = 0.0;
        let friction = Self::friction(at) + by * self.stiffness;
        0.5 * stiffness.component_mul(strain).dot(strain) + friction.norm_squared() / (2.0 * self.stiffness)
    }
}
