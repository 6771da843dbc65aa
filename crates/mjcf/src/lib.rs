//! MuJoCo's XML files (MJCF) as scene files: `composite` cables with the plugin `mujoco.elasticity.cable`, and what holds and
//! touches them.
//!
//! A file is read in three stages: `xml` makes one tree of it and of what it includes, in which every attribute knows its file
//! and line; `world` goes through the bodies with the classes of `defaults` and collects geoms, joints and cables in world
//! axes; `plan` says what holds and joins them, and `scene` writes rods, grips, joins, bodies and obstacles as TOML. An attribute or an
//! element is read, or named in a warning where it changes looks or the motion's damping alone, or refused. `docs/mjcf.md` has the
//! table. This crate knows neither solver nor scene: it writes text.
//!
//! Sources: MuJoCo's XML reference, and Bergou et al., Discrete Elastic Rods (2008), whose curvatures the plugin takes.

mod cable;
mod contact;
mod converted;
mod defaults;
mod equality;
mod error;
mod geom;
mod option;
mod plan;
mod pose;
mod scene;
mod toml;
mod world;
mod xml;

use std::path::Path;

pub use converted::Converted;
pub use error::MjcfError;

use error::Result;

/// Writes the MJCF `text` of the file `path` as a scene file that stands in the same folder. Files that it includes are read, seen
/// from that folder.
///
/// # Errors
/// The first thing found that is wrong, or that a scene cannot express.
pub fn convert(text: &str, path: &Path) -> Result<Converted> {
    convert_for(text, path, Path::new(""))
}

/// As [`convert`], for a scene file in another folder, from which the folder of the MJCF file is seen as `folder`.
///
/// # Errors
/// As [`convert`].
pub fn convert_for(text: &str, path: &Path, folder: &Path) -> Result<Converted> {
    let root = xml::read(text, path)?;
    let world = world::World::read(&root)?;
    scene::write(&world, path, folder)
}
