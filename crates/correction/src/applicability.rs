//! Which motions a correction applies to.
//!
//! A network gains on motions like those that it learned from, and less or nothing on others. What it gains is measured in training, on
//! recordings that networks did not learn from: those that the members keep aside, whose motions are alike, and whole kinds of motions, by two
//! more networks that learn from one half of the kinds each. A motion is like those in training if its grips' ways are no farther from the nearest
//! of them than any of those is from the others. Several are unlike, all of them, if they are farther by the rank-sum test (Mann and Whitney, "On a test of whether one
//! of two random variables is stochastically larger than the other", Annals of Mathematical Statistics 18, 1947). It must not know what networks say.

use identify::motions::Way;
use serde::{Deserialize, Serialize};

/// A correction applies where it is expected to take at least this share of the error.
pub const GAIN: f64 = 0.3;

/// Which motions a correction applies to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Applicability {
    /// Ways of the grips in training.
    ways: Vec<Way>,
    /// Largest distance of like motions [m].
    pub like_m: f64,
    /// The share of the error that it takes of like motions; none where training had one recording, and could keep none aside.
    pub like_gain: Option<f64>,
    /// Of motions of other kinds; none where training had too few recordings to tell.
    pub other_gain: Option<f64>,
}

/// What a correction is worth to a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worth {
    /// Distance from the nearest motion in training [m].
    pub distance: f64,
    /// The share of the error that it is expected to take; none where that is not known.
    pub gain: Option<f64>,
    /// Whether the motion is like those in training.
    pub is_like: bool,
    /// Whether it is to be added.
    pub applies: bool,
}

impl Applicability {
    /// From ways in training, and what was gained.
    pub fn new(ways: Vec<Way>, like_gain: Option<f64>, other_gain: Option<f64>) -> Self {
        let mut out = Self { ways, like_m: 0.0, like_gain, other_gain };
        out.like_m = out.distances().into_iter().fold(0.0, f64::max);
        out
    }

    /// How far each way in training is from the nearest other one [m]; none of one way.
    pub fn distances(&self) -> Vec<f64> {
        let own = |k: usize| self.ways[k].nearest(self.ways[..k].iter().chain(&self.ways[k + 1..]));
        (0..self.ways.len()).map(own).filter(|distance| distance.is_finite()).collect()
    }

    /// What the correction is worth to each of some motions that are predicted together: it applies to like ones where it takes any of their
    /// error, and to others where it takes at least [`GAIN`] of it.
    pub fn worths(&self, ways: &[Way]) -> Vec<Worth> {
        let distances: Vec<f64> = ways.iter().map(|way| way.nearest(&self.ways)).collect();
        let are_farther = are_larger(&distances, &self.distances());
        let worth = |distance: f64| {
            let is_like = !are_farther && distance <= self.like_m;
            let (gain, least) = if is_like { (self.like_gain, f64::MIN_POSITIVE) } else { (self.other_gain, GAIN) };
            Worth { distance, gain, is_like, applies: gain.is_some_and(|gain| gain >= least) }
        };
        distances.into_iter().map(worth).collect()
    }
}

/// Whether some numbers are larger than others, by the rank-sum test: of a hundred pairs of lists that are alike it says so of one, 2.33 standard
/// deviations off.
fn are_larger(some: &[f64], others: &[f64]) -> bool {
    let count = |of: fn(&f64, &f64) -> bool| {
        some.iter().map(|a| others.iter().filter(|b| of(a, b)).count()).sum::<usize>() as f64
    };
    let [m, n] = [some, others].map(|list| list.len() as f64);
    let larger = count(|a, b| a > b) + 0.5 * count(|a, b| a == b);
    larger - 0.5 * m * n > 2.33 * (m * n * (m + n + 1.0) / 12.0).sqrt()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    /// Grips that go apart by so much [m].
    fn way(apart: f64) -> Way {
        let frame = |k: usize| {
            let end = 1.0 + apart * k as f64 / 9.0;
            [0.0, 0.1, end, end + 0.1].map(|x| Vector3::new(x, 0.0, 0.0)).to_vec()
        };
        let time: Vec<f64> = (0..10).map(f64::from).collect();
        Way::of_grips(&time, &(0..10).map(frame).collect::<Vec<_>>(), [[1, 0], [2, 3]])
    }

    #[test]
    fn far_motions_are_corrected_only_where_that_was_seen_to_gain() {
        let ways = || (0..20).map(|k| way(0.01 * f64::from(k))).collect::<Vec<_>>();
        let of = |other_gain| Applicability::new(ways(), Some(0.4), other_gain);
        let near = of(Some(0.2)).worths(&[way(0.1)])[0];
        assert!(near.applies && near.gain == Some(0.4) && near.distance < 1e-6);
        for (gain, applies) in [(None, false), (Some(0.2), false), (Some(0.3), true)] {
            let far = of(gain).worths(&[way(0.5)])[0];
            assert!(far.applies == applies && far.gain == gain && far.distance > 0.1, "{far:?}");
        }
    }

    #[test]
    fn motions_that_are_farther_together_are_unlike_together() {
        let ways = (0..20).map(|k| way(0.01 * f64::from(k * k))).collect();
        let known = Applicability::new(ways, Some(0.4), None);
        let like: Vec<Way> = (1..6).map(|k| way(0.01 * (f64::from(k * k) + 0.3))).collect();
        // Beyond the last one in training, but no farther than that is from the one before.
        let unlike = [31.0, 33.0, 34.0, 35.0, 36.0].map(|by| way(0.01 * (19.0 * 19.0 + by)));
        assert!(known.worths(&like).iter().all(|own| own.is_like && own.applies));
        for (own, together) in unlike.iter().zip(known.worths(&unlike)) {
            let alone = known.worths(std::slice::from_ref(own))[0];
            assert!(alone.is_like && !together.is_like && !together.applies, "{alone:?} {together:?}");
            assert_eq!(alone.distance, together.distance);
        }
        assert!(are_larger(&[2.0, 3.0, 4.0, 5.0], &[0.0, 1.0, 1.5, 1.7, 1.9, 2.0]));
        assert!(
            !are_larger(&[1.0, 0.5, 1.6, 0.1], &[0.0, 1.0, 1.5, 1.7, 1.9, 2.0]) && !are_larger(&[9.0], &[1.0, 2.0])
        );
    }

    #[test]
    fn what_made_recordings_kept_aside_worse_applies_to_nothing() {
        for (gain, applies) in [(None, false), (Some(-0.1), false), (Some(0.0), false), (Some(0.01), true)] {
            let near = Applicability::new(vec![way(0.1), way(0.2)], gain, None).worths(&[way(0.1)])[0];
            assert!(near.applies == applies && near.gain == gain, "{near:?}");
        }
    }
}
