//! A noodle: a rod that one clamp holds, whose full pose is recorded, with a free end.
//!
//! A [`NoodleRecording`] is read from a file; [`Noodle`] is what a prediction knows of it, nothing but the way of its clamp. It has
//! some [`Numbers`].

mod model;
mod number;
mod recording;
pub mod scene;

pub use model::Noodle;
pub use number::{Number, Numbers};
pub use recording::{NoodleRecording, is_noodle, read};

use crate::predict::Prediction;
use crate::recording::Recording;

/// Markers of a noodle's [`Recording`]: the clamp, which is given, one in the middle and one at the tip.
pub const MARKERS: usize = 3;

/// Mean distance [m] of the predicted tip from the recorded one, over the frames before `time` [s] in which it was not
/// lost; NaN where it was lost in all of them.
pub fn tip_error(recording: &Recording, predicted: &Prediction, time: f64) -> f64 {
    let pairs = recording.time.iter().zip(&recording.markers).zip(&predicted.markers);
    let apart = pairs.take_while(|((at, _), _)| **at < time).map(|((_, real), here)| (here[1] - real[2]).norm());
    let (sum, count) = apart.filter(|apart| !apart.is_nan()).fold((0.0, 0), |(sum, count), x| (sum + x, count + 1));
    sum / f64::from(count)
}
