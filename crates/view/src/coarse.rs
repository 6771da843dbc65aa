//! Numbers to three digits in 16 bits, with the exponents of `f32`: what is recorded before its range is known.

/// Not a number: nothing is known.
pub(crate) const UNKNOWN: u16 = 0x7fc0;
/// All bits but the sign.
pub(crate) const MAGNITUDE: u16 = 0x7fff;
const INFINITE: u16 = 0x7f80;

/// The upper half of the nearest `f32` (to 1 in 256), or [`UNKNOWN`] for what is not finite in `f32`.
pub(crate) fn pack(value: f64) -> u16 {
    let single = value as f32;
    if !single.is_finite() {
        return UNKNOWN;
    }
    let rounded = ((single.to_bits() + 0x8000) >> 16) as u16;
    if rounded & MAGNITUDE >= INFINITE { UNKNOWN } else { rounded }
}

/// The number, or `None` where nothing is known.
pub(crate) fn unpack(code: u16) -> Option<f64> {
    is_known(code).then(|| f64::from(f32::from_bits(u32::from(code) << 16)))
}

/// Whether the code stands for a number.
pub(crate) fn is_known(code: u16) -> bool {
    code & MAGNITUDE < INFINITE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_are_kept_and_what_is_not_finite_is_unknown() {
        for value in [0.0, 1.0, -3.7e-12, 6.02e23, -1.0 / 3.0] {
            let back = unpack(pack(value)).unwrap();
            assert!((back - value).abs() <= value.abs() / 256.0, "{value}: {back}");
        }
        for value in [f64::NAN, f64::INFINITY, -1e300, f64::from(f32::MAX)] {
            assert_eq!(unpack(pack(value)), None, "{value}");
        }
    }
}
