//! The files of `--out`.

use std::path::Path;

use anyhow::{Result, bail};
use export::{
    Format, TrajectoryInfo, TrajectoryReader, TrajectoryWriter, write_centreline, write_format, write_json,
    write_snapshots,
};
use scene::Scene;
use serde::Serialize;

use crate::plots;

/// Files that are written beside the trajectory.
const CENTRELINE: &str = "centreline.csv";
const SNAPSHOTS: &str = "snapshots.svg";
const SUMMARY: &str = "summary.json";
/// A run as the player knows it, for `simulate view`, and the page that plays it.
pub(crate) const RUN: &str = "view.json";
pub(crate) const PAGE: &str = "view.html";

/// Which files a run leaves, and where.
#[derive(Clone, Copy)]
pub(crate) struct Wanted<'a> {
    pub(crate) directory: &'a Path,
    /// Whether the player's page is wanted.
    pub(crate) view: bool,
    /// Whether plots are wanted.
    pub(crate) plot: bool,
    /// Files for other programs.
    pub(crate) formats: &'a [Format],
}

impl<'a> Wanted<'a> {
    /// The trajectory and what always stands beside it.
    pub(crate) fn plain(directory: &'a Path) -> Self {
        Self { directory, view: false, plot: false, formats: &[] }
    }

    /// Whether the trajectory keeps what joints transmit.
    pub(crate) fn keeps_forces(&self) -> bool {
        !self.formats.is_empty()
    }
}

/// The trajectory with the forces of so many `joints`, its first frame written, after a look at whether the other files can
/// follow.
pub(crate) fn open(wanted: &Wanted<'_>, scene: &Scene, dt: f64, joints: usize) -> Result<TrajectoryWriter> {
    let info = TrajectoryInfo { scene: scene.name.clone(), dt };
    let mut writer = TrajectoryWriter::create(wanted.directory, scene.state.len(), joints, info)?;
    let always = [CENTRELINE, SNAPSHOTS, SUMMARY];
    let of_view = [RUN, PAGE].into_iter().filter(|_| wanted.view);
    let of_plots = plots::FILES.into_iter().filter(|_| wanted.plot);
    for file in always.into_iter().chain(of_view).chain(of_plots) {
        let path = wanted.directory.join(file);
        if path.is_dir() {
            bail!("cannot write {}: is a directory", path.display());
        }
    }
    writer.push(&scene.state, &vec![rod::JointForce::default(); joints], 0.0)?;
    Ok(writer)
}

/// Finishes the trajectory and writes what stands beside it. Returns the files' names.
pub(crate) fn close(
    writer: TrajectoryWriter,
    wanted: &Wanted<'_>,
    scene: &Scene,
    summary: &impl Serialize,
) -> Result<Vec<String>> {
    let directory = wanted.directory;
    let trajectory = writer.finish()?;
    let mut reader = TrajectoryReader::open(&trajectory)?;
    write_centreline(&directory.join(CENTRELINE), &mut reader, &scene.model.segments)?;
    write_snapshots(&directory.join(SNAPSHOTS), &mut reader, &scene.model)?;
    write_json(&directory.join(SUMMARY), summary)?;
    let mut written = vec![trajectory];
    written.extend([CENTRELINE, SNAPSHOTS, SUMMARY].map(|name| directory.join(name)));
    for &format in wanted.formats {
        written.extend(write_format(format, directory, &mut reader, &scene.model)?);
    }
    let name = |path: &std::path::PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(written.iter().map(name).collect())
}
