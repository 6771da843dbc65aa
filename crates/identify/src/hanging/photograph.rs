//! Photographed shapes, read from files.

use std::path::{Path, PathBuf};

use nalgebra::Vector2;
use thiserror::Error;

/// Fewest points of a shape.
const FEWEST: usize = 5;
/// A wire's length that can be [m].
const LENGTHS: [f64; 2] = [0.01, 100.0];

/// The shape of a wire that hangs in a vertical plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Photograph {
    /// The file.
    pub path: PathBuf,
    /// Places [m], horizontal and up, in order along the wire, the first and the last at the grips.
    pub points: Vec<Vector2<f64>>,
}

/// What is wrong with a file.
#[derive(Debug, Error)]
#[error("{}: {message}", .path.display())]
pub struct PhotographError {
    path: PathBuf,
    message: String,
}

impl Photograph {
    /// Length along the points [m].
    pub fn length(&self) -> f64 {
        self.points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }
}

/// Reads a shape: a CSV file with the columns `x_m` and `z_m` (up), a row a point.
///
/// # Errors
/// If it cannot be read, has other columns, no numbers, fewer than 5 points, two points at one place one after the other, or a
/// length outside 0.01 to 100 m.
pub fn read(path: &Path) -> Result<Photograph, PhotographError> {
    let fault = |message: String| PhotographError { path: path.to_owned(), message };
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(|e| fault(e.to_string()))?;
    let header = table.headers().map_err(|error| fault(error.to_string()))?;
    if header.iter().collect::<Vec<_>>() != ["x_m", "z_m"] {
        return Err(fault("its columns must be x_m and z_m".to_owned()));
    }
    let mut points = Vec::new();
    for (row, record) in table.records().enumerate() {
        let record = record.map_err(|error| fault(error.to_string()))?;
        let number = |text: &str| text.parse().ok().filter(|x: &f64| x.is_finite());
        let cell = |k: usize| {
            let text = record.get(k).unwrap_or_default();
            number(text).ok_or_else(|| fault(format!("point {row}: {text:?} must be a finite number")))
        };
        points.push(Vector2::new(cell(0)?, cell(1)?));
    }
    if points.len() < FEWEST {
        return Err(fault(format!("{} points, but there must be {FEWEST} or more", points.len())));
    }
    if let Some(place) = points.windows(2).position(|pair| pair[0] == pair[1]) {
        return Err(fault(format!("points {place} and {} are the same", place + 1)));
    }
    let photograph = Photograph { path: path.to_owned(), points };
    let [least, most] = LENGTHS;
    if !(least..=most).contains(&photograph.length()) {
        return Err(fault(format!("a wire {} m long, but it must be {least} to {most} m", photograph.length())));
    }
    Ok(photograph)
}
