//! How far a prediction is from a recording.

use crate::predict::Prediction;
use crate::recording::Recording;

/// Mean absolute error of a coordinate [m] over all markers and frames of the prediction; markers in the grips count, with no
/// error, those that were lost do not. The metric of Chen et al., "Differentiable Discrete Elastic Rods for Real-Time Modeling
/// of Deformable Linear Objects" (DEFORM, 2024).
pub fn mean_error(recording: &Recording, prediction: &Prediction) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for (real, predicted) in recording.markers.iter().zip(&prediction.markers) {
        count += 3 * (real.len() - predicted.len());
        for (real, predicted) in real[recording.free()].iter().zip(predicted) {
            if real.iter().all(|x| !x.is_nan()) {
                sum += (real - predicted).abs().sum();
                count += 3;
            }
        }
    }
    sum / count as f64
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn the_error_is_that_of_a_calculation_by_hand() {
        let row = |y: f64| -> Vec<_> { (0..6).map(|i| Vector3::new(f64::from(i), y, 0.0)).collect() };
        let mut recording =
            Recording { path: PathBuf::from("a"), time: vec![0.0, 0.01], markers: vec![row(0.0), row(1.0)] };
        let markers = vec![
            vec![Vector3::new(2.0, 0.0, 0.0), Vector3::new(3.0, 0.0, 0.0)],
            vec![Vector3::new(2.1, 1.2, -0.3), Vector3::new(3.0, 0.6, 0.0)],
        ];
        let prediction = Prediction { markers, unsolved: 0 };
        // (0.1 + 0.2 + 0.3) + 0.4 over two frames of six markers with three coordinates.
        assert!((mean_error(&recording, &prediction) - 1.0 / 36.0).abs() < 1e-15);
        recording.markers[1][3].x = f64::NAN;
        assert!((mean_error(&recording, &prediction) - 0.6 / 33.0).abs() < 1e-15);
    }
}
