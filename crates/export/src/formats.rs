//! A recorded run in the formats of other programs.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use names::names;
use rod::{JointForce, Model, State, Wrench};

use crate::{ExportError, Names, TrajectoryReader};

mod centrelines;
mod csv;
mod envelope;
mod glb;
mod obj;
mod probes;
mod solids;
mod usda;
mod vtp;

pub use envelope::Envelope;
pub use probes::write_probes;

/// A format of other programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// ParaView and VTK: `vtp/` with one file a frame, `obstacles.vtp` with the obstacles that never move, and `run.pvd`,
    /// which lists them with their times.
    Vtp,
    /// Blender, browsers and game engines: binary glTF 2.0, `run.glb`, a skinned tube a rod, meshes of rigid bodies and
    /// obstacles, and the animation of all.
    Glb,
    /// Spreadsheets and scripts: the tables `segments.csv`, `joints.csv` and `reactions.csv`, with obstacles
    /// `obstacles.csv`.
    Csv,
    /// Anything with lines: `obj/` with one file a frame, of polylines and of meshes of rigid bodies and obstacles.
    Obj,
    /// Blender, Houdini, Omniverse and other programs that read OpenUSD: `run.usda`, curves with widths for rods, meshes of rigid
    /// bodies and obstacles, and the motion of all as time samples.
    Usda,
}

names!(Format { Vtp = "vtp", Glb = "glb", Csv = "csv", Obj = "obj", Usda = "usda" });

impl Format {
    /// What [`write_format`] makes of a run of `model`: names of files, and of folders of frames with a slash at the end.
    pub fn outputs(self, model: &Model) -> Vec<&'static str> {
        let obstacles = &model.contacts.obstacles;
        let has_still = obstacles.iter().any(|obstacle| obstacle.motion.is_none());
        let (files, more): (&[_], _) = match self {
            Format::Vtp => (&["vtp/", "run.pvd"], has_still.then_some(vtp::STILL)),
            Format::Glb => (&["run.glb"], None),
            Format::Csv => (
                &["segments.csv", "joints.csv", "reactions.csv"],
                (!obstacles.is_empty()).then_some(csv::OBSTACLES_FILE),
            ),
            Format::Obj => (&["obj/"], None),
            Format::Usda => (&[usda::FILE], None),
        };
        files.iter().copied().chain(more).collect()
    }
}

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

/// A frame of a trajectory.
#[derive(Default)]
struct Frame {
    /// Time [s].
    time: f64,
    state: State,
    /// The mode that it shows, number and frequency [Hz], if it shows one.
    mode: Option<(usize, f64)>,
    /// What each joint transmits; empty where that was not kept.
    forces: Vec<JointForce>,
    /// What contacts give to each segment; empty where that was not kept.
    contacts: Vec<Wrench>,
}

impl Frame {
    /// Makes what of a model changes over time that of this frame.
    fn set_time(&self, model: &mut Cow<'_, Model>) {
        if model.varies() {
            model.to_mut().set_time(self.time);
        }
    }

    /// Reads frame `index` in place of the last one.
    fn read(&mut self, trajectory: &mut TrajectoryReader, index: usize) -> Result<(), ExportError> {
        self.time = trajectory.read_frame(index, &mut self.state)?;
        self.mode = trajectory.mode(index);
        trajectory.read_forces(index, &mut self.forces)?;
        trajectory.read_contacts(index, &mut self.contacts)
    }
}
