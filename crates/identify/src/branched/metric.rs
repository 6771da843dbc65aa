//! How far predictions of a cable with branches are from a recording.

use nalgebra::Vector3;

use super::Tree;
use crate::predict::Prediction;
use crate::recording::Recording;

/// Errors of a coordinate [m], over all frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// Mean absolute error over all markers; those in the grips count, with no error, those that were lost do not:
    /// [`mean_error`](crate::metric::mean_error)'s metric.
    pub mean: f64,
    /// The same over the markers of each rod: the parent, then the branches.
    pub rods: Vec<f64>,
    /// Root of the mean square over all markers.
    pub root_mean_square: f64,
}

impl Errors {
    /// Those of a prediction.
    pub fn of(recording: &Recording, tree: &Tree, prediction: &Prediction) -> Self {
        let rods: Vec<_> = tree.rods().collect();
        let mut sums = vec![(0.0, 0usize); rods.len()];
        let mut squares = 0.0;
        for (real, predicted) in recording.markers.iter().zip(&prediction.markers) {
            // In the grips there is no error.
            let mut all = real.clone();
            tree.free().zip(predicted).for_each(|(marker, &predicted)| all[marker] = predicted);
            for (rod, (sum, count)) in rods.iter().zip(&mut sums) {
                for marker in rod.clone() {
                    let off: Vector3<f64> = all[marker] - real[marker];
                    if !real[marker].iter().any(|x| x.is_nan()) {
                        *sum += off.abs().sum();
                        *count += 3;
                        squares += off.norm_squared();
                    }
                }
            }
        }
        let (sum, count) = sums.iter().fold((0.0, 0), |(sum, count), of| (sum + of.0, count + of.1));
        Self {
            mean: sum / count as f64,
            rods: sums.iter().map(|(sum, count)| sum / *count as f64).collect(),
            root_mean_square: (squares / count as f64).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::Branch;
    use super::*;

    #[test]
    fn the_errors_are_those_of_a_calculation_by_hand() {
        let tree = Tree { parent: 5, branches: vec![Branch { junction: 2, markers: 5..7 }] };
        let row = |z: f64| -> Vec<_> { (0..7).map(|i| Vector3::new(f64::from(i), 0.0, z)).collect() };
        let mut recording =
            Recording { path: PathBuf::from("a"), time: vec![0.0, 0.01], markers: vec![row(0.0), row(1.0)] };
        let markers = vec![
            [2.0, 5.0, 6.0].map(|x| Vector3::new(x, 0.0, 0.0)).to_vec(),
            vec![Vector3::new(2.3, 0.0, 0.6), Vector3::new(5.0, 0.2, 1.0), Vector3::new(6.0, 0.0, 1.1)],
        ];
        let prediction = Prediction { markers, unsolved: 0 };
        let errors = Errors::of(&recording, &tree, &prediction);
        // 0.3 + 0.4 over two frames of five markers with three coordinates; 0.2 + 0.1 over those of two.
        for (found, expected) in [
            (errors.rods[0], 0.7 / 30.0),
            (errors.rods[1], 0.3 / 12.0),
            (errors.mean, 1.0 / 42.0),
            (errors.root_mean_square, ((0.09 + 0.16 + 0.04 + 0.01) / 42.0f64).sqrt()),
        ] {
            assert!((found - expected).abs() < 1e-15, "{found} {expected}");
        }
        recording.markers[1][6].y = f64::NAN;
        assert!((Errors::of(&recording, &tree, &prediction).rods[1] - 0.2 / 9.0).abs() < 1e-15);
    }
}
