//! Files of noodles: a CSV table, a row a frame.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use nalgebra::{UnitQuaternion, Vector3};
use rod::Pose;

use crate::recording::RecordingError;

/// What is read of a file, in this order: time, the clamp's position, its angles, the markers in the middle and at the tip.
const COLUMNS: [&str; 13] = [
    "t", "p_b_x", "p_b_y", "p_b_z", "phi_b_x", "phi_b_y", "phi_b_z", "p_m_x", "p_m_y", "p_m_z", "p_e_x", "p_e_y",
    "p_e_z",
];
/// Fewest frames.
const FEWEST: usize = 100;

/// A noodle over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The file.
    pub path: PathBuf,
    /// Times of the frames [s], increasing, the first of them 0.
    pub time: Vec<f64>,
    /// Pose of the clamp in each frame.
    pub clamp: Vec<Pose>,
    /// The markers in the middle and at the tip in each frame [m].
    pub markers: Vec<[Vector3<f64>; 2]>,
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
/// Other columns are not read. This is the layout of the recordings of Mamedov, Geist, Swevers and Trimpe (Pseudo-rigid body networks,
/// 2023).
///
/// # Errors
/// With the file, the row (the header is row 1) and the column, if a column is missing, a cell is no finite number, times do not
/// increase, or there are too few frames.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
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
    let mut recording = Recording { path: path.to_owned(), time: Vec::new(), clamp: Vec::new(), markers: Vec::new() };
    let mut start = 0.0;
    for (frame, row) in table.records().enumerate() {
        let place = frame + 2;
        let row = row.map_err(|error| wrong(format!("row {place}: {error}")))?;
        let mut x = [0.0; COLUMNS.len()];
        for (k, x) in x.iter_mut().enumerate() {
            let text = row.get(columns[k]).unwrap_or_default();
            let number = text.parse().ok().filter(|x: &f64| x.is_finite());
            *x = number
                .ok_or_else(|| wrong(format!("row {place}, column {}: {text:?} is no finite number", COLUMNS[k])))?;
        }
        if frame == 0 {
            start = x[0];
        }
        let time = x[0] - start;
        if recording.time.last().is_some_and(|&before| time <= before) {
            return Err(wrong(format!("row {place}, column t: {} s is not after the row before", x[0])));
        }
        recording.time.push(time);
        let orientation = UnitQuaternion::from_euler_angles(x[4], x[5], x[6]);
        recording.clamp.push(Pose { position: Vector3::new(x[1], x[2], x[3]), orientation });
        recording.markers.push([Vector3::new(x[7], x[8], x[9]), Vector3::new(x[10], x[11], x[12])]);
    }
    if recording.time.len() < FEWEST {
        return Err(wrong(format!("{} frames, but there must be at least {FEWEST}", recording.time.len())));
    }
    Ok(recording)
}
