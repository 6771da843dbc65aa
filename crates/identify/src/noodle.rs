//! A noodle: a rod that one clamp holds, whose full pose is recorded, with a free end.
//!
//! A [`Recording`] is read from a file. [`predict`] simulates it with some [`Numbers`], knowing nothing of it but the way of its clamp.
//! [`fit`] finds the numbers.

mod fit;
mod model;
mod number;
mod recording;

pub use fit::{Found, ITERATIONS, fit};
pub use model::{Resolution, predict};
pub use number::{Number, Numbers};
pub use recording::{Recording, is_noodle, read};

/// Mean distance [m] of the predicted tip from the recorded one, over the frames before `time` [s].
pub fn tip_error(recording: &Recording, predicted: &[[nalgebra::Vector3<f64>; 2]], time: f64) -> f64 {
    let frames = recording.time.iter().take_while(|&&at| at < time).count().min(predicted.len());
    let distance = |frame: usize| (predicted[frame][1] - recording.markers[frame][1]).norm();
    (0..frames).map(distance).sum::<f64>() / frames as f64
}
