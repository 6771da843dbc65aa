//! Orientations in 47 bits: the three smallest components of a quaternion, 15 bits each, and which one is left out.

use nalgebra::{Quaternion, UnitQuaternion};

/// An orientation that was packed is less than this angle [rad] from the one that was pushed.
///
/// A component is off by half a step, 1 / (2 * 16383 sqrt 2), at most; with three of them, and the fourth found from
/// them at twice their error at most, the quaternion is off by 7.5e-5, and the angle by twice that.
pub const ORIENTATION_PRECISION: f64 = 1.5e-4;

/// Code of the component 0; components of 1 / sqrt 2 are this far from it.
const MIDDLE: f64 = 16383.0;
/// The bits of a component.
const COMPONENT: u16 = 0x7fff;

/// The components but the largest, in the order x, y, z, w; the largest's index is in the first two's uppermost bits.
/// `None` where a component is not finite.
pub(crate) fn pack(orientation: &UnitQuaternion<f64>) -> Option<[u16; 3]> {
    let components: [f64; 4] = (*orientation.as_vector()).into();
    let norm = orientation.as_ref().norm();
    if !(norm.is_finite() && norm > 0.0) {
        return None;
    }
    let largest = (1..4).fold(0, |best, i| if components[i].abs() > components[best].abs() { i } else { best });
    let scale = MIDDLE * std::f64::consts::SQRT_2 * components[largest].signum() / norm;
    let mut codes = [0; 3];
    for (code, i) in codes.iter_mut().zip((0..4).filter(|&i| i != largest)) {
        *code = (components[i] * scale + MIDDLE).round() as u16 & COMPONENT;
    }
    codes[0] |= (largest as u16 & 1) << 15;
    codes[1] |= (largest as u16 >> 1) << 15;
    Some(codes)
}

/// The orientation of [`pack`]; any codes give one.
pub(crate) fn unpack(codes: [u16; 3]) -> UnitQuaternion<f64> {
    let largest = usize::from(codes[0] >> 15 | codes[1] >> 15 << 1);
    let mut components = [0.0; 4];
    let mut rest = 1.0;
    for (code, i) in codes.into_iter().zip((0..4).filter(|&i| i != largest)) {
        components[i] = (f64::from(code & COMPONENT) - MIDDLE) / (MIDDLE * std::f64::consts::SQRT_2);
        rest -= components[i] * components[i];
    }
    components[largest] = rest.max(0.0).sqrt();
    let [x, y, z, w] = components;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector4;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn orientations_come_back_to_the_stated_precision(v in prop::array::uniform4(-1.0..1.0)) {
            prop_assume!(Vector4::from(v).norm() > 1e-3);
            let q = UnitQuaternion::from_quaternion(Quaternion::from(Vector4::from(v)));
            let off = q.angle_to(&unpack(pack(&q).unwrap()));
            prop_assert!(off < ORIENTATION_PRECISION, "{q:?} is {off} rad off");
        }
    }

    #[test]
    fn no_turn_stays_exact_and_what_is_not_finite_is_refused() {
        assert_eq!(unpack(pack(&UnitQuaternion::identity()).unwrap()), UnitQuaternion::identity());
        assert_eq!(pack(&UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 1.0))), None);
        // The largest errors: all components alike.
        for signs in 0..16 {
            let v = [0, 1, 2, 3].map(|i| if signs >> i & 1 == 0 { 0.5 } else { -0.5 });
            let q = UnitQuaternion::from_quaternion(Quaternion::from(Vector4::from(v)));
            assert!(q.angle_to(&unpack(pack(&q).unwrap())) < ORIENTATION_PRECISION);
        }
    }
}
