//! Files of recordings.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;

use super::grid::Grid;
use super::reading::{Frames, Reading};
use super::{Recording, RecordingError, check, pickle, table};

/// All recordings at these places, in the order of their names: files as they are, of folders those that end in `.pkl` or
/// `.csv`. What is named twice is there once.
///
/// # Errors
/// Of the first place that is not there or has none.
pub fn files(places: &[PathBuf]) -> Result<Vec<PathBuf>, RecordingError> {
    let mut all = Vec::new();
    for place in places {
        if !place.is_dir() {
            all.push(place.clone());
            continue;
        }
        let wrong = |error: std::io::Error| RecordingError::new(place, error.to_string());
        let entries = fs::read_dir(place).map_err(wrong)?.collect::<Result<Vec<_>, _>>().map_err(wrong)?;
        let is_recording = |path: &PathBuf| path.extension().is_some_and(|end| end == "pkl" || end == "csv");
        let mut found: Vec<_> = entries.into_iter().map(|entry| entry.path()).filter(is_recording).collect();
        if found.is_empty() {
            return Err(RecordingError::new(
                place,
                "there is no recording in this folder (files that end in .pkl or .csv)",
            ));
        }
        found.sort();
        all.append(&mut found);
    }
    let mut seen = HashSet::new();
    // What cannot be found is said when it is read.
    all.retain(|path| seen.insert(path.canonicalize().unwrap_or_else(|_| path.clone())));
    Ok(all)
}

/// Reads and checks recordings of one cable. What is wrong with some keeps none of the others from being read: a recording
/// that cannot be understood, is too short, whose markers swap, or whose length or number of markers is not that of most.
pub fn read_all(paths: &[PathBuf], reading: Reading) -> (Vec<Recording>, Vec<RecordingError>) {
    let (mut good, mut bad) = each(paths, |path| read(path, reading));
    bad.extend(check::drop_other_counts(&mut good));
    bad.extend(check::drop_other_lengths(&mut good, |own| {
        (&own.path, check::first_length(own, check::along(own.count())))
    }));
    (good, bad)
}

/// What a function makes of all of these, and why it makes nothing of some.
pub(crate) fn each<T, R>(
    all: impl IntoIterator<Item = T>,
    read: impl Fn(T) -> Result<R, RecordingError>,
) -> (Vec<R>, Vec<RecordingError>) {
    let (mut good, mut bad) = (Vec::new(), Vec::new());
    for one in all {
        match read(one) {
            Ok(recording) => good.push(recording),
            Err(error) => bad.push(error),
        }
    }
    (good, bad)
}

/// Reads and checks a recording: a pickle (`.pkl`) of shape (frames, 3, markers) or (frames, markers, 3), or a CSV file with a
/// header. Metres, seconds, z up.
///
/// # Errors
/// With the file, and the frame and the marker where there is one to blame.
pub fn read(path: &Path, reading: Reading) -> Result<Recording, RecordingError> {
    let bytes = fs::read(path).map_err(|error| RecordingError::new(path, error.to_string()))?;
    let is_csv = path.extension().is_some_and(|end| end == "csv");
    let wrong = |message: String| RecordingError::new(path, message);
    let (time, markers) = if is_csv {
        table::read(&bytes, reading).map_err(wrong)?
    } else {
        of_grid(&pickle::read(&bytes).map_err(wrong)?, reading).map_err(wrong)?
    };
    let start = time.first().copied().unwrap_or_default();
    let time = time.into_iter().map(|time| time - start).collect();
    check::checked(Recording { path: path.to_owned(), time, markers })
}

/// The frames of a grid.
fn of_grid(grid: &Grid, reading: Reading) -> Result<Frames, String> {
    let shape: Vec<usize> = grid.shape.iter().copied().skip_while(|&size| size == 1).collect();
    // How far apart markers and axes lie.
    let (frames, markers, [by_marker, by_axis]) = match shape[..] {
        [frames, 3, markers] => (frames, markers, [1, markers]),
        [frames, markers, 3] => (frames, markers, [3, 1]),
        _ => {
            return Err(format!(
                "an array of the shape {:?}, but it must be (frames, 3, markers) or (frames, markers, 3)",
                grid.shape
            ));
        }
    };
    let at = |frame: usize, marker: usize, axis: usize| {
        grid.values[frame * 3 * markers + marker * by_marker + axis * by_axis]
    };
    let time = (0..frames).map(|frame| frame as f64 / reading.rate).collect();
    let marker = |f, m| Vector3::new(at(f, m, 0), at(f, m, 1), at(f, m, 2)) * reading.unit;
    Ok((time, (0..frames).map(|f| (0..markers).map(|m| marker(f, m)).collect()).collect()))
}
