//! A prediction as a table: positions of markers over time, and how far off each may be.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use export::{ExportError, write_atomically};

use crate::conformal::Regions;
use crate::predict::Prediction;
use crate::recording::Recording;

/// Writes a prediction of a recording: a row a frame with its time [s], and of each marker that is predicted the position [m] and, if they
/// are known, the radius of its region [m]; it is empty at times of which nothing is known.
///
/// # Errors
/// If the system refuses.
pub fn write(
    path: &Path,
    recording: &Recording,
    free: &[usize],
    prediction: &Prediction,
    regions: Option<&Regions>,
) -> Result<(), ExportError> {
    let mut text = "time_s".to_owned();
    for marker in free {
        let _ = write!(text, ",m{marker}_x_m,m{marker}_y_m,m{marker}_z_m");
        if let Some(regions) = regions {
            let _ = write!(text, ",m{marker}_radius_{}_m", 100.0 * regions.coverage);
        }
    }
    for (&time, markers) in recording.time.iter().zip(&prediction.markers) {
        let _ = write!(text, "\n{time:.6}");
        for (k, marker) in markers.iter().enumerate() {
            let _ = write!(text, ",{:.6},{:.6},{:.6}", marker.x, marker.y, marker.z);
            if let Some(regions) = regions {
                text.push(',');
                if let Some(radius) = regions.radius(time, k) {
                    let _ = write!(text, "{radius:.6}");
                }
            }
        }
    }
    text.push('\n');
    write_atomically(path, |out| out.write_all(text.as_bytes()))
}
