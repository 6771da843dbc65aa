//! The centreline as a table, for spreadsheets and plots.

use std::io::Write;
use std::path::Path;

use rod::{Segment, State};

use crate::file::write_atomically;
use crate::{ExportError, Names, TrajectoryReader};

/// Writes the segments' centres over time as CSV with the columns
/// `frame,time_s,rod,rod_name,segment,segment_of_rod,x_m,y_m,z_m`, one row for
/// each segment of each frame, holding one frame in memory. Numbers keep all their digits.
///
/// # Errors
/// [`ExportError::Segments`] if `segments` are not the trajectory's; [`ExportError::Io`] if the table cannot be written
/// or the trajectory not be read.
pub fn write_centreline(
    path: &Path,
    trajectory: &mut TrajectoryReader,
    segments: &[Segment],
    names: &Names,
) -> Result<(), ExportError> {
    trajectory.expect_segments(segments.len())?;
    let mut state = State::default();
    let heads = names.rows(segments);
    write_atomically(path, |writer| {
        writeln!(writer, "frame,time_s,rod,rod_name,segment,segment_of_rod,x_m,y_m,z_m")?;
        for frame in 0..trajectory.frames() {
            let time = trajectory.read_frame(frame, &mut state).map_err(std::io::Error::other)?;
            for (head, x) in heads.iter().zip(&state.positions) {
                writeln!(writer, "{frame},{time:?},{head},{:?},{:?},{:?}", x.x, x.y, x.z)?;
            }
        }
        Ok(())
    })
}
