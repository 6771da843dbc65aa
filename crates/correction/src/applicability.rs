//! Which motions a correction applies to.
//!
//! A network gains on motions like those that it learned from, and less or nothing on others. What it gains is measured in training, on
//! recordings that networks did not learn from: those that the members keep aside, whose motions are alike, and whole kinds of motions, by two
//! more networks that learn from one half of the kinds each. A motion is like those in training if its grips' ways are no farther from the nearest
//! of them than any of those is from the others. It must not know what networks say.

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
    /// Whether it is to be added.
    pub applies: bool,
}

impl Applicability {
    /// From ways in training, and what was gained.
    pub fn new(ways: Vec<Way>, like_gain: Option<f64>, other_gain: Option<f64>) -> Self {
        let own = |k: usize| ways[k].nearest(ways[..k].iter().chain(&ways[k + 1..]));
        let like_m = (0..ways.len()).map(own).filter(|distance| distance.is_finite()).fold(0.0, f64::max);
        Self { ways, like_m, like_gain, other_gain }
    }

    /// What the correction is worth to a motion: it applies to like ones where it takes any of their error, and to others where it takes at
    /// least [`GAIN`] of it.
    pub fn worth(&self, way: &Way) -> Worth {
        let distance = way.nearest(&self.ways);
        let is_like = distance <= self.like_m;
        let (gain, least) = if is_like { (self.like_gain, f64::MIN_POSITIVE) } else { (self.other_gain, GAIN) };
        Worth { distance, gain, applies: gain.is_some_and(|gain| gain >= least) }
    }
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
        let near = of(Some(0.2)).worth(&way(0.1));
        assert!(near.applies && near.gain == Some(0.4) && near.distance < 1e-6);
        for (gain, applies) in [(None, false), (Some(0.2), false), (Some(0.3), true)] {
            let far = of(gain).worth(&way(0.5));
            assert!(far.applies == applies && far.gain == gain && far.distance > 0.1, "{far:?}");
        }
    }

    #[test]
    fn what_made_recordings_kept_aside_worse_applies_to_nothing() {
        for (gain, applies) in [(None, false), (Some(-0.1), false), (Some(0.0), false), (Some(0.01), true)] {
            let near = Applicability::new(vec![way(0.1), way(0.2)], gain, None).worth(&way(0.1));
            assert!(near.applies == applies && near.gain == gain, "{near:?}");
        }
    }
}
