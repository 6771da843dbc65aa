//! A recorded run in the formats of other programs.

use std::fs;
use std::path::{Path, PathBuf};

use rod::Model;

use crate::{ExportError, Names, TrajectoryReader};

mod centrelines;
mod csv;
mod envelope;
mod format;
mod frame;
mod glb;
mod obj;
mod probes;
mod solids;
mod usda;
mod vtp;

pub use envelope::Envelope;
pub use format::Format;
pub use probes::write_probes;

/// Writes a trajectory of `model`, whose parts have these `names`, into `directory`, which is created if it does not exist, and returns the files and
/// folders made. One frame is in memory at a time (of `glb`, some tens of MiB). What an earlier export left is replaced
/// when the new files are complete.
///
/// World axes and units are the trajectory's (SI); `glb` turns z up into glTF's y up. Obstacles are where the model has
/// them at the times of the frames; planes are squares as large as the scene.
///
/// # Errors
/// [`ExportError::Segments`] or [`ExportError::Joints`] if the trajectory is not one of `model`;
/// [`ExportError::Format`] if the format cannot hold it; [`ExportError::Io`] if the trajectory cannot be read or the
/// files cannot be written, or if a file or folder is in the way that no export wrote. Then nothing is left behind, and
/// files that were there stay.
pub fn write_format(
    format: Format,
    directory: &Path,
    trajectory: &mut TrajectoryReader,
    model: &Model,
    names: &Names,
) -> Result<Vec<PathBuf>, ExportError> {
    trajectory.expect_segments(model.segments.len())?;
    trajectory.expect_joints(model.joints.len())?;
    fs::create_dir_all(directory).map_err(ExportError::io("create the directory", directory))?;
    match format {
        Format::Vtp => vtp::write(directory, trajectory, model, names),
        Format::Glb => glb::write(directory, trajectory, model, names),
        Format::Csv => csv::write(directory, trajectory, model, names),
        Format::Obj => obj::write(directory, trajectory, model, names),
        Format::Usda => usda::write(directory, trajectory, model, names),
    }
}
