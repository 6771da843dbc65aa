//! Numbers for a person: short, and nothing where there is nothing but rounding errors.

use cosserat::state::{Model, State};

/// Share of a run's scale below which a number is a rounding error.
const NOISE: f64 = 1e-12;

/// A number to about five digits, as text that stays short.
pub(crate) fn number(x: f64) -> String {
    let fixed = |text: String| text.trim_end_matches('0').trim_end_matches('.').to_owned();
    match x.abs() {
        0.0 => "0".to_owned(),
        0.0001..0.01 => fixed(format!("{x:.7}")),
        0.01..1e6 => fixed(format!("{x:.4}")),
        _ => format!("{x:.4e}"),
    }
}

/// A relative error to two digits: 0 where rounding errors are as large, a power of ten where it is small.
pub(crate) fn share(x: f64) -> String {
    match x.abs() {
        0.0..1e-14 => "0".to_owned(),
        0.01..0.1 => format!("{x:.3}"),
        0.1..1.0 => format!("{x:.2}"),
        1.0..1000.0 => format!("{x:.1}"),
        _ => format!("{x:.1e}"),
    }
}

/// The number, or 0 where it is a rounding error of numbers of this `scale`.
pub(crate) fn unless_noise(x: f64, scale: f64) -> f64 {
    if x.abs() < NOISE * scale { 0.0 } else { x }
}

/// An energy that a scene may well have [J]: its weight lifted by its length, or its rods bent by a radian.
pub(crate) fn energy_scale(model: &Model, state: &State) -> f64 {
    let length: f64 = model.segments.iter().map(|segment| segment.length).sum();
    let mass: f64 = model.segments.iter().map(|segment| segment.mass()).sum();
    let stiffness: f64 = model.joints.iter().map(|joint| joint.bend_compliance.recip()).filter(|x| x.is_finite()).sum();
    let moving: f64 = model.segments.iter().zip(&state.velocities).map(|(s, v)| s.mass() * v.norm_squared()).sum();
    let scales = [mass * model.gravity.norm() * length, stiffness / length.powi(2), moving];
    scales.into_iter().filter(|scale| scale.is_finite()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_noise_is_nothing() {
        for (x, text) in [
            (0.0, "0"),
            (2.0, "2"),
            (0.30000000000000004, "0.3"),
            (-12.34567, "-12.3457"),
            (0.00123456, "0.0012346"),
            (1e-5, "1.0000e-5"),
            (100.0, "100"),
            (2e6, "2.0000e6"),
        ] {
            assert_eq!(number(x), text);
        }
        for (x, text) in
            [(3e-16, "0"), (3.14e-9, "3.1e-9"), (0.0123, "0.012"), (0.456, "0.46"), (1.7, "1.7"), (5.5e44, "5.5e44")]
        {
            assert_eq!(share(x), text);
        }
        assert_eq!(unless_noise(2.8e-20, 1e-3), 0.0);
        assert_eq!(unless_noise(2.8e-14, 1e-3), 2.8e-14);
    }
}
