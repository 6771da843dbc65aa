//! A recording beside a guess of its markers.

use identify::branched::Tree;
use identify::motions::Way;
use identify::predict::Prediction;
use identify::recording::{GRIPPED, Recording};
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

/// Which markers of a cable are predicted, and which its grips hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Markers {
    /// Those that are predicted, in the order in which predictions have them.
    pub free: Vec<usize>,
    /// The inner and the outer marker of each grip; the same twice where a grip holds one marker.
    pub grips: [[usize; 2]; 2],
    /// Markers on the rod that the grips hold: the first ones, in their order.
    pub parent: usize,
}

impl Markers {
    /// Those of a cable without branches with so many markers.
    pub fn of_cable(count: usize) -> Self {
        let grips = [[GRIPPED - 1, 0], [count - GRIPPED, count - 1]];
        Self { free: (GRIPPED..count - GRIPPED).collect(), grips, parent: count }
    }

    /// Those of a cable with branches.
    pub fn of_tree(tree: &Tree) -> Self {
        let given = tree.grips.given(tree.parent);
        let first = tree.grips.first();
        let outer = if given.contains(&0) { 0 } else { first };
        Self {
            free: tree.free().collect(),
            grips: [[first, outer], [tree.parent - GRIPPED, tree.parent - 1]],
            parent: tree.parent,
        }
    }
}

/// A recording beside a guess of its markers, which lie in the grips where the recording has them.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// What was recorded; what was lost is NaN.
    pub real: Vec<Vec<Vector3<f64>>>,
    /// The guess [m]: `markers[frame][marker]`, those in the grips included.
    pub guess: Vec<Vec<Vector3<f64>>>,
    /// Times of the frames [s].
    pub time: Vec<f64>,
    /// What its markers are.
    pub markers: Markers,
    /// Steps of the guess that were not solved.
    pub unsolved: usize,
}

impl Film {
    /// A recording of a cable without branches beside its simulation.
    pub fn simulated(recording: &Recording, prediction: &Prediction) -> Self {
        Self::with(recording, Markers::of_cable(recording.count()), prediction)
    }

    /// A recording beside its simulation.
    pub fn with(recording: &Recording, markers: Markers, prediction: &Prediction) -> Self {
        let mut guess = recording.markers.clone();
        for (guess, predicted) in guess.iter_mut().zip(&prediction.markers) {
            markers.free.iter().zip(predicted).for_each(|(&marker, &predicted)| guess[marker] = predicted);
        }
        let unsolved = prediction.unsolved;
        Self { real: recording.markers.clone(), guess, time: recording.time.clone(), markers, unsolved }
    }

    /// A recording beside its first shape, carried along with the grips.
    pub fn blended(recording: &Recording) -> Self {
        let (first, free) = (&recording.markers[0], recording.free());
        let (start, end) = (free.start - 1, free.end);
        let blended = |real: &Vec<Vector3<f64>>| -> Vec<Vector3<f64>> {
            let moved = |grip: usize| real[grip] - first[grip];
            let share = |marker| (marker - start) as f64 / (end - start) as f64;
            free.clone().map(|marker| first[marker] + moved(start).lerp(&moved(end), share(marker))).collect()
        };
        let markers = recording.markers.iter().map(blended).collect();
        Self::simulated(recording, &Prediction { markers, unsolved: 0 })
    }

    /// Time from frame to frame, that in the middle [s].
    pub fn interval(&self) -> f64 {
        let mut intervals: Vec<f64> = self.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        intervals.sort_by(f64::total_cmp);
        intervals.get(intervals.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// The ways of its grips.
    pub fn way(&self) -> Way {
        Way::of_grips(&self.time, &self.guess, self.markers.grips)
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
        let markers = self.guess.iter().map(|guess| self.markers.free.iter().map(|&marker| guess[marker]).collect());
        Prediction { markers: markers.collect(), unsolved: self.unsolved }
    }

    /// The guess as a prediction, with what is to be added to its free markers [m]: `added[frame][marker]`.
    pub fn corrected(&self, added: &[Vec<Vector3<f64>>]) -> Prediction {
        let markers = self.guess.iter().zip(added).map(|(guess, added)| {
            self.markers.free.iter().zip(added).map(|(&marker, added)| guess[marker] + added).collect()
        });
        Prediction { markers: markers.collect(), unsolved: self.unsolved }
    }
}
