//! Plasticity of a joint: a yield surface in moments and torque, associated flow, linear hardening.
//!
//! With xi = M - X, X the back moment and P = diag(1/M1^2, 1/M2^2, 1/T^2) the surface is
//!
//! ```text
//! f = sqrt(xi . P xi) - (1 + q) <= 0        yield
//! k_p' = gamma n,  n = P xi / sqrt(xi . P xi)    associated flow
//! X' = h_kin C k_p'                         Prager's kinematic hardening
//! q' = h_iso C_1 / M1^2 gamma               isotropic hardening
//! ```
//!
//! C being the elastic stiffnesses. In bending about d1 alone both give dM = h C_1 dk_p. The step is the closest-point projection (Simo and Hughes
//! 1998, boxes 3.1 to 3.3): C and P are diagonal, so that one number, the increment of gamma, is left to solve for.

use nalgebra::{Matrix3, Vector3};

use super::variables::{Answer, InternalVariables, LEAST_HARDENING, RESOLVENT};
use crate::Section;

/// How a joint yields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plasticity {
    /// Moments about d1 and d2, and torque about d3, at which it yields if each acts alone [N m].
    pub moments: Vector3<f64>,
    /// Slope of the yield moment over the plastic curvature, over the elastic stiffness, both about d1. The surface grows alike to all sides.
    pub isotropic: f64,
    /// Slope of the back moment over the plastic curvature, over the elastic stiffness. The surface moves.
    pub kinematic: f64,
}

/// What a step comes to.
struct Return {
    /// xi at its end, and n.
    relative: Vector3<f64>,
    normal: Vector3<f64>,
    /// Increment of gamma, zero where the step is elastic, and of q.
    gamma: f64,
    growth: f64,
}

impl Plasticity {
    /// Moments and torque at which a whole section flows, of a material that yields at `stress` [Pa] in tension and at its part 1/sqrt(3) in shear
    /// (von Mises): `4 r^3 s / 3` and `2 pi r^3 s / (3 sqrt(3))` of the full circle. It takes the place of the gradual yield of real sections, whose
    /// outermost fibre begins at `pi / 4` of the radius's cube: 0.589 of this moment. The torque of a rectangle is that of Nadai's heap of sand. `None` of
    /// sections for which it is not known.
    pub fn fully_plastic(section: Section, stress: f64) -> Option<Vector3<f64>> {
        let shear = stress / 3.0_f64.sqrt();
        let round = |cubes: f64| {
            let moment = 4.0 * cubes * stress / 3.0;
            Vector3::new(moment, moment, 2.0 * std::f64::consts::PI * cubes * shear / 3.0)
        };
        match section {
            Section::Circle { radius } => Some(round(radius.powi(3))),
            Section::Tube { outer, inner } => Some(round(outer.powi(3) - inner.powi(3))),
            Section::Rectangle { width, height } => {
                let (long, short) = (width.max(height), width.min(height));
                let torque = shear * short * short * (3.0 * long - short) / 6.0;
                Some(Vector3::new(width * height.powi(2) * stress / 4.0, height * width.powi(2) * stress / 4.0, torque))
            }
            Section::Ellipse { .. } | Section::Known { .. } => None,
        }
    }

    pub(super) fn mistake(&self) -> Option<(&'static str, f64, &'static str)> {
        let Self { moments, isotropic, kinematic } = self;
        if let Some(&moment) = moments.iter().find(|moment| !(moment.is_finite() && **moment > 0.0)) {
            return Some(("yield moment", moment, "finite and > 0"));
        }
        let slopes = [*isotropic, *kinematic].into_iter().find(|slope| !(slope.is_finite() && *slope >= 0.0));
        slopes.map(|slope| ("hardening", slope, "finite and >= 0"))
    }

    /// P, and dq / dgamma.
    fn constants(&self, stiffness: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let metric = self.moments.map(|moment| 1.0 / (moment * moment));
        (metric, self.isotropic * stiffness.x * metric.x)
    }

    /// The ratio of kinematic hardening that it has in effect.
    pub(super) fn moves(&self) -> f64 {
        self.kinematic.max(LEAST_HARDENING - self.isotropic)
    }

    fn plastic(at: &InternalVariables) -> Vector3<f64> {
        at.parts.first().copied().unwrap_or_default()
    }

    /// The closest-point projection of a strain in a joint that answers fast strains with `own` stiffnesses, C as a rule:
    /// `xi_i = xi_trial_i / (1 + s D_i P_i)` with `s = dgamma / (1 + q)` and D the sum of `own` and of kinematic hardening. The yield function is
    /// convex and falls with dgamma, so that Newton's method from zero goes up to the root from one side.
    fn project(&self, [own, stiffness]: [&Vector3<f64>; 2], strain: &Vector3<f64>, at: &InternalVariables) -> Return {
        let (metric, slope) = self.constants(stiffness);
        let plastic = Self::plastic(at);
        let back = stiffness * self.moves();
        let trial = own.component_mul(&(strain - plastic)) - back.component_mul(&plastic);
        let size = |xi: &Vector3<f64>| metric.component_mul(xi).dot(xi).sqrt();
        let (mut gamma, mut relative) = (0.0, trial);
        let (scaled, start) = ((own + back).component_mul(&metric), 1.0 + at.hardening);
        if size(&trial) > start {
            // From far outside of the surface an iteration about doubles the increment.
            for _ in 0..100 {
                let radius = start + slope * gamma;
                let s = gamma / radius;
                let per = scaled.map(|own| 1.0 / (1.0 + s * own));
                relative = trial.component_mul(&per);
                let now = size(&relative);
                let excess = now - radius;
                if excess.abs() <= 1e-14 * radius {
                    break;
                }
                // d|xi| / ds = -sum(P_i xi_i^2 D_i P_i / (1 + s D_i P_i)) / |xi|.
                let fall =
                    metric.component_mul(&relative).component_mul(&relative).dot(&scaled.component_mul(&per)) / now;
                let of_s = start / (radius * radius);
                let next = gamma + excess / (fall * of_s + slope);
                if next == gamma {
                    break;
                }
                gamma = next.max(0.0);
            }
        }
        let normal = metric.component_mul(&relative) / size(&relative).max(f64::MIN_POSITIVE);
        Return { relative, normal, gamma, growth: slope * gamma }
    }

    /// The strain k_0 at which to take the tangent where an iteration has come to `strain` k and `moment` M: that with `M(k_0) + r k_0 = M + r k`
    /// (the resolvent of the law), which is k where M is the law's. From k alone, a joint whose tangent is small as it yields would go from one side of
    /// the surface beyond the other and back, without an end; so it comes to the elastic range in between, as active sets do (Hager and
    /// Wohlmuth 2009). It is the same projection of `k + M / r` with the stiffness `r C / (C + r)`.
    pub(super) fn resolve(
        &self,
        stiffness: &Vector3<f64>,
        [strain, moment]: [&Vector3<f64>; 2],
        at: &InternalVariables,
    ) -> Vector3<f64> {
        let resolvent = stiffness * RESOLVENT;
        let softer = resolvent / (1.0 + RESOLVENT);
        let pushed = strain + moment.component_div(&resolvent);
        let Return { normal, gamma, .. } = self.project([&softer, stiffness], &pushed, at);
        let plastic = Self::plastic(at) + normal * gamma;
        let moment = softer.component_mul(&(pushed - plastic));
        plastic + moment.component_div(stiffness)
    }

    pub(super) fn answer(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> Answer {
        let Return { relative, normal, gamma, .. } = self.project([stiffness; 2], strain, at);
        if gamma == 0.0 {
            return self.sudden(stiffness, strain, at);
        }
        let moment = relative + stiffness.component_mul(&(Self::plastic(at) + normal * gamma)) * self.moves();
        // With A = (C^-1 + (1 + h) dgamma dn/dxi)^-1: dxi = A (dk - (1 + h) dgamma' n), n . dxi = slope dgamma'.
        let (metric, slope) = self.constants(stiffness);
        let (more, radius) = (1.0 + self.moves(), 1.0 + at.hardening + slope * gamma);
        let bends = (Matrix3::from_diagonal(&metric) - normal * normal.transpose()) * (more * gamma / radius);
        let yielding = Matrix3::from_diagonal(&stiffness.map(|own| 1.0 / own)) + bends;
        let elastic = Matrix3::from_diagonal(stiffness);
        let Some(inverse) = yielding.try_inverse() else { return Answer { moment, tangent: elastic } };
        let along = inverse * normal;
        let flow = along * along.transpose() * (more / (slope + more * along.dot(&normal)));
        let tangent = (inverse - flow + elastic * self.moves()) / more;
        let symmetric = (tangent + tangent.transpose()) * 0.5;
        Answer { moment, tangent: symmetric }
    }

    /// See [`super::JointLaw::sudden`].
    pub(super) fn sudden(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> Answer {
        let moment = stiffness.component_mul(&(strain - Self::plastic(at)));
        Answer { moment, tangent: Matrix3::from_diagonal(stiffness) }
    }

    pub(super) fn advance(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &mut InternalVariables) {
        let Return { normal, gamma, growth, .. } = self.project([stiffness; 2], strain, at);
        if gamma > 0.0 {
            at.dissipated += gamma * (1.0 + at.hardening + 0.5 * growth);
            at.hardening += growth;
            at.parts[0] += normal * gamma;
        }
    }

    pub(super) fn stored(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> f64 {
        let plastic = Self::plastic(at);
        let square = |x: Vector3<f64>| 0.5 * stiffness.component_mul(&x).dot(&x);
        square(strain - plastic) + self.moves() * square(plastic)
    }
}
