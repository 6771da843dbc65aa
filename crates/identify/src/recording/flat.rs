//! Pickles of markers in one row: how DEFT has its recordings.

use std::fs;
use std::path::Path;

use nalgebra::Vector3;

use super::check::check_finite;
use super::grid::Grid;
use super::{Reading, Recording, RecordingError, pickle};

/// Fewest frames, and fewest markers.
const FEWEST: usize = 3;

/// Whether a file is a pickle of the shape (3, frames times markers).
pub fn is_flat(path: &Path) -> bool {
    path.extension().is_some_and(|end| end == "pkl")
        && fs::read(path).is_ok_and(|bytes| pickle::read(&bytes).is_ok_and(|grid| axes(&grid).is_some()))
}

/// Reads a pickle of the shape (3, frames times markers): in each axis the markers of the first frame, then those of the second, and
/// so on, with y up. Recordings come with x forth, y to the left and z up, which are -z, -x and y of the file. This is the layout of
/// Chen et al., "Differentiable Branched Discrete Elastic Rods" (DEFT, 2025), whose data set it names.
///
/// How many markers there are is not in the file: it is the number by which entries must be apart for the markers to move least.
///
/// # Errors
/// With the file if it is no such pickle, and the frame and the marker where a coordinate is infinite.
pub fn read_flat(path: &Path, reading: Reading) -> Result<Recording, RecordingError> {
    let wrong = |message: String| RecordingError::new(path, message);
    let bytes = fs::read(path).map_err(|error| wrong(error.to_string()))?;
    let grid = pickle::read(&bytes).map_err(wrong)?;
    let axes = axes(&grid).ok_or_else(|| {
        wrong(format!("an array of the shape {:?}, but it must be (3, frames times markers)", grid.shape))
    })?;
    let count = markers(&axes).ok_or_else(|| {
        wrong(format!(
            "{} positions, but they must be {FEWEST} frames or more of {FEWEST} markers or more",
            axes[0].len()
        ))
    })?;
    let position = |k: usize| Vector3::new(-axes[2][k], -axes[0][k], axes[1][k]) * reading.unit;
    let frames = axes[0].len() / count;
    let row = |frame: usize| (0..count).map(|marker| position(frame * count + marker)).collect();
    let time = (0..frames).map(|frame| frame as f64 / reading.rate).collect();
    let recording = Recording { path: path.to_owned(), time, markers: (0..frames).map(row).collect() };
    check_finite(&recording)?;
    Ok(recording)
}

/// The three axes of a grid of that shape.
fn axes(grid: &Grid) -> Option<[&[f64]; 3]> {
    let shape: Vec<usize> = grid.shape.iter().copied().skip_while(|&size| size == 1).collect();
    let &[3, count] = &shape[..] else { return None };
    if count == 0 {
        return None;
    }
    let mut axes = grid.values.chunks(count);
    Some([axes.next()?, axes.next()?, axes.next()?])
}

/// The number of markers: the least of which a frame differs from the one before hardly more than with any other number.
fn markers(axes: &[&[f64]; 3]) -> Option<usize> {
    let all = axes[0].len();
    let way = |count: usize| {
        let change = |axis: &&[f64]| -> f64 {
            axis[count..]
                .iter()
                .zip(*axis)
                .map(|(after, before)| (after - before).abs())
                .filter(|x| x.is_finite())
                .sum()
        };
        axes.iter().map(change).sum::<f64>() / (all - count) as f64
    };
    let counts = (FEWEST..=all / FEWEST).filter(|count| all.is_multiple_of(*count));
    let ways: Vec<(usize, f64)> = counts.map(|count| (count, way(count))).collect();
    let least = ways.iter().map(|(_, way)| *way).fold(f64::INFINITY, f64::min);
    ways.iter().find(|(_, way)| *way <= 2.0 * least).map(|(count, _)| *count)
}
