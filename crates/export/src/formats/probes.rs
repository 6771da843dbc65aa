//! What probes read over time, as a table.

use std::io::Write;
use std::path::Path;

use rod::{Model, Probe, Quantity, Reaction, Reading, State};

use super::csv::each_frame;
use crate::file::write_atomically;
use crate::{ExportError, TrajectoryReader};

/// Writes what `probes` read as CSV: `frame,time_s`, then for each probe its quantities' columns, named `PROBE.COLUMN`
/// ([`Quantity::columns`]); one row for each frame, numbers with all their digits. What is of a step is empty in the first
/// frame, and where the trajectory has no forces of joints; reactions take accelerations from frame to frame.
///
/// # Errors
/// [`ExportError::Segments`] or [`ExportError::Joints`] if the trajectory is not one of `model`; [`ExportError::Io`] if the
/// table cannot be written or the trajectory not be read.
pub fn write_probes(
    path: &Path,
    trajectory: &mut TrajectoryReader,
    model: &Model,
    probes: &[Probe],
) -> Result<(), ExportError> {
    trajectory.expect_segments(model.segments.len())?;
    trajectory.expect_joints(model.joints.len())?;
    let holds = probes.iter().any(|probe| probe.quantities.contains(&Quantity::Reaction));
    write_atomically(path, |writer| {
        write!(writer, "frame,time_s")?;
        for probe in probes {
            for column in probe.quantities.iter().flat_map(|quantity| quantity.columns()) {
                write!(writer, ",{}.{column}", probe.name)?;
            }
        }
        writeln!(writer)?;
        let (mut before, mut values): (Option<(f64, State)>, _) = (None, Vec::new());
        each_frame(trajectory, model, |index, frame, model| {
            let mut reactions = Vec::new();
            let forces = if before.is_some() { frame.forces.as_slice() } else { &[] };
            if let Some((time, state)) = before.as_ref().filter(|_| holds && !forces.is_empty()) {
                reactions = Reaction::all(model, [state, &frame.state], [*time, frame.time], forces, &frame.contacts);
            }
            write!(writer, "{index},{:?}", frame.time)?;
            for probe in probes {
                let now = Reading { model, time: frame.time, state: &frame.state, forces, reactions: &reactions };
                probe.read(&now, &mut values);
                for value in &values {
                    if value.is_nan() { write!(writer, ",")? } else { write!(writer, ",{value:?}")? }
                }
            }
            // Of states, reactions alone ask for the one before.
            before = Some((frame.time, if holds { frame.state.clone() } else { State::default() }));
            writeln!(writer)
        })
    })
}
