//! A recording beside a guess of its markers.

use identify::predict::Prediction;
use identify::recording::Recording;
use nalgebra::Vector3;
use names::names;

/// What is corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guess {
    /// The simulation.
    Physics,
    /// The first shape, its markers moved as the nearest grips are, in proportion. No physics is in it.
    Blend,
}

names!(Guess {
    Physics = "physics",
    Blend = "blend",
});

/// A recording beside a guess of its markers, which lie in the grips where the recording has them.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// What was recorded; what was lost is NaN.
    pub real: Vec<Vec<Vector3<f64>>>,
    /// The guess [m]: `markers[frame][marker]`, those in the grips included.
    pub guess: Vec<Vec<Vector3<f64>>>,
    /// Times of the frames [s].
    pub time: Vec<f64>,
    /// The markers between the grips.
    pub free: std::ops::Range<usize>,
}

impl Film {
    /// A recording beside its simulation.
    pub fn simulated(recording: &Recording, prediction: &Prediction) -> Self {
        Self::new(recording, |frame, marker| prediction.markers[frame][marker - recording.free().start])
    }

    /// A recording beside its first shape, carried along with the grips.
    pub fn blended(recording: &Recording) -> Self {
        let (first, free) = (&recording.markers[0], recording.free());
        let (start, end) = (free.start - 1, free.end);
        Self::new(recording, |frame, marker| {
            let moved = |grip: usize| recording.markers[frame][grip] - first[grip];
            first[marker] + moved(start).lerp(&moved(end), (marker - start) as f64 / (end - start) as f64)
        })
    }

    fn new(recording: &Recording, of: impl Fn(usize, usize) -> Vector3<f64>) -> Self {
        let free = recording.free();
        let row = |(frame, real): (usize, &Vec<Vector3<f64>>)| -> Vec<Vector3<f64>> {
            let marker = |marker| if free.contains(&marker) { of(frame, marker) } else { real[marker] };
            (0..real.len()).map(marker).collect()
        };
        let guess = recording.markers.iter().enumerate().map(row).collect();
        Self { real: recording.markers.clone(), guess, time: recording.time.clone(), free: free.clone() }
    }

    /// So many parts of it, one after the other, each beside its part of the recording: of a part all that was recorded before and after it is lost.
    pub fn parts(&self, recording: &Recording, count: usize) -> Vec<(Recording, Self)> {
        let frames = self.time.len();
        let part = |k: usize| {
            let mut real = self.real.clone();
            let (before, after) = (k * frames / count, (k + 1) * frames / count);
            let (first, last) = real.split_at_mut(after);
            first[..before].iter_mut().chain(last).for_each(|row| row.fill(Vector3::repeat(f64::NAN)));
            (Recording { markers: real.clone(), ..recording.clone() }, Self { real, ..self.clone() })
        };
        (0..count).map(part).collect()
    }

    /// The guess as a prediction.
    pub fn uncorrected(&self) -> Prediction {
        let markers = self.guess.iter().map(|guess| guess[self.free.clone()].to_vec());
        Prediction { markers: markers.collect(), unsolved: 0 }
    }

    /// The guess as a prediction, with what is to be added to its free markers [m]: `added[frame][marker]`.
    pub fn corrected(&self, added: &[Vec<Vector3<f64>>]) -> Prediction {
        let markers = self.guess.iter().zip(added).map(|(guess, added)| {
            let free = guess[self.free.clone()].iter().zip(added);
            free.map(|(guess, added)| guess + added).collect()
        });
        Prediction { markers: markers.collect(), unsolved: 0 }
    }
}
