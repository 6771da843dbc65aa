//! The files of `--out`.

use std::path::Path;

use anyhow::{Result, bail};
use export::{TrajectoryInfo, TrajectoryReader, TrajectoryWriter, write_centreline, write_json, write_snapshots};
use scene::Scene;
use serde::Serialize;

/// Files that are written beside the trajectory.
const CENTRELINE: &str = "centreline.csv";
const SNAPSHOTS: &str = "snapshots.svg";
const SUMMARY: &str = "summary.json";

/// The trajectory in `directory`, its first frame written, after a look at whether the other files can follow.
pub(crate) fn open(directory: &Path, scene: &Scene, dt: f64) -> Result<TrajectoryWriter> {
    let info = TrajectoryInfo { scene: scene.name.clone(), dt };
    let mut writer = TrajectoryWriter::create(directory, scene.state.len(), 0, info)?;
    for file in [CENTRELINE, SNAPSHOTS, SUMMARY] {
        let path = directory.join(file);
        if path.is_dir() {
            bail!("cannot write {}: is a directory", path.display());
        }
    }
    writer.push(&scene.state, &[], 0.0)?;
    Ok(writer)
}

/// Finishes the trajectory and writes what stands beside it.
pub(crate) fn close(writer: TrajectoryWriter, directory: &Path, scene: &Scene, summary: &impl Serialize) -> Result<()> {
    let mut reader = TrajectoryReader::open(&writer.finish()?)?;
    write_centreline(&directory.join(CENTRELINE), &mut reader, &scene.model.segments)?;
    write_snapshots(&directory.join(SNAPSHOTS), &mut reader, &scene.model.segments)?;
    write_json(&directory.join(SUMMARY), summary)?;
    Ok(())
}
