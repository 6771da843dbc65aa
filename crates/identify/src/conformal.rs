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
    /// Times between which radii are linear [s]; they hold before the first, and up to `until_s`.
    pub times_s: Vec<f64>,
    /// Radii [m]: `radii_m[time][free marker]`.
    pub radii_m: Vec<Vec<f64>>,
    /// Time up to which enough recordings went on [s]; nothing is known of what comes after it.
    #[serde(default = "always")]
    pub until_s: f64,
}

/// The end of all times [s].
fn always() -> f64 {
    f64::MAX
}

impl Regions {
    /// The regions that follow from recordings and the predictions of each of them by a fit without it; `free` are the markers that are
    /// predicted. They end where fewer recordings go on than the probability needs, nine for 90 %. `None` where there are fewer, or where
    /// too many predictions are no numbers.
    pub fn of(recordings: &[Recording], free: &[usize], predictions: &[Prediction]) -> Option<Self> {
        let longest = longest(recordings);
        let window = |time: f64| ((time / longest * WINDOWS as f64) as usize).min(WINDOWS - 1);
        let mut distances = vec![vec![Vec::new(); free.len()]; WINDOWS];
        each(recordings, free, predictions, |time, marker, distance| distances[window(time)][marker].push(distance));
        // The quantile that holds of one more recording, in a window that so many recordings reach.
        let level = |k: usize| {
            let reach = |own: &&Recording| own.time.last().is_some_and(|&last| longest > 0.0 && window(last) >= k);
            let count = recordings.iter().filter(reach).count() as f64;
            COVERAGE * (count + 1.0) / count
        };
        let (mut times_s, mut radii_m, mut until_s) = (Vec::new(), Vec::new(), 0.0);
        for (k, own) in distances.into_iter().enumerate().take_while(|(k, _)| level(*k) <= 1.0) {
            until_s = if k + 1 == WINDOWS { always() } else { (k as f64 + 1.0) / WINDOWS as f64 * longest };
            // Without the windows in which a marker was never seen.
            if own.iter().all(|own| !own.is_empty()) {
                times_s.push((k as f64 + 0.5) / WINDOWS as f64 * longest);
                radii_m.push(own.into_iter().map(|own| quantile(own, level(k))).collect());
            }
        }
        let is_known = !times_s.is_empty() && radii_m.iter().flatten().all(|radius: &f64| radius.is_finite());
        is_known.then_some(Self { coverage: COVERAGE, times_s, radii_m, until_s })
    }

    /// Whether it has a radius of each marker at each time, in order.
    pub fn is_sound(&self) -> bool {
        let [times, radii] = [self.times_s.len(), self.radii_m.len()];
        times > 0
            && times == radii
            && self.times_s.is_sorted()
            && self.radii_m.iter().all(|row| row.len() == self.markers())
    }

    /// How many free markers it is of.
    pub fn markers(&self) -> usize {
        self.radii_m.first().map_or(0, Vec::len)
    }

    /// The radius of a free marker at a time [m]; `None` where nothing is known of it.
    pub fn radius(&self, time: f64, marker: usize) -> Option<f64> {
        let after = self.times_s.partition_point(|&own| own < time);
        let radius = |k: usize| self.radii_m[k][marker];
        let found = match after {
            0 => radius(0),
            last if last == self.times_s.len() => radius(last - 1),
            k => {
                let [from, to] = [self.times_s[k - 1], self.times_s[k]];
                radius(k - 1) + (radius(k) - radius(k - 1)) * (time - from) / (to - from)
            }
        };
        (time <= self.until_s).then_some(found)
    }

    /// The share of recorded markers that lie in their balls, of those that have one: in each tenth of the longest recording, and in all.
    pub fn held(&self, recordings: &[Recording], free: &[usize], predictions: &[Prediction]) -> Held {
        let longest = longest(recordings);
        let mut sums = [(0.0, 0.0); 10];
        each(recordings, free, predictions, |time, marker, distance| {
            let (held, all) = &mut sums[((10.0 * time / longest) as usize).min(9)];
            if let Some(radius) = self.radius(time, marker) {
                *held += f64::from(distance <= radius);
                *all += 1.0;
            }
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
    /// Their share in each tenth of it; NaN where none has one.
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
            let found = regions.radius(time, 0).unwrap();
            assert!((found / radius - 1.0).abs() < 0.1, "{found} at {time}");
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
    fn regions_end_where_fewer_recordings_go_on_than_they_need() {
        let mut recordings = vec![recording(); 10];
        for short in &mut recordings[..9] {
            short.time.truncate(101);
            short.markers.truncate(101);
        }
        let predictions: Vec<Prediction> = (1..=10).map(|k| off(f64::from(k))).collect();
        let regions = Regions::of(&recordings, &[0], &predictions).unwrap();
        assert!(regions.is_sound() && (1.0..1.15).contains(&regions.until_s), "{}", regions.until_s);
        // Of ten recordings and one more, nine tenths are no farther off than the tenth.
        assert!((regions.radius(0.9, 0).unwrap() / 9.0 - 1.0).abs() < 0.1);
        assert_eq!(regions.radius(1.5, 0), None);
        let held = regions.held(&recordings[9..], &[0], &predictions[9..]);
        assert!(held.tenths[9].is_nan() && held.all.is_finite(), "{held:?}");
    }

    #[test]
    fn what_was_lost_does_not_count_and_what_is_no_number_is_far_off() {
        let mut recordings = vec![recording(); 20];
        recordings[3].markers.iter_mut().for_each(|row| row[0].x = f64::NAN);
        let mut predictions = vec![off(1.0); 20];
        predictions[3] = off(1e6);
        let regions = Regions::of(&recordings, &[0], &predictions).unwrap();
        assert!(regions.radius(2.0, 0).unwrap() < 2.1);
        predictions[4..8].iter_mut().for_each(|own| *own = off(f64::NAN));
        assert!(Regions::of(&recordings, &[0], &predictions).is_none());
    }
}
