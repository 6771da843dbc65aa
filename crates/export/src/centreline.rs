//! The centreline as a table, for spreadsheets and plots.

use std::io::Write;
use std::path::Path;

use rod::{Segment, State};

use crate::file::write_atomically;
use crate::{ExportError, TrajectoryReader};

/// Writes the segments' centres over time as CSV with the columns `frame,time_s,rod,segment,x_m,y_m,z_m`, one row for
/// each segment of each frame, holding one frame in memory. Numbers keep all their digits.
///
/// # Errors
/// [`ExportError::Segments`] if `segments` are not the trajectory's; [`ExportError::Io`] if the table cannot be written
/// or the trajectory not be read.
pub fn write_centreline(
    path: &Path,
    trajectory: &mut TrajectoryReader,
    segments: &[Segment],
) -> Result<(), ExportError> {
    trajectory.expect_segments(segments.len())?;
    let mut state = State::default();
    write_atomically(path, |writer| {
        writeln!(writer, "frame,time_s,rod,segment,x_m,y_m,z_m")?;
        for frame in 0..trajectory.frames() {
            let time = trajectory.read_frame(frame, &mut state).map_err(std::io::Error::other)?;
            for (i, (segment, x)) in segments.iter().zip(&state.positions).enumerate() {
                writeln!(writer, "{frame},{time:?},{},{i},{:?},{:?},{:?}", segment.rod, x.x, x.y, x.z)?;
            }
        }
        Ok(())
    })
}
