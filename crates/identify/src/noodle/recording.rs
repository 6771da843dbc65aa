//! Files of noodles: a CSV table, a row a frame.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use cosserat::state::Pose;
use nalgebra::{UnitQuaternion, Vector3};

use super::MARKERS;
use crate::recording::{Place, Recording, RecordingError, check_length, median};

/// What is read of a file, in this order: time, the clamp's position, its angles, the markers in the middle and at the tip.
const COLUMNS: [&str; 13] = [
    "t", "p_b_x", "p_b_y", "p_b_z", "phi_b_x", "phi_b_y", "phi_b_z", "p_m_x", "p_m_y", "p_m_z", "p_e_x", "p_e_y",
    "p_e_z",
];
/// The first so many of them must be there in each row.
const GIVEN: usize = 7;
/// Fewest frames.
const FEWEST: usize = 100;
/// Frames nearer than this to the one before are left out [s].
const NEAREST: f64 = 0.0075;
/// How far from each other markers may get, to their median distance: a noodle hangs nearly straight, and bends.
const FARTHEST: f64 = 1.5;

/// A noodle over time.
#[derive(Clone, Debug, PartialEq)]
pub struct NoodleRecording {
    /// Its markers: the clamp, one in the middle and one at the tip. Frames that come within 7.5 ms of the one before are left out.
    pub recording: Recording,
    /// Times [s] and poses of the clamp, of all frames.
    pub clamp: Vec<(f64, Pose)>,
}

impl NoodleRecording {
    /// The longest way from the clamp over the middle to the tip that is seen [m].
    pub fn reach(&self) -> f64 {
        let way = |row: &Vec<Vector3<f64>>| (row[1] - row[0]).norm() + (row[2] - row[1]).norm();
        self.recording.markers.iter().map(way).fold(0.0, f64::max)
    }
}

/// Whether a file is a CSV table of a noodle: its header names the clamp's pose, `p_b_x`.
pub fn is_noodle(path: &Path) -> bool {
    let mut header = String::new();
    let is_csv = path.extension().is_some_and(|end| end == "csv");
    is_csv
        && File::open(path).is_ok_and(|file| BufReader::new(file).read_line(&mut header).is_ok())
        && header.split(',').any(|name| name.trim() == "p_b_x")
}

/// Reads a table with the columns `t` [s], `p_b_x` to `p_b_z` (place of the clamp [m]), `phi_b_x` to `phi_b_z` (its turns [rad] about the
/// axes of the world, x first, then y, then z), `p_m_x` and so on and `p_e_x` and so on (markers in the middle and at the tip [m]). z is up.
/// Other columns are not read. An empty cell of a marker, or NaN, says that it was lost. This is the layout of the recordings of Mamedov,
/// Geist, Swevers and Trimpe (Pseudo-rigid body networks, 2023).
///
/// # Errors
/// With the file, and the frame (counted from 0) and the column or the marker, if a column is missing, a cell is no number, a time or the
/// clamp is lost, times do not increase, there are too few frames, a marker is lost in all, or distances along the noodle do not fit.
pub fn read(path: &Path, unit: f64) -> Result<NoodleRecording, RecordingError> {
    let wrong = |message: String| RecordingError::new(path, message);
    let mut table =
        csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(|error| wrong(error.to_string()))?;
    let header = table.headers().map_err(|error| wrong(error.to_string()))?.clone();
    let mut columns = [0; COLUMNS.len()];
    for (column, name) in columns.iter_mut().zip(COLUMNS) {
        let found = header.iter().position(|other| other == name);
        *column =
            found.ok_or_else(|| wrong(format!("there is no column {name}; there must be {}", COLUMNS.join(", "))))?;
    }
    let mut recording = Recording { path: path.to_owned(), time: Vec::new(), markers: Vec::new() };
    let mut clamp: Vec<(f64, Pose)> = Vec::new();
    let mut start = 0.0;
    for (frame, row) in table.records().enumerate() {
        let row = row.map_err(|error| wrong(format!("frame {frame}: {error}")))?;
        let mut x = [f64::NAN; COLUMNS.len()];
        for (k, x) in x.iter_mut().enumerate() {
            let text = row.get(columns[k]).unwrap_or_default();
            let may_be_lost = k >= GIVEN;
            if text.is_empty() && may_be_lost {
                continue;
            }
            let number = text.parse().ok().filter(|x: &f64| x.is_finite() || x.is_nan() && may_be_lost);
            *x = number
                .ok_or_else(|| wrong(format!("frame {frame}, column {}: {text:?} is no finite number", COLUMNS[k])))?;
        }
        if frame == 0 {
            start = x[0];
        }
        let time = x[0] - start;
        if clamp.last().is_some_and(|&(before, _)| time <= before) {
            return Err(wrong(format!("frame {frame}, column t: {} s is not after the frame before", x[0])));
        }
        let at = |k: usize| Vector3::new(x[k], x[k + 1], x[k + 2]) * unit;
        let orientation = UnitQuaternion::from_euler_angles(x[4], x[5], x[6]);
        clamp.push((time, Pose { position: at(1), orientation }));
        if recording.time.last().is_none_or(|&before| time > before + NEAREST) {
            recording.time.push(time);
            recording.markers.push(vec![at(1), at(7), at(10)]);
        }
    }
    if recording.frames() < FEWEST {
        return Err(wrong(format!("{} frames, but there must be at least {FEWEST}", recording.frames())));
    }
    check_reach(&recording)?;
    Ok(NoodleRecording { recording, clamp })
}

/// Refuses other units, markers that are never seen, and such as get farther from each other than a noodle is long.
fn check_reach(recording: &Recording) -> Result<(), RecordingError> {
    let mut usual = [0.0; MARKERS - 1];
    for (k, usual) in usual.iter_mut().enumerate() {
        let apart = recording.markers.iter().map(|row| (row[k + 1] - row[k]).norm());
        *usual = median(apart.collect());
        if usual.is_nan() {
            let place = Place { frame: None, marker: Some(k + 1) };
            return Err(RecordingError { place, ..RecordingError::new(&recording.path, "it is lost in all frames") });
        }
    }
    check_length(&recording.path, usual.iter().sum())?;
    for (frame, row) in recording.markers.iter().enumerate() {
        for (k, usual) in usual.iter().enumerate() {
            let found = (row[k + 1] - row[k]).norm();
            if found > FARTHEST * usual {
                let message =
                    format!("{found:.4} m from the one before, but mostly {usual:.4} m: markers swapped, or one jumps");
                return Err(RecordingError::at(&recording.path, frame, k + 1, message));
            }
        }
    }
    Ok(())
}
