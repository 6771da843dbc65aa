//! How the bend-twist rows of a joint measure the rotation between its bodies, with first and second derivatives.
//!
//! With the relative rotation `(w, v) = conj(q_a) q_b`, theta its angle and n its axis, the rows measure `theta n` or `2 v = 2 sin(theta / 2) n`
//! ([`StrainMeasure`]), over the joint's length. Derivatives of the first are those of the exponential map of rotations (Simo and Vu-Quoc, "A
//! three-dimensional finite-strain rod model. Part II", 1986). With `t = R_a v` and as the bodies turn by phi in world axes,
//!
//! ```text
//! d(l C) = R_a^T F (dphi_b - dphi_a)      F = N^-1 = p' I - q' [t]x + r' t t^T      N = p I + q [t]x + r t t^T
//! ```
//!
//! where, h being `(theta / 2) / sin(theta / 2)`,
//!
//! ```text
//!               p      q     r               p'     q'    r'
//! angle:        w / h  1/h   (1 - w/h)/v^2   h w    h     (1 - h w)/v^2
//! sine:         w      1     1 / w           w      1     0
//! ```
//!
//! It knows one rotation at a time: no bodies, no compliances.

use std::f64::consts::FRAC_PI_2;

use kernels::lane::{Both, Real};
use kernels::math::{Quat, Sym3, Vec3};
use rod::StrainMeasure;

/// Squared sine of half the angle up to which the factors are series: 11.5 degrees.
const SERIES: f64 = 0.01;

/// The factors of N and F of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationRows<T> {
    /// p, q, r of N.
    inverse: [T; 3],
    /// p', q', r' of F.
    forward: [T; 3],
    /// k of `N N^T = q^2 I + k t t^T`.
    square: T,
}

impl<T: Real> RotationRows<T> {
    /// Of no rotation.
    pub fn identity() -> Self {
        let [zero, one] = [0.0, 1.0].map(T::splat);
        Self { inverse: [one, one, zero], forward: [one, one, zero], square: zero }
    }

    /// Of a relative rotation whose scalar part is not negative, with what is measured of it, `l C` before what it is at rest is taken off.
    #[inline(always)]
    pub fn new(measure: StrainMeasure, relative: Quat<T>) -> (Self, Vec3<T>) {
        match measure {
            StrainMeasure::Angle => Self::of_angle(relative),
            StrainMeasure::Sine => Self::of_sine(relative),
        }
    }

    #[inline(always)]
    fn of_sine(Quat { w, v }: Quat<T>) -> (Self, Vec3<T>) {
        let [zero, one, two] = [0.0, 1.0, 2.0].map(T::splat);
        // Away from a half turn, where F loses a direction; what is measured stays exact.
        let s = w.max(T::splat(1e-6));
        let inv_s = one / s;
        (Self { inverse: [s, one, inv_s], forward: [s, one, zero], square: inv_s * inv_s }, v * two)
    }

    #[inline(always)]
    fn of_angle(relative: Quat<T>) -> (Self, Vec3<T>) {
        let Quat { w, v } = relative;
        let [one, two, four] = [1.0, 2.0, 4.0].map(T::splat);
        let x = v.norm_squared();
        let mut h = polynomial(x, &ARC_SINE);
        let twice = h * h * four;
        let y = twice * x;
        let kappa = polynomial(y, &COTANGENT);
        let (mut along, mut back) = (twice * kappa, twice * polynomial(y, &SINE));
        let mut cosine = one - kappa * y;
        if (0..T::LANES).any(|lane| x.lane(lane) > SERIES) {
            let is_small = T::splat(SERIES) - x;
            let [of_h, of_cosine, of_along, of_back] = Self::wide(relative);
            h = is_small.select(h, of_h);
            cosine = is_small.select(cosine, of_cosine);
            along = is_small.select(along, of_along);
            back = is_small.select(back, of_back);
        }
        let q = one / h;
        let p = w * q;
        let square = two * p * back + back * back * x - q * q;
        (Self { inverse: [p, q, back], forward: [cosine, h, along], square }, v * (two * h))
    }

    /// h, p', r' and r of angles that are not small.
    #[inline(never)]
    fn wide(Quat { w, v }: Quat<T>) -> [T; 4] {
        let one = T::splat(1.0);
        let x = v.norm_squared().max(T::splat(SERIES));
        let w = -(-w).max(T::splat(-(1.0 - SERIES).sqrt()));
        // An inverse sine is exact up to a right angle's half.
        let (sine, is_flat) = (x.sqrt(), T::splat(0.5) - x);
        let acute = is_flat.select(sine, T::zero()).asin();
        let half_angle = is_flat.select(acute, T::splat(FRAC_PI_2) - w.asin());
        let h = half_angle / sine;
        let cosine = h * w;
        [h, cosine, (one - cosine) / x, (one - w / h) / x]
    }

    /// `N x`.
    #[inline(always)]
    pub fn inverse(&self, t: Vec3<T>, x: Vec3<T>) -> Vec3<T> {
        let [p, q, r] = self.inverse;
        x * p + t.cross(x) * q + t * (t.dot(x) * r)
    }

    /// `N^T x`.
    #[inline(always)]
    pub fn inverse_transposed(&self, t: Vec3<T>, x: Vec3<T>) -> Vec3<T> {
        let [p, q, r] = self.inverse;
        x * p - t.cross(x) * q + t * (t.dot(x) * r)
    }

    /// `F x`.
    #[inline(always)]
    pub fn forward(&self, t: Vec3<T>, x: Vec3<T>) -> Vec3<T> {
        let [p, q, r] = self.forward;
        x * p - t.cross(x) * q + t * (t.dot(x) * r)
    }

    /// `F^T x`.
    #[inline(always)]
    pub fn forward_transposed(&self, t: Vec3<T>, x: Vec3<T>) -> Vec3<T> {
        let [p, q, r] = self.forward;
        x * p + t.cross(x) * q + t * (t.dot(x) * r)
    }

    /// `N N^T` as factors of the identity and of `t t^T`.
    #[inline(always)]
    pub(crate) fn squared(&self) -> [T; 2] {
        let [_, q, _] = self.inverse;
        [q * q, self.square]
    }

    /// The symmetric matrix A of `m . l C = const + m . F w + w . A w / 2 + O(w^3)` for a constant m, the relative rotation being turned by the
    /// rotation vector w; m, w, t in the same axes.
    ///
    /// `F^T m` itself changes by `A w + w x (F^T m) / 2`.
    #[inline(always)]
    pub fn second(&self, measure: StrainMeasure, t: Vec3<T>, m: Vec3<T>) -> Sym3<T> {
        let along = t.dot(m);
        if measure == StrainMeasure::Sine {
            return Sym3::identity(along * T::splat(-0.5));
        }
        let [two, four] = [2.0, 4.0].map(T::splat);
        let [cosine, h, of_t] = self.forward;
        let x = t.norm_squared();
        let squared = h * h;
        let y = four * squared * x;
        // F = I - [theta]x / 2 + kappa (theta theta^T - theta^2 I), and the slope of kappa by y = theta^2.
        let kappa = of_t / (four * squared);
        let wide = T::splat(4.0 * SERIES).max(y);
        let slope = (T::splat(SERIES) - x)
            .select(polynomial(y, &COTANGENT_SLOPE), ((squared - cosine) / (two * wide) - kappa) / wide);
        let quarter = T::splat(0.25);
        let of_identity = two * h * (kappa * cosine - quarter);
        let of_both = T::splat(16.0) * squared * h * (kappa * kappa + slope);
        let of_m = two * h * (quarter + kappa * cosine - two * kappa - two * slope * y);
        let across = m * of_m + t.cross(m) * of_t;
        Sym3::identity(along * of_identity) + Sym3::outer(t, along * of_both) + Sym3::sym_outer(t, across)
    }

    /// Two side by side.
    #[inline(always)]
    pub(crate) fn both(a: &Self, b: &Self) -> RotationRows<Both<T>> {
        RotationRows {
            inverse: Both::zip(a.inverse, b.inverse),
            forward: Both::zip(a.forward, b.forward),
            square: Both([a.square, b.square]),
        }
    }
}

/// `asin(s) / s` of the square of s.
const ARC_SINE: [f64; 8] =
    [1.0, 1.0 / 6.0, 3.0 / 40.0, 5.0 / 112.0, 35.0 / 1152.0, 63.0 / 2816.0, 231.0 / 13312.0, 143.0 / 10240.0];
/// `(1 - (theta / 2) cot(theta / 2)) / theta^2` of the square of theta.
const COTANGENT: [f64; 5] = [1.0 / 12.0, 1.0 / 720.0, 1.0 / 30240.0, 1.0 / 1_209_600.0, 1.0 / 47_900_160.0];
/// Its derivative.
const COTANGENT_SLOPE: [f64; 5] =
    [1.0 / 720.0, 2.0 / 30240.0, 3.0 / 1_209_600.0, 4.0 / 47_900_160.0, 5.0 * 691.0 / 1_307_674_368_000.0];
/// `(1 - sin(theta) / theta) / theta^2` of the square of theta.
const SINE: [f64; 5] = [1.0 / 6.0, -1.0 / 120.0, 1.0 / 5040.0, -1.0 / 362_880.0, 1.0 / 39_916_800.0];

#[inline(always)]
fn polynomial<T: Real, const N: usize>(x: T, factors: &[f64; N]) -> T {
    let mut out = T::splat(factors[N - 1]);
    for k in (0..N - 1).rev() {
        out = out * x + T::splat(factors[k]);
    }
    out
}

#[cfg(test)]
mod tests {
    use kernels::dual::Dual;
    use kernels::lane::Lanes;
    use nalgebra::{Matrix3, UnitQuaternion, Vector3};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    const MEASURES: [StrainMeasure; 2] = [StrainMeasure::Angle, StrainMeasure::Sine];

    fn own(x: Vector3<f64>) -> Vec3<f64> {
        Vec3(x.into())
    }

    fn vector(x: Vec3<f64>) -> Vector3<f64> {
        x.0.into()
    }

    fn quat(q: &UnitQuaternion<f64>) -> Quat<f64> {
        Quat { v: Vec3([q.i, q.j, q.k]), w: q.w }.upper()
    }

    fn measured(measure: StrainMeasure, theta: &UnitQuaternion<f64>) -> Vector3<f64> {
        vector(RotationRows::new(measure, quat(theta)).1)
    }

    /// Rotation vectors of all sizes up to nearly half a turn.
    fn rotations() -> impl Iterator<Item = (UnitQuaternion<f64>, Vector3<f64>, Vector3<f64>)> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let angles = [0.0, 1e-9, 1e-4, 0.1, 0.2, 0.2005, 0.3, 1.0, 1.57, 2.5, 3.0];
        (0..110).map(move |k| {
            let mut vector = || Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
            let theta = vector().normalize() * angles[k % angles.len()];
            (UnitQuaternion::from_scaled_axis(theta), vector(), vector())
        })
    }

    #[test]
    fn the_angle_is_the_rotation_vector() {
        for (theta, ..) in rotations() {
            let found = measured(StrainMeasure::Angle, &theta);
            assert!((found - theta.scaled_axis()).norm() < 1e-13, "{}: {found}", theta.angle());
        }
    }

    #[test]
    fn factors_are_of_the_derivative_and_of_its_inverse() {
        for measure in MEASURES {
            for (theta, w, _) in rotations() {
                let (rows, _) = RotationRows::new(measure, quat(&theta));
                let t = quat(&theta).v;
                let at = |h: f64| measured(measure, &(UnitQuaternion::from_scaled_axis(w * h) * theta));
                let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
                let found = vector(rows.forward(t, own(w)));
                assert!((found - slope).norm() < 1e-8, "{measure:?}, {}: {found} for {slope}", theta.angle());
                for back in
                    [rows.inverse(t, own(found)), rows.inverse_transposed(t, rows.forward_transposed(t, own(w)))]
                {
                    assert!((vector(back) - w).norm() < 1e-12, "{measure:?}, {}", theta.angle());
                }
                let square = Matrix3::from_columns(
                    &[Vector3::x(), Vector3::y(), Vector3::z()]
                        .map(|e| vector(rows.inverse(t, rows.inverse_transposed(t, own(e))))),
                );
                let [of_identity, of_t] = rows.squared();
                let found = Matrix3::identity() * of_identity + vector(t) * vector(t).transpose() * of_t;
                assert!((found - square).norm() < 1e-10 * square.norm(), "{measure:?}, {}", theta.angle());
            }
        }
    }

    #[test]
    fn second_derivatives() {
        for measure in MEASURES {
            for (theta, w, m) in rotations().filter(|(theta, ..)| theta.angle() < 2.9) {
                let (rows, _) = RotationRows::new(measure, quat(&theta));
                let t = quat(&theta).v;
                let turned = |h: f64| UnitQuaternion::from_scaled_axis(w * h) * theta;
                let at = |h: f64| m.dot(&measured(measure, &turned(h)));
                let curvature = (at(1e-3) - 2.0 * at(0.0) + at(-1e-3)) / 1e-6;
                let a = rows.second(measure, t, own(m));
                let found = w.dot(&vector(a.apply(own(w))));
                assert!((found - curvature).abs() < 1e-5, "{measure:?}, {}: {found} for {curvature}", theta.angle());
                let torque = |h: f64| {
                    let turned = quat(&turned(h));
                    vector(RotationRows::new(measure, turned).0.forward_transposed(turned.v, own(m)))
                };
                let slope = (torque(1e-5) - torque(-1e-5)) / 2e-5;
                let found = vector(a.apply(own(w))) + w.cross(&torque(0.0)) * 0.5;
                assert!((found - slope).norm() < 1e-7, "{measure:?}, {}: {found} for {slope}", theta.angle());
            }
        }
    }

    /// Dual numbers go through the same branches, to rounding: of what is measured, and of the torque of a multiplier.
    #[test]
    fn dual_numbers_agree() {
        let dual = |x: f64, slope: f64| {
            let mut out = Dual::<1>::splat(x);
            out.slope[0] = slope;
            out
        };
        for measure in MEASURES {
            for (theta, w, m) in rotations() {
                let q = quat(&theta);
                let (own_w, own_m) = (own(w), own(m));
                let turn = (q.v.cross(own_w) * -0.5 + own_w * (0.5 * q.w), -0.5 * q.v.dot(own_w));
                let turned = Quat { v: Vec3([0, 1, 2].map(|k| dual(q.v.0[k], turn.0.0[k]))), w: dual(q.w, turn.1) };
                let (rows, found) = RotationRows::new(measure, turned);
                let (plain, _) = RotationRows::new(measure, q);
                let expected = plain.forward(q.v, own_w);
                let slopes = Vec3(found.0.map(|x| x.slope[0]));
                assert!(vector(slopes - expected).norm() < 1e-12, "{measure:?}, {}", theta.angle());
                let torque = rows.forward_transposed(turned.v, Vec3::splat(own_m));
                let slopes = Vec3(torque.0.map(|x| x.slope[0]));
                let second = plain.second(measure, q.v, own_m);
                let expected = second.apply(own_w) + own_w.cross(plain.forward_transposed(q.v, own_m)) * 0.5;
                let error = vector(slopes - expected).norm();
                assert!(error < 1e-10, "{measure:?}, {}: {error}", theta.angle());
            }
        }
    }

    #[test]
    fn lanes_do_not_mix() {
        let alone = |angle: f64| {
            RotationRows::new(StrainMeasure::Angle, quat(&UnitQuaternion::from_scaled_axis(Vector3::x() * angle)))
        };
        let (mut q, angles) = (Quat::<Lanes<4>>::identity(), [0.01, 2.0, 0.1, 0.3]);
        for (lane, angle) in angles.into_iter().enumerate() {
            let Quat { v, w } = quat(&UnitQuaternion::from_scaled_axis(Vector3::x() * angle));
            (0..3).for_each(|k| q.v.0[k].set_lane(lane, v.0[k]));
            q.w.set_lane(lane, w);
        }
        let (rows, found) = RotationRows::new(StrainMeasure::Angle, q);
        for (lane, angle) in angles.into_iter().enumerate() {
            let (own, vector) = alone(angle);
            assert_eq!(found.0[0].lane(lane), vector.0[0]);
            assert_eq!(rows.inverse.map(|x| x.lane(lane)), own.inverse);
            assert_eq!(rows.forward.map(|x| x.lane(lane)), own.forward);
        }
    }
}
