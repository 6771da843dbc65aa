//! The discrete Darboux vector of two neighbouring segments, and the strain measures of joints.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// What of the relative rotation of a joint's bodies, by an angle theta about an axis n, its moment goes with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StrainMeasure {
    /// The rotation vector `theta n`: a joint that is bent or twisted about one axis answers with its stiffness times the angle, up to half a turn.
    #[default]
    Angle,
    /// `2 sin(theta / 2) n`, the paper's (the Darboux vector, Kugelstadt et al. 2018): the moment goes with the sine of the angle.
    Sine,
}

impl StrainMeasure {
    /// What it measures of conj(q_a) q_b, over the joint's `length` [m]: strain before its rest value is taken off [1/m], in the frame of a.
    #[inline]
    pub fn strain(self, q_a: &UnitQuaternion<f64>, q_b: &UnitQuaternion<f64>, length: f64) -> Vector3<f64> {
        let (s, u) = relative_rotation(q_a, q_b);
        let sine = u * (2.0 / length);
        match (self, u.norm()) {
            (Self::Sine, _) => sine,
            (Self::Angle, norm) if norm > 0.03 => sine * (norm.atan2(s) / norm),
            (Self::Angle, _) => sine * arc(&u)[0],
        }
    }

    /// The strain at rest [1/m] of a joint of this `length` [m] whose Darboux vector there is `rest` [1/m].
    #[inline]
    pub fn at_rest(self, rest: &Vector3<f64>, length: f64) -> Vector3<f64> {
        match self {
            Self::Sine => *rest,
            Self::Angle => rest * arc(&(rest * (0.5 * length)))[0],
        }
    }

    /// The derivative of [`StrainMeasure::at_rest`] by the Darboux vector; symmetric.
    pub fn slope_at_rest(self, rest: &Vector3<f64>, length: f64) -> Matrix3<f64> {
        let v = rest * (0.5 * length);
        match self {
            Self::Sine => Matrix3::identity(),
            Self::Angle => {
                let [h, slope] = arc(&v);
                Matrix3::from_diagonal_element(h) + v * v.transpose() * (2.0 * slope)
            }
        }
    }

    /// The Darboux vector at rest [1/m] of which [`StrainMeasure::at_rest`] is `strain` [1/m]. Strains of more than half a turn have none: the vector is 2 / length
    /// long or longer.
    pub fn darboux_of(self, strain: &Vector3<f64>, length: f64) -> Vector3<f64> {
        let half = 0.5 * strain.norm() * length;
        match self {
            Self::Angle if half > 0.0 && half < 0.5 * std::f64::consts::PI => strain * (half.sin() / half),
            _ => *strain,
        }
    }

    /// `F^T m`: the torque on body b, in the frame of a and times the joint's length, of a multiplier m that goes with the strain, where conj(q_a) q_b is
    /// `(s, u)`.
    pub(crate) fn torque(self, (s, u): (f64, Vector3<f64>), m: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Sine => m * s + u.cross(m),
            Self::Angle => {
                let [h, _] = arc(&u);
                m * (h * s) + u.cross(m) * h + u * (u.dot(m) * cotangent(s, &u))
            }
        }
    }

    /// The multiplier, in the frame of a and over the joint's length, whose torque on body b is this one [N m], where conj(q_a) q_b is `(s, u)`.
    pub fn multiplier(self, (s, u): (f64, Vector3<f64>), torque: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Sine => torque * s - u.cross(torque) + u * (u.dot(torque) / s),
            Self::Angle => {
                // N^T with h N = s I + [u]x + (h - s) n n^T.
                let [h, _] = arc(&u);
                let x = u.norm_squared();
                let along = if x > 0.0 { u * (u.dot(torque) * (h - s) / x) } else { Vector3::zeros() };
                (torque * s - u.cross(torque) + along) / h
            }
        }
    }
}

/// `h = asin(|v|) / |v|` and its derivative by `|v|^2`, of a vector that is no longer than 1.
fn arc(v: &Vector3<f64>) -> [f64; 2] {
    let x = v.norm_squared().min(1.0);
    if x < 1e-3 {
        let h = 1.0 + x * (1.0 / 6.0 + x * (3.0 / 40.0 + x * (5.0 / 112.0 + x * (35.0 / 1152.0 + x * 63.0 / 2816.0))));
        let slope = 1.0 / 6.0 + x * (3.0 / 20.0 + x * (15.0 / 112.0 + x * (35.0 / 288.0 + x * 315.0 / 2816.0)));
        return [h, slope];
    }
    let root = x.sqrt();
    let h = root.atan2((1.0 - x).sqrt()) / root;
    [h, (1.0 / (1.0 - x).max(1e-12).sqrt() - h) / (2.0 * x)]
}

/// `(1 - h s) / |u|^2`.
fn cotangent(s: f64, u: &Vector3<f64>) -> f64 {
    let x = u.norm_squared();
    if x < 1e-3 {
        return 1.0 / 3.0 + x * (2.0 / 15.0 + x * (8.0 / 105.0 + x * (16.0 / 315.0 + x * 128.0 / 3465.0)));
    }
    (1.0 - arc(u)[0] * s) / x
}

/// Scalar and vector part of conj(q_a) q_b, flipped to a scalar part >= 0 so that the shorter rotation counts.
#[inline]
pub fn relative_rotation(q_a: &UnitQuaternion<f64>, q_b: &UnitQuaternion<f64>) -> (f64, Vector3<f64>) {
    let relative = q_a.conjugate().into_inner() * q_b.into_inner();
    let sign = if relative.w < 0.0 { -1.0 } else { 1.0 };
    (sign * relative.w, sign * relative.imag())
}

/// Darboux vector Omega = (2 / l) Im(conj(q_a) q_b) [1/m] in the frame of segment a; `length` l [m] is the joint's.
///
/// Its first two components are the curvatures about d1 and d2, the third is the twist (Kugelstadt et al. 2018).
#[inline]
pub fn darboux(q_a: &UnitQuaternion<f64>, q_b: &UnitQuaternion<f64>, length: f64) -> Vector3<f64> {
    relative_rotation(q_a, q_b).1 * (2.0 / length)
}

/// The relative rotation conj(q_a) q_b whose Darboux vector over `length` [m] is `omega` [1/m].
///
/// Vectors longer than 2 / length, which no relative rotation reaches, give a half turn about their direction.
pub fn rotation_of(omega: &Vector3<f64>, length: f64) -> UnitQuaternion<f64> {
    let imag = omega * (0.5 * length);
    let norm = imag.norm();
    if norm >= 1.0 {
        return UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_imag(imag / norm));
    }
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_parts((1.0 - norm * norm).sqrt(), imag))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn darboux_and_its_inverse_agree() {
        let q_a = UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0);
        let omega = Vector3::new(3.0, -1.0, 0.5);
        let q_b = q_a * rotation_of(&omega, 0.2);
        assert!((darboux(&q_a, &q_b, 0.2) - omega).norm() < 1e-12);
    }

    #[test]
    fn the_angle_is_measured_as_it_is_and_strains_at_rest_have_their_darboux_vectors() {
        let (axis, length) = (Vector3::new(0.6, 0.0, 0.8), 0.2);
        for angle in [0.0, 1e-6, 0.05, 0.07, 0.5, 2.0, 3.1] {
            let measure = StrainMeasure::Angle;
            let (q_a, turn) = (UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0), axis * angle);
            let q_b = q_a * UnitQuaternion::from_scaled_axis(turn);
            assert!((measure.strain(&q_a, &q_b, length) * length - turn).norm() < 1e-12, "{angle}");
            let rest = darboux(&q_a, &q_b, length);
            assert!((measure.at_rest(&rest, length) * length - turn).norm() < 1e-12, "{angle}");
            assert!((measure.darboux_of(&(turn / length), length) - rest).norm() < 1e-12, "{angle}");
            let by = Vector3::new(-0.5, 0.3, 0.7);
            let at = |h: f64| measure.at_rest(&(rest + by * h), length);
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            let found = measure.slope_at_rest(&rest, length) * by;
            assert!((found - slope).norm() < 1e-6 * slope.norm(), "{angle}: {found} for {slope}");
        }
    }

    #[test]
    fn a_multiplier_does_the_work_of_its_torque() {
        let (q_a, m) = (UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0), Vector3::new(1.0, -2.0, 0.5));
        for measure in [StrainMeasure::Angle, StrainMeasure::Sine] {
            for angle in [0.0, 1e-4, 0.06, 0.07, 1.0, 2.8] {
                let q_b = q_a * UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.6, -0.8) * angle);
                let relative = relative_rotation(&q_a, &q_b);
                let torque = measure.torque(relative, &m);
                let turn = Vector3::new(0.2, 0.7, -0.4);
                let at = |h: f64| {
                    m.dot(&measure.strain(
                        &q_a,
                        &(q_a * UnitQuaternion::from_scaled_axis(turn * h) * (q_a.inverse() * q_b)),
                        1.0,
                    ))
                };
                let work = (at(1e-5) - at(-1e-5)) / 2e-5;
                assert!((torque.dot(&turn) - work).abs() < 1e-8, "{measure:?} {angle}");
                assert!((measure.multiplier(relative, &torque) - m).norm() < 1e-12, "{measure:?} {angle}");
            }
        }
    }

    #[test]
    fn opposite_quaternions_are_the_same_rotation() {
        let q_a = UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0);
        let q_b = q_a * rotation_of(&Vector3::new(1.0, 2.0, 3.0), 0.1);
        let flipped = UnitQuaternion::new_unchecked(-q_b.into_inner());
        assert_eq!(darboux(&q_a, &q_b, 0.1), darboux(&q_a, &flipped, 0.1));
    }
}
