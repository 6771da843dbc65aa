//! A run's folder and the files in it.

use std::path::{Path, PathBuf};

use anyhow::{Error, Result, anyhow};
use export::{
    Format, RunFolder, TrajectoryInfo, TrajectoryReader, TrajectoryWriter, write_centreline, write_format, write_json,
    write_snapshots,
};
use scene::Scene;
use serde::Serialize;

use crate::plots;

/// What every run with a folder writes.
pub(crate) const TRAJECTORY: &str = "trajectory.safetensors";
const CENTRELINE: &str = "centreline.csv";
const SNAPSHOTS: &str = "snapshots.svg";
const SUMMARY: &str = "summary.json";
/// A run as the player knows it, for `simulate view`, and the page that plays it.
pub(crate) const RUN: &str = "view.json";
pub(crate) const PAGE: &str = "view.html";

/// Which files a run leaves, and where.
pub(crate) struct Wanted<'a> {
    pub(crate) directory: PathBuf,
    /// Whether the player's page is wanted.
    pub(crate) view: bool,
    /// Whether plots are wanted.
    pub(crate) plot: bool,
    /// Files for other programs.
    pub(crate) formats: &'a [Format],
}

impl Wanted<'_> {
    /// The trajectory and what always stands beside it.
    pub(crate) fn plain(directory: &Path) -> Self {
        Self { directory: directory.to_owned(), view: false, plot: false, formats: &[] }
    }

    /// Whether the trajectory keeps what joints transmit.
    pub(crate) fn keeps_forces(&self) -> bool {
        !self.formats.is_empty()
    }

    /// All names, in the order in which they are written; folders of frames have a slash at the end.
    fn names(&self) -> Vec<&'static str> {
        let of_plots = plots::FILES.into_iter().filter(|_| self.plot);
        let of_view = [RUN, PAGE].into_iter().filter(|_| self.view);
        let of_formats = self.formats.iter().flat_map(|format| format.outputs().iter().copied());
        let beside = [SNAPSHOTS].into_iter().chain(of_plots).chain(of_view).chain([CENTRELINE]).chain(of_formats);
        [TRAJECTORY].into_iter().chain(beside).chain([SUMMARY]).collect()
    }
}

/// A run's folder with a trajectory in the making.
pub(crate) struct Files<'a> {
    pub(crate) wanted: Wanted<'a>,
    folder: RunFolder,
    pub(crate) writer: TrajectoryWriter,
}

/// What a run wrote.
pub(crate) struct Written {
    pub(crate) directory: PathBuf,
    /// Names in the folder.
    pub(crate) names: Vec<String>,
}

impl Written {
    /// The page to open, if there is one.
    pub(crate) fn page(&self) -> Option<PathBuf> {
        self.names.iter().any(|name| name == PAGE).then(|| self.directory.join(PAGE))
    }
}

/// A summary that says what is missing.
#[derive(Serialize)]
struct Account<'a, S> {
    #[serde(flatten)]
    summary: &'a S,
    #[serde(skip_serializing_if = "Option::is_none")]
    incomplete: Option<Incomplete>,
}

/// What the disk did not take.
#[derive(Serialize)]
struct Incomplete {
    /// What the system said.
    why: String,
    /// Frames that the trajectory has.
    frames: usize,
    /// Frames that there were when the run ended.
    frames_computed: usize,
    /// Names of what was not written.
    missing: Vec<String>,
}

impl<'a> Files<'a> {
    /// Takes the folder, with the forces of so many `joints` in the trajectory, and writes the first frame.
    ///
    /// # Errors
    /// If the folder is in use or cannot be written to, or something that no run wrote is in the way.
    pub(crate) fn open(wanted: Wanted<'a>, scene: &Scene, dt: f64, joints: usize) -> Result<Self> {
        let folder = RunFolder::take(&wanted.directory, &wanted.names())?;
        let info = TrajectoryInfo { scene: scene.name.clone(), dt };
        let mut writer = TrajectoryWriter::create(&wanted.directory, scene.state.len(), joints, info)?;
        writer.push(&scene.state, &vec![rod::JointForce::default(); joints], 0.0)?;
        Ok(Self { wanted, folder, writer })
    }

    /// Finishes the trajectory and writes what stands beside it; `more` writes plots and player. Where the disk has
    /// `refused` frames, or refuses something now, what fits of the trajectory is kept, the summary says what is missing,
    /// and the error says why.
    pub(crate) fn close(
        mut self,
        scene: &Scene,
        summary: &impl Serialize,
        refused: Option<Error>,
        more: impl FnOnce(&Path) -> Result<()>,
    ) -> Result<Written> {
        let frames_computed = self.writer.frames();
        let finished = match refused {
            None => self.writer.finish().map_err(Error::from),
            Some(refused) => Err(refused),
        };
        let (frames, refused) = match finished {
            Ok(trajectory) => (frames_computed, self.write_beside(&trajectory, scene, more).err()),
            Err(refused) => (self.writer.salvage().map_or(0, |(_, frames)| frames), Some(refused)),
        };
        let names = self.wanted.names().into_iter().map(str::to_owned);
        let exists = |name: &String| name == SUMMARY || self.wanted.directory.join(name.trim_end_matches('/')).exists();
        let (written, missing): (Vec<String>, Vec<String>) = names.partition(exists);
        let incomplete = refused.as_ref().map(|why| Incomplete {
            why: format!("{why:#}"),
            frames,
            frames_computed,
            missing: missing.clone(),
        });
        let directory = self.folder.path().to_owned();
        write_json(&directory.join(SUMMARY), &Account { summary, incomplete })?;
        self.folder.finish(&written)?;
        match refused {
            None => Ok(Written { directory, names: written }),
            Some(why) => Err(anyhow!(
                "{why:#}: {} has {frames} of {frames_computed} frames, without {}",
                directory.display(),
                missing.join(", ")
            )),
        }
    }

    fn write_beside(&self, trajectory: &Path, scene: &Scene, more: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let directory = self.folder.path();
        let segments = &scene.model.segments;
        let mut reader = TrajectoryReader::open(trajectory)?;
        write_snapshots(&directory.join(SNAPSHOTS), &mut reader, &scene.model)?;
        more(directory)?;
        write_centreline(&directory.join(CENTRELINE), &mut reader, segments)?;
        for &format in self.wanted.formats {
            write_format(format, directory, &mut reader, &scene.model)?;
        }
        Ok(())
    }
}
