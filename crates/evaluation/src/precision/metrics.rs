//! How far one motion is from another.

use cosserat::state::measure::rod_lengths;
use cosserat::state::{Model, State};
use nalgebra::Vector3;

/// Mean length of the rods [m]: what errors are relative to.
pub fn mean_length(model: &Model) -> f64 {
    let rods = model.segments.iter().map(|s| s.rod).max().map_or(1, |last| last + 1);
    model.segments.iter().map(|s| s.length).sum::<f64>() / rods as f64
}

/// Root mean square distance of the segments' centres [m] at one time, relative to the mean length of the rods.
///
/// The normalised error (NRMSE) of the paper's supplement is this one, too: it does not say by what it is normalised.
pub fn position_error(model: &Model, a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(x, y)| (x - y).norm_squared()).sum();
    (sum / a.len().max(1) as f64).sqrt() / mean_length(model)
}

/// Length of all rods together relative to that in `first`: l / l0 of the paper's figure on stability, 1 where nothing
/// is stretched. See [`rod_lengths`] for what is measured.
pub fn length_ratio(model: &Model, state: &State, first: &State) -> f64 {
    let length = |state| rod_lengths(model, state).iter().sum::<f64>();
    length(state) / length(first)
}

#[cfg(test)]
mod tests {
    use cosserat::assembly::{Assembly, Material, RodSpec, shape};

    use super::*;

    /// Two rods, 2 m and 4 m long, of two segments each, along x.
    fn two_rods() -> (Model, State) {
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let mut assembly = Assembly::new(Vector3::zeros());
        for (y, length) in [(0.0, 2.0), (1.0, 4.0)] {
            let nodes = shape::straight(Vector3::y() * y, Vector3::x(), length, 2);
            assembly.rod(&RodSpec::new(nodes, 0.05, material));
        }
        assembly.finish()
    }

    #[test]
    fn a_shift_is_its_length_over_the_mean_length() {
        let (model, state) = two_rods();
        let shifted: Vec<_> = state.positions.iter().map(|x| x + Vector3::new(0.2, -0.1, 0.2)).collect();
        assert!((position_error(&model, &shifted, &state.positions) - 0.3 / 3.0).abs() < 1e-15);
        assert_eq!(position_error(&model, &state.positions, &state.positions), 0.0);
        let mut one = state.positions.clone();
        one[3].z += 0.6;
        assert!((position_error(&model, &one, &state.positions) - 0.3 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn gaps_along_a_rod_make_it_longer() {
        let (model, first) = two_rods();
        assert_eq!(length_ratio(&model, &first, &first), 1.0);
        let mut state = first.clone();
        state.positions[1].x += 0.5;
        state.positions[3].x -= 0.2;
        assert!((length_ratio(&model, &state, &first) - 6.3 / 6.0).abs() < 1e-14);
    }
}
