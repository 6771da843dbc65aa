//! The discrete Darboux vector of two neighbouring segments.

use nalgebra::{UnitQuaternion, Vector3};

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
    fn opposite_quaternions_are_the_same_rotation() {
        let q_a = UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0);
        let q_b = q_a * rotation_of(&Vector3::new(1.0, 2.0, 3.0), 0.1);
        let flipped = UnitQuaternion::new_unchecked(-q_b.into_inner());
        assert_eq!(darboux(&q_a, &q_b, 0.1), darboux(&q_a, &flipped, 0.1));
    }
}
