//! Second derivatives of what turns bodies: forces at arms, torques of bend-twist, inertia.
//!
//! All are with respect to world rotation vectors phi about the current orientations, `q' = exp(phi) q`.

use super::Coupling;
use kernels::lane::Real;
use kernels::math::{Sym3, Vec3, map_rows};

/// How `-r x f` changes as the arm r turns under a constant force f: the symmetric `(f.r) I - (f r^T + r f^T) / 2`.
///
/// It is the second derivative of `-f.(x + r)`. A pull along the arm is stiff, a push is soft.
#[inline(always)]
pub fn of_force<T: Real>(force: Vec3<T>, arm: Vec3<T>) -> Sym3<T> {
    Sym3::identity(force.dot(arm)) + Sym3::sym_outer(force, -arm)
}

/// The second derivative of `-mu.C_b`, the potential of a constant multiplier mu of bend-twist, as its two blocks: of a body
/// with itself (the same for both, S), and of body a (rows) with body b (columns).
///
/// `torque` is `T = G^T mu` on body b in world axes, `of_rows` the matrix A of [`crate::rotation::RotationRows::second`] for `R_a mu / l`. With
/// `exp(-phi_a) exp(phi_b)` to second order,
///
/// ```text
/// mu.C_b = const + T.(phi_b - phi_a) + (phi_b - phi_a).A (phi_b - phi_a) / 2 - T.(phi_a x phi_b) / 2 + O(phi^3)      S = -A
/// ```
#[inline(always)]
pub fn of_bend_twist<T: Real>(of_rows: Sym3<T>, torque: Vec3<T>) -> (Sym3<T>, Coupling<T>) {
    let symmetric = of_rows * T::splat(-1.0);
    (symmetric, Coupling { symmetric, half_torque: torque * T::splat(0.5) })
}

/// The symmetric part of the derivative of the inertia's torque `I phi` of a turn phi from the predicted pose, of which s is
/// the cosine of half the angle and phi = 2 sin(angle / 2) times the axis; `inertia` is I in world axes.
///
/// I turns along, and so the derivative is `s I + I [phi]x / 2 - [I phi]x`, which is not symmetric.
#[inline(always)]
pub fn of_inertia<T: Real>(inertia: Sym3<T>, s: T, phi: Vec3<T>) -> Sym3<T> {
    let m = map_rows(inertia.full(), |row| row.cross(phi * T::splat(0.25)));
    let both = |r: usize, c: usize| m[r][c] + m[c][r];
    inertia * s + Sym3([both(0, 0), both(1, 1), both(2, 2), both(0, 1), both(0, 2), both(1, 2)])
}

#[cfg(test)]
mod tests {
    use kernels::math::Quat;
    use nalgebra::{Matrix3, UnitQuaternion, Vector3};
    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rod::StrainMeasure;

    use super::*;
    use crate::rotation::RotationRows;

    fn random(rng: &mut impl Rng) -> Vector3<f64> {
        Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0))
    }

    fn own(x: &Vector3<f64>) -> Vec3<f64> {
        Vec3([x.x, x.y, x.z])
    }

    fn matrix(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
        Matrix3::from_fn(|r, c| rows[r][c])
    }

    fn orientation(rng: &mut impl Rng) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(random(rng) * 2.0)
    }

    fn turned(q: &UnitQuaternion<f64>, phi: Vector3<f64>) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(phi) * q
    }

    /// The remainder beyond some order falls by 2^order as steps are halved.
    fn assert_order(order: i32, remainder: impl Fn(f64) -> f64) {
        for step in [2e-2, 1e-2, 5e-3] {
            let ratio = remainder(step) / remainder(0.5 * step);
            let expected = 2.0_f64.powi(order);
            assert!((ratio / expected - 1.0).abs() < 0.15, "step {step}: ratio {ratio}, not {expected}");
        }
    }

    #[test]
    fn a_force_at_an_arm() {
        let rng = &mut ChaCha8Rng::seed_from_u64(1);
        for _ in 0..20 {
            let (force, arm, phi) = (random(rng), random(rng), random(rng));
            let potential = |h: f64| -force.dot(&(UnitQuaternion::from_scaled_axis(phi * h) * arm));
            let slope = -arm.cross(&force).dot(&phi);
            let curvature = (matrix(of_force(own(&force), own(&arm)).full()) * phi).dot(&phi);
            assert_order(3, |h| {
                let odd = |h: f64| potential(h) - potential(0.0) - h * slope - 0.5 * h * h * curvature;
                odd(h).abs()
            });
        }
    }

    #[test]
    fn bend_twist() {
        let rng = &mut ChaCha8Rng::seed_from_u64(2);
        for k in 0..40 {
            let measure = if k % 2 == 0 { StrainMeasure::Angle } else { StrainMeasure::Sine };
            let (q_a, mu, l) = (orientation(rng), random(rng), 0.3);
            let q_b = turned(&q_a, random(rng) * 0.8);
            let relative = |a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>| {
                let relative = a.inverse() * b;
                Quat { v: Vec3([relative.i, relative.j, relative.k]), w: relative.w }.upper()
            };
            let strain = |a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>| {
                Vector3::from(RotationRows::new(measure, relative(a, b)).1.0) / l
            };
            let (phi_a, phi_b) = (random(rng) * 0.2, random(rng) * 0.2);
            let potential = |h: f64| -mu.dot(&strain(&turned(&q_a, phi_a * h), &turned(&q_b, phi_b * h)));
            let (rows, _) = RotationRows::new(measure, relative(&q_a, &q_b));
            let t = q_a * Vector3::from(relative(&q_a, &q_b).v.0);
            let y = q_a * mu / l;
            let torque = Vector3::from(rows.forward_transposed(own(&t), own(&y)).0);
            let (alone, coupling) = of_bend_twist(rows.second(measure, own(&t), own(&y)), own(&torque));
            let (alone, coupling) = (matrix(alone.full()), matrix(coupling.full()));
            let slope = -torque.dot(&(phi_b - phi_a));
            let curvature =
                phi_a.dot(&(alone * phi_a)) + phi_b.dot(&(alone * phi_b)) + 2.0 * phi_a.dot(&(coupling * phi_b));
            assert_order(3, |h| (potential(h) - potential(0.0) - h * slope - 0.5 * h * h * curvature).abs());
        }
    }

    #[test]
    fn inertia() {
        let rng = &mut ChaCha8Rng::seed_from_u64(3);
        for _ in 0..20 {
            let moments = Matrix3::from_diagonal(&random(rng).abs().add_scalar(0.1));
            let (predicted, psi) = (orientation(rng), random(rng));
            let q = turned(&predicted, random(rng) * 0.5);
            let state = |h: f64| {
                let q = turned(&q, psi * h);
                let turn = (q * predicted.inverse()).into_inner();
                let rotation = *q.to_rotation_matrix().matrix();
                let inertia = rotation * moments * rotation.transpose();
                (inertia, turn.w.abs(), turn.imag() * (2.0 * turn.w.signum()))
            };
            let torque = |h: f64| {
                let (inertia, _, phi) = state(h);
                inertia * phi
            };
            let (inertia, s, phi) = state(0.0);
            let [x, y, z] = [0, 1, 2].map(|k| inertia[(k, k)]);
            let inertia = Sym3([x, y, z, inertia[(0, 1)], inertia[(0, 2)], inertia[(1, 2)]]);
            let slope = matrix(of_inertia(inertia, s, own(&phi)).full()) * psi;
            assert_order(3, |h| psi.dot(&((torque(h) - torque(-h)) * 0.5 - slope * h)).abs());
        }
    }
}
