//! Noodles as networks read them: like rods between two grips, which are points of the clamp's frame.

use identify::noodle::{Noodle, tip_error};
use identify::predict::Prediction;
use identify::recording::{GRIPPED, Recording};
use nalgebra::Vector3;

/// Distance of the clamp's points [m].
const AWAY: f64 = 0.5;
/// Times over which errors of the tip are told [s].
const HORIZONS: [f64; 3] = [5.0, 20.0, f64::INFINITY];

/// A noodle's recording whose first marker, where the clamp holds it, is two, one behind it, and which ends with two more in front of and
/// beside it: they tell the clamp's pose, as those of two grips tell theirs. The noodle leaves the clamp along its x axis.
pub fn held(recording: &Recording, noodle: &Noodle) -> Recording {
    let row = |(time, row): (&f64, &Vec<Vector3<f64>>)| {
        let clamp = noodle.clamp(*time);
        let at = |x: f64, y: f64| clamp.position + clamp.orientation * Vector3::new(x, y, 0.0) * AWAY;
        let (given, free) = row.split_at(1);
        [&[at(-1.0, 0.0)], given, free, &[at(1.0, 0.0), at(1.0, 1.0)]].concat()
    };
    let markers = recording.time.iter().zip(&recording.markers).map(row).collect();
    Recording { markers, ..recording.clone() }
}

/// Mean distances of the tip by how long they are looked at [m], of a recording with [`held`] markers.
pub fn errors(held: &Recording, prediction: &Prediction) -> Vec<(String, f64)> {
    let bare = |row: &Vec<Vector3<f64>>| row[GRIPPED - 1..row.len() - GRIPPED].to_vec();
    let recording = Recording { markers: held.markers.iter().map(bare).collect(), ..held.clone() };
    let name = |time: f64| if time.is_finite() { format!("tip over {time} s") } else { "tip".to_owned() };
    HORIZONS.map(|time| (name(time), tip_error(&recording, prediction, time))).to_vec()
}
