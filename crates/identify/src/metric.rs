//! How far a prediction is from a recording.

use nalgebra::Vector3;

use crate::predict::Prediction;
use crate::recording::Recording;

/// Mean absolute error of a coordinate [m] over all markers and frames of the prediction; markers in the grips count, with no
/// error, those that were lost do not. The metric of Chen et al., "Differentiable Discrete Elastic Rods for Real-Time Modeling
/// of Deformable Linear Objects" (DEFORM, 2024).
pub fn mean_error(recording: &Recording, prediction: &Prediction) -> f64 {
    let free: Vec<usize> = recording.free().collect();
    Errors::of(recording, &free, prediction).mean(0..recording.count())
}

/// By how much two predictions of a recording differ: the mean absolute error of a coordinate [m] that one would have, were the other
/// the recording.
pub fn mean_change(recording: &Recording, free: &[usize], [one, other]: [&Prediction; 2]) -> f64 {
    let mut as_recorded = recording.clone();
    for (markers, predicted) in as_recorded.markers.iter_mut().zip(&one.markers) {
        free.iter().zip(predicted).for_each(|(&marker, &predicted)| markers[marker] = predicted);
    }
    Errors::of(&as_recorded, free, other).mean(0..recording.count())
}

/// Sums of what a prediction is off at each marker of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// Of each marker: the sum of absolute errors of its coordinates [m], that of their squares [m^2], and how many there are.
    sums: Vec<(f64, f64, usize)>,
}

impl Errors {
    /// Those of a prediction, which has the markers `free` of the recording; the others are given, and have no error.
    pub fn of(recording: &Recording, free: &[usize], prediction: &Prediction) -> Self {
        let mut sums = vec![(0.0, 0.0, 0); recording.count()];
        let mut all: Vec<Vector3<f64>> = Vec::new();
        for (real, predicted) in recording.markers.iter().zip(&prediction.markers) {
            all.clone_from(real);
            free.iter().zip(predicted).for_each(|(&marker, &predicted)| all[marker] = predicted);
            for ((sum, real), here) in sums.iter_mut().zip(real).zip(&all) {
                let off: Vector3<f64> = here - real;
                if real.iter().all(|x| !x.is_nan()) {
                    *sum = (sum.0 + off.abs().sum(), sum.1 + off.norm_squared(), sum.2 + 3);
                }
            }
        }
        Self { sums }
    }

    /// Mean absolute error of a coordinate of some markers [m].
    pub fn mean(&self, markers: impl IntoIterator<Item = usize>) -> f64 {
        let (sum, count) = markers
            .into_iter()
            .fold((0.0, 0), |(sum, count), marker| (sum + self.sums[marker].0, count + self.sums[marker].2));
        sum / count as f64
    }

    /// Root of the mean square of a coordinate of all markers [m].
    pub fn root_mean_square(&self) -> f64 {
        let (sum, count) = self.sums.iter().fold((0.0, 0), |(sum, count), own| (sum + own.1, count + own.2));
        (sum / count as f64).sqrt()
    }
}

/// The sum of squares [m^2] over all frames but the first two, and over all rods, whose markers are `ways`: a branch begins with the marker
/// on which it hangs. Divided by the number of frames and by [`padded_places`] it is the mean square of Chen et al., "Differentiable
/// Branched Discrete Elastic Rods" (DEFT, 2025). Its code holds every rod in an array of the length of the longest one, counts the rest
/// as errors of 0, leaves out two frames of which it divides by the number, and tells the root. What was lost has no error.
pub fn padded_squares(recording: &Recording, free: &[usize], prediction: &Prediction, ways: &[Vec<usize>]) -> f64 {
    let mut times = vec![0.0; recording.count()];
    ways.iter().flatten().for_each(|&marker| times[marker] += 1.0);
    let frames = recording.markers.iter().zip(&prediction.markers).skip(2);
    let squares = frames.flat_map(|(real, predicted)| {
        free.iter().zip(predicted).map(|(&marker, here)| times[marker] * (here - real[marker]).norm_squared())
    });
    squares.filter(|square| !square.is_nan()).sum()
}

/// Coordinates in the arrays of [`padded_squares`].
pub fn padded_places(ways: &[Vec<usize>]) -> usize {
    3 * ways.len() * ways.iter().map(Vec::len).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

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
        let errors = Errors::of(&recording, &[2, 3], &prediction);
        assert!((errors.mean([3]) - 0.4 / 6.0).abs() < 1e-15);
        let squares: f64 = 0.01 + 0.04 + 0.09 + 0.16;
        assert!((errors.root_mean_square() - (squares / 36.0).sqrt()).abs() < 1e-15);
        recording.markers[1][3].x = f64::NAN;
        assert!((mean_error(&recording, &prediction) - 0.6 / 33.0).abs() < 1e-15);
    }
}
