//! Regions about predicted markers that hold the recorded ones with a stated probability.
//!
//! Conformal prediction: how far off the predictions of recordings are by a fit without them says how far off those of further recordings
//! will be, whatever the errors come from, parameters or model, as long as these move alike (Barber, Candes, Ramdas and Tibshirani,
//! "Predictive inference with the jackknife+", Annals of Statistics 49, 2021). Frames of a recording are alike, so that
//! recordings count and not frames (Dunn, Wasserman and Ramdas, "Distribution-free prediction sets for two-layer hierarchical models",
//! JASA 118, 2023). It must not know how predictions are made.

use serde::{Deserialize, Serialize};

use crate::predict::Prediction;
use crate::recording::Recording;

/// The probability with which a recorded marker lies in its region.
pub const COVERAGE: f64 = 0.9;
/// Windows of time in which distances are looked at together.
const WINDOWS: usize = 20;

/// Balls about predicted markers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Regions {
    /// The probability with which a recorded marker lies in its ball.
    pub coverage: f64,
    /// Times between which radii are linear [s]; they hold before the first and after the last.
    pub times_s: Vec<f64>,
    /// Radii [m]: `radii_m[time][free marker]`.
    pub radii_m: Vec<Vec<f64>>,
}

impl Regions {
    /// The regions that follow from recordings and the predictions of each of them by a fit without it; `free` are the markers that are
    /// predicted. `None` where there are fewer recordings than the probability needs, nine for 90 %, or where too many predictions
    /// are no numbers.
    pub fn of(recordings: &[Recording], free: &[usize], predictions: &[Prediction]) -> Option<Self> {
        let count = recordings.len() as f64;
        let level = COVERAGE * (count + 1.0) / count;
        let longest = longest(recordings);
        if level > 1.0 || longest == 0.0 {
            return None;
        }
        let window = |time: f64| ((time / longest * WINDOWS as f64) as usize).min(WINDOWS - 1);
        let mut distances = vec![vec![Vec::new(); free.len()]; WINDOWS];
        each(recordings, free, predictions, |time, marker, distance| distances[window(time)][marker].push(distance));
        let middle = |k: usize| (k as f64 + 0.5) / WINDOWS as f64 * longest;
        // Without the windows in which a marker was never seen.
        let is_seen = |(_, own): &(usize, Vec<Vec<f64>>)| own.iter().all(|own| !own.is_empty());
        let radii = |(k, own): (usize, Vec<Vec<f64>>)| {
            (middle(k), own.into_iter().map(|own| quantile(own, level)).collect::<Vec<f64>>())
        };
        let (times_s, radii_m): (Vec<f64>, Vec<Vec<f64>>) =
            distances.into_iter().enumerate().filter(is_seen).map(radii).unzip();
        let is_known = !times_s.is_empty() && radii_m.iter().flatten().all(|radius| radius.is_finite());
        is_known.then_some(Self { coverage: COVERAGE, times_s, radii_m })
    }

    /// The radius of a free marker at a time [m].
    pub fn radius(&self, time: f64, marker: usize) -> f64 {
        let after = self.times_s.partition_point(|&own| own < time);
        let radius = |k: usize| self.radii_m[k][marker];
        match after {
            0 => radius(0),
            last if last == self.times_s.len() => radius(last - 1),
            k => {
                let [from, to] = [self.times_s[k - 1], self.times_s[k]];
                radius(k - 1) + (radius(k) - radius(k - 1)) * (time - from) / (to - from)
            }
        }
    }

    /// The share of recorded markers that lie in their balls: in each tenth of the longest recording, and in all.
    pub fn held(&self, recordings: &[Recording], free: &[usize], predictions: &[Prediction]) -> Held {
        let longest = longest(recordings);
        let mut sums = [(0.0, 0.0); 10];
        each(recordings, free, predictions, |time, marker, distance| {
            let (held, all) = &mut sums[((10.0 * time / longest) as usize).min(9)];
            *held += f64::from(distance <= self.radius(time, marker));
            *all += 1.0;
        });
        let (held, all) = sums.iter().fold((0.0, 0.0), |sum, own| (sum.0 + own.0, sum.1 + own.1));
        Held { longest, tenths: sums.map(|(held, all)| held / all), all: held / all }
    }
}

/// How many recorded markers lie in their balls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Length of the longest recording [s].
    pub longest: f64,
    /// Their share in each tenth of it.
    pub tenths: [f64; 10],
    /// Their share in all.
    pub all: f64,
}

/// Length of the longest recording [s].
fn longest(recordings: &[Recording]) -> f64 {
    recordings.iter().filter_map(|own| own.time.last()).fold(0.0, |a: f64, &b| a.max(b))
}

/// Shows each free marker that was not lost, from the third frame on: its time [s] and how far its prediction is off [m]. The first two
/// frames are given.
fn each(recordings: &[Recording], free: &[usize], predictions: &[Prediction], mut show: impl FnMut(f64, usize, f64)) {
    for (recording, prediction) in recordings.iter().zip(predictions) {
        let frames = recording.time.iter().zip(&recording.markers).zip(&prediction.markers);
        for ((&time, real), predicted) in frames.skip(2) {
            for (marker, (&free, predicted)) in free.iter().zip(predicted).enumerate() {
                let distance = (predicted - real[free]).norm();
                // A prediction that is not a number is as far off as anything can be; a recorded marker that is none was lost.
                if real[free].iter().all(|x| x.is_finite()) {
                    show(time, marker, if distance.is_nan() { f64::INFINITY } else { distance });
                }
            }
        }
    }
}

/// The least of some values, of which there is one, that this share of them does not exceed.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((share * values.len() as f64).ceil() as usize).clamp(1, values.len()) - 1]
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use nalgebra::Vector3;

    use super::*;

    /// A recording of one marker that stands still, two seconds long.
    fn recording() -> Recording {
        let time: Vec<f64> = (0..=200).map(|k| 0.01 * f64::from(k)).collect();
        Recording { path: PathBuf::from("a"), markers: vec![vec![Vector3::zeros()]; time.len()], time }
    }

    /// Its prediction, which is off by `off` along x, growing over time.
    fn off(off: f64) -> Prediction {
        let markers = recording().time.iter().map(|time| vec![Vector3::x() * (off * time)]).collect();
        Prediction { markers, unsolved: 0 }
    }

    #[test]
    fn nine_tenths_of_further_recordings_lie_in_their_regions() {
        let recordings = vec![recording(); 99];
        let predictions: Vec<Prediction> = (1..=99).map(|k| off(f64::from(k))).collect();
        let regions = Regions::of(&recordings, &[0], &predictions).unwrap();
        // Of 99 recordings and one more, 90 are no farther off than the 90th.
        for (time, radius) in [(1.0, 90.0), (0.1, 9.0)] {
            assert!((regions.radius(time, 0) / radius - 1.0).abs() < 0.1, "{} at {time}", regions.radius(time, 0));
        }
        let share = |of: f64| regions.held(&recordings[..1], &[0], &[off(of)]);
        assert_eq!(share(80.0).all, 1.0);
        assert!(share(100.0).tenths[1..].iter().all(|&share| share < 0.1), "{:?}", share(100.0));
    }

    #[test]
    fn too_few_recordings_tell_nothing() {
        let recordings = vec![recording(); 9];
        let predictions: Vec<Prediction> = (1..=9).map(|k| off(f64::from(k))).collect();
        assert!(Regions::of(&recordings, &[0], &predictions).is_some());
        assert!(Regions::of(&recordings[..8], &[0], &predictions[..8]).is_none());
    }

    #[test]
    fn what_was_lost_does_not_count_and_what_is_no_number_is_far_off() {
        let mut recordings = vec![recording(); 20];
        recordings[3].markers.iter_mut().for_each(|row| row[0].x = f64::NAN);
        let mut predictions = vec![off(1.0); 20];
        predictions[3] = off(1e6);
        let regions = Regions::of(&recordings, &[0], &predictions).unwrap();
        assert!(regions.radius(2.0, 0) < 2.1);
        predictions[4..8].iter_mut().for_each(|own| *own = off(f64::NAN));
        assert!(Regions::of(&recordings, &[0], &predictions).is_none());
    }
}
