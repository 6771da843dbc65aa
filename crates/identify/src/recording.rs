//! Recordings: markers on a cable over time.

use std::fmt;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use thiserror::Error;

mod check;
mod flat;
mod grid;
mod grips;
mod pickle;
mod read;
mod reading;
mod table;

pub use check::ALIKE;
pub(crate) use check::{
    check_length, check_neighbours, drop_other_counts, drop_other_lengths, fill_grips, first_length, median,
};
pub use flat::{is_flat, read_flat};
pub use grips::Grips;
pub(crate) use read::each;
pub use read::{files, read, read_all};
pub use reading::Reading;

/// Markers at each end of a cable that its grips hold, and that are given to a prediction over all time.
pub const GRIPPED: usize = 2;

/// Markers along one cable over time. A marker that was lost in a frame has the coordinates NaN there; those in the grips and
/// those of the first two frames are never lost.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The file.
    pub path: PathBuf,
    /// Times of the frames [s], increasing, the first of them 0.
    pub time: Vec<f64>,
    /// Positions [m]: `markers[frame][marker]`, in the order along the cable.
    pub markers: Vec<Vec<Vector3<f64>>>,
}

impl Recording {
    /// Its name: the file's, without its ending.
    pub fn name(&self) -> String {
        self.path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.time.len()
    }

    /// Markers along the cable.
    pub fn count(&self) -> usize {
        self.markers.first().map_or(0, Vec::len)
    }

    /// The recording played to and fro, so many times in all, beginning forwards: a motion of the grips that is so many times as long.
    /// What lies between them did not move so on its ways back.
    pub fn to_and_fro(&self, times: usize) -> Self {
        let last = self.frames() - 1;
        let (mut time, mut markers) = (vec![0.0], vec![self.markers[0].clone()]);
        for pass in 0..times {
            for k in 1..=last {
                let [before, now] = [k - 1, k].map(|k| if pass % 2 == 0 { k } else { last - k });
                time.push(time[time.len() - 1] + (self.time[now] - self.time[before]).abs());
                markers.push(self.markers[now].clone());
            }
        }
        Self { path: self.path.clone(), time, markers }
    }

    /// The markers that are to be predicted: all but those in the grips.
    pub fn free(&self) -> std::ops::Range<usize> {
        GRIPPED..self.count() - GRIPPED
    }
}

/// What is wrong with a recording: one sentence that begins with the file.
#[derive(Debug, Error)]
#[error("{}: {place}{message}", .path.display())]
pub struct RecordingError {
    /// The file.
    pub path: PathBuf,
    /// Where in it.
    pub place: Place,
    /// What is wrong, and what is allowed.
    pub message: String,
}

/// A place in a recording, both counted from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The frame.
    pub frame: Option<usize>,
    /// The marker.
    pub marker: Option<usize>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.frame, self.marker) {
            (None, None) => Ok(()),
            (Some(frame), None) => write!(f, "frame {frame}: "),
            (None, Some(marker)) => write!(f, "marker {marker}: "),
            (Some(frame), Some(marker)) => write!(f, "frame {frame}, marker {marker}: "),
        }
    }
}

impl RecordingError {
    pub(crate) fn new(path: &Path, message: impl Into<String>) -> Self {
        Self { path: path.to_owned(), place: Place::default(), message: message.into() }
    }

    pub(crate) fn at(path: &Path, frame: usize, marker: usize, message: impl Into<String>) -> Self {
        let place = Place { frame: Some(frame), marker: Some(marker) };
        Self { path: path.to_owned(), place, message: message.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn to_and_fro_turns_at_both_ends() {
        let markers = (0..3).map(|k| vec![Vector3::x() * f64::from(k)]).collect();
        let recording = Recording { path: PathBuf::from("a"), time: vec![0.0, 0.1, 0.3], markers };
        let found = recording.to_and_fro(3);
        let places: Vec<f64> = found.markers.iter().map(|row| row[0].x).collect();
        assert_eq!(places, [0.0, 1.0, 2.0, 1.0, 0.0, 1.0, 2.0]);
        for (time, expected) in found.time.iter().zip([0.0, 0.1, 0.3, 0.5, 0.6, 0.7, 0.9]) {
            assert!((time - expected).abs() < 1e-12);
        }
    }
}
