//! The formats by name, and the files of each.

use names::names;
use rod::Model;

/// Obstacles that never move, which are written once.
pub(super) const STILL: &str = "obstacles.vtp";
/// The table of obstacles, only where there are some.
pub(super) const OBSTACLES_FILE: &str = "obstacles.csv";

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
    /// What [`crate::write_format`] makes of a run of `model`: names of files, and of folders of frames with a slash at the end.
    pub fn outputs(self, model: &Model) -> Vec<&'static str> {
        let obstacles = &model.contacts.obstacles;
        let has_still = obstacles.iter().any(|obstacle| obstacle.motion.is_none());
        let (files, more): (&[_], _) = match self {
            Format::Vtp => (&["vtp/", "run.pvd"], has_still.then_some(STILL)),
            Format::Glb => (&["run.glb"], None),
            Format::Csv => {
                (&["segments.csv", "joints.csv", "reactions.csv"], (!obstacles.is_empty()).then_some(OBSTACLES_FILE))
            }
            Format::Obj => (&["obj/"], None),
            Format::Usda => (&["run.usda"], None),
        };
        files.iter().copied().chain(more).collect()
    }
}
