//! A run's folder and the files in it.

use std::path::{Path, PathBuf};

use anyhow::{Error, Result, anyhow};
use export::{
    Format, Names, RunFolder, TableWriter, TrajectoryInfo, TrajectoryReader, TrajectoryWriter, csv_field,
    write_centreline, write_format, write_json, write_probes, write_snapshots,
};
use rod::{Model, Part, Probe};
use scene::Scene;
use serde::Serialize;
use solver::simulation::{ContactForce, Touched};
use view::Recorder;

use crate::going_on::{SNAPSHOT, hash_of_segments};
use crate::kept_scene::KeptScene;
use crate::plots;

/// What every run with a folder writes.
pub(crate) const TRAJECTORY: &str = "trajectory.safetensors";
const CENTRELINE: &str = "centreline.csv";
const SNAPSHOTS: &str = "snapshots.svg";
pub(crate) const SUMMARY: &str = "summary.json";
const PROBES: &str = "probes.csv";
/// Of equilibria along a course.
pub(crate) const PATH: &str = "path.csv";
/// Of natural modes.
pub(crate) const MODES: &str = "modes.csv";
pub(crate) const ENVELOPE: &str = "envelope.csv";
const CONTACTS: &str = "contacts.csv";
const CONTACT_COLUMNS: &str = "frame,time_s,segment,segment_name,other,other_name,x_m,y_m,z_m,normal_x,normal_y,normal_z,\
                               force_x_n,force_y_n,force_z_n,slip_x_m,slip_y_m,slip_z_m";
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
    /// Whether a table of contacts is wanted.
    pub(crate) contact_forces: bool,
    /// Whether a table of the extremes of each segment is wanted.
    pub(crate) envelope: bool,
    /// Whether a snapshot of the end is wanted.
    pub(crate) snapshot: bool,
    /// Files for other programs.
    pub(crate) formats: &'a [Format],
    /// Where quantities are read.
    pub(crate) probes: &'a [Probe],
    /// A table of a static analysis, which is written at its end.
    pub(crate) table: Option<&'static str>,
    /// The rods that are drawn and tabulated, by number; `None`: all.
    pub(crate) rods: Option<Vec<usize>>,
}

impl Wanted<'_> {
    /// The trajectory and what always stands beside it.
    pub(crate) fn plain(directory: &Path) -> Self {
        Self {
            directory: directory.to_owned(),
            view: false,
            plot: false,
            contact_forces: false,
            envelope: false,
            snapshot: false,
            formats: &[],
            probes: &[],
            table: None,
            rods: None,
        }
    }

    /// The part of the scene's model that is drawn and tabulated, where that is not all of it.
    pub(crate) fn part(&self, model: &Model) -> Option<Part> {
        let rods = self.rods.as_ref()?;
        let is_own = |&i: &usize| rods.contains(&model.segments[i].rod);
        Some(model.part((0..model.segments.len()).filter(is_own).collect()))
    }

    /// Whether the trajectory keeps what joints transmit.
    pub(crate) fn keeps_forces(&self) -> bool {
        !self.formats.is_empty() || self.probes.iter().flat_map(|probe| &probe.quantities).any(|one| one.is_of_step())
    }

    /// Whether the trajectory keeps what contacts give to segments: where reactions may be asked for, and something may touch
    /// what is held.
    pub(crate) fn keeps_contacts(&self, scene: &Scene) -> bool {
        self.keeps_forces() && !scene.model.contacts.is_empty()
    }

    /// All names, in the order in which they are written; folders of frames have a slash at the end.
    fn names(&self, model: &Model) -> Vec<&'static str> {
        let of_plots = plots::FILES.into_iter().filter(|_| self.plot);
        let of_view = [RUN, PAGE].into_iter().filter(|_| self.view);
        let of_probes = [PROBES].into_iter().filter(|_| !self.probes.is_empty());
        let of_contacts = [CONTACTS].into_iter().filter(|_| self.contact_forces);
        let of_envelope = [ENVELOPE].into_iter().filter(|_| self.envelope);
        let of_snapshot = [SNAPSHOT].into_iter().filter(|_| self.snapshot);
        let of_formats = self.formats.iter().flat_map(|format| format.outputs(model));
        let tables = [CENTRELINE]
            .into_iter()
            .chain(self.table)
            .chain(of_probes)
            .chain(of_contacts)
            .chain(of_envelope)
            .chain(of_formats);
        let beside = [SNAPSHOTS].into_iter().chain(of_snapshot).chain(of_plots).chain(of_view).chain(tables);
        [TRAJECTORY].into_iter().chain(beside).chain([SUMMARY]).collect()
    }
}

/// A run's folder with a trajectory in the making.
pub(crate) struct Files<'a> {
    pub(crate) wanted: Wanted<'a>,
    folder: RunFolder,
    pub(crate) writer: TrajectoryWriter,
    contacts: Option<TableWriter>,
    /// What all of the scene is called.
    names: Names,
    scene_file: KeptScene,
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

/// A summary with what the scene's parts are called and what is missing.
#[derive(Serialize)]
struct Account<'a, S> {
    #[serde(flatten)]
    summary: &'a S,
    names: &'a Names,
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

/// What a scene's model, or a part of it, is called in files.
pub(crate) fn names(scene: &Scene, model: &Model) -> Names {
    let rods: Vec<String> = scene.rods.iter().map(|rod| rod.name.clone()).collect();
    Names::new(model, &rods, &scene.obstacles)
}

/// Writes what the player knows of a run, and the page that plays it.
///
/// # Errors
/// If the disk does not take it.
pub(crate) fn write_player(directory: &Path, player: Recorder) -> Result<()> {
    let run = player.finish();
    view::write_run(&directory.join(RUN), &run)?;
    view::write_page(&directory.join(PAGE), &[run])?;
    Ok(())
}

impl<'a> Files<'a> {
    /// Takes the folder, with the forces of so many `joints` in the trajectory, and writes the first frame, at `time` [s].
    ///
    /// # Errors
    /// If the folder is in use or cannot be written to, or something that no run wrote is in the way.
    pub(crate) fn open(wanted: Wanted<'a>, scene: &Scene, dt: f64, joints: usize, time: f64) -> Result<Self> {
        let scene_file = KeptScene::of(scene)?;
        let names_in_folder: Vec<&str> = wanted.names(&scene.model).into_iter().chain(scene_file.names()).collect();
        let folder = RunFolder::take(&wanted.directory, &names_in_folder)?;
        scene_file.write(folder.path())?;
        let segments_hash = Some(hash_of_segments(&scene.model));
        let info = TrajectoryInfo { scene: scene.name.clone(), dt, segments_hash };
        let mut writer = TrajectoryWriter::create(&wanted.directory, scene.state.len(), joints, info)?;
        let contacts = if wanted.keeps_contacts(scene) { scene.state.len() } else { 0 };
        if contacts > 0 {
            writer = writer.keeping_contacts();
        }
        let none = vec![rod::JointForce::default(); joints];
        writer.push_with_contacts(&scene.state, &none, &vec![rod::Wrench::default(); contacts], time)?;
        let contacts = || TableWriter::create(&wanted.directory.join(CONTACTS), CONTACT_COLUMNS);
        let contacts = wanted.contact_forces.then(contacts).transpose()?;
        Ok(Self { wanted, folder, writer, contacts, names: names(scene, &scene.model), scene_file })
    }

    /// Adds what presses on what in the frame that was written last, at `time` [s].
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn add_contacts(&mut self, forces: &[ContactForce], time: f64) -> Result<()> {
        let frame = self.writer.frames() - 1;
        let Some(table) = &mut self.contacts else { return Ok(()) };
        table.add(|writer| {
            for ContactForce { segment, other, place, normal, force, slip } in forces {
                write!(writer, "{frame},{time:?},{segment},{},", csv_field(&self.names.segment(*segment)))?;
                match other {
                    Touched::Segment(i) => write!(writer, "{i},{}", csv_field(&self.names.segment(*i)))?,
                    Touched::Obstacle(i) => write!(writer, "obstacle {i},{}", csv_field(&self.names.obstacle(*i)))?,
                }
                for value in place.iter().chain(normal).chain(force).chain(slip) {
                    write!(writer, ",{value:?}")?;
                }
                writeln!(writer)?;
            }
            Ok(())
        })?;
        Ok(())
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
            Ok(trajectory) => {
                let contacts = self.contacts.take().map_or(Ok(()), TableWriter::finish).map_err(Error::from);
                (frames_computed, contacts.and_then(|()| self.write_beside(&trajectory, scene, more)).err())
            }
            Err(refused) => (self.writer.salvage().map_or(0, |(_, frames)| frames), Some(refused)),
        };
        let names = self.wanted.names(&scene.model).into_iter().chain(self.scene_file.names()).map(str::to_owned);
        let exists = |name: &String| name == SUMMARY || self.wanted.directory.join(name.trim_end_matches('/')).exists();
        let (written, missing): (Vec<String>, Vec<String>) = names.partition(exists);
        let incomplete = refused.as_ref().map(|why| Incomplete {
            why: format!("{why:#}"),
            frames,
            frames_computed,
            missing: missing.clone(),
        });
        let directory = self.folder.path().to_owned();
        write_json(&directory.join(SUMMARY), &Account { summary, names: &self.names, incomplete })?;
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
        let mut reader = TrajectoryReader::open(trajectory)?;
        if !self.wanted.probes.is_empty() {
            write_probes(&directory.join(PROBES), &mut reader, &scene.model, self.wanted.probes)?;
        }
        let part = self.wanted.part(&scene.model);
        if let Some(part) = &part {
            reader.only(&part.segments, &part.joints);
        }
        let model = part.as_ref().map_or(&scene.model, |part| &part.model);
        let names = names(scene, model);
        write_snapshots(&directory.join(SNAPSHOTS), &mut reader, model)?;
        more(directory)?;
        write_centreline(&directory.join(CENTRELINE), &mut reader, &model.segments, &names)?;
        for &format in self.wanted.formats {
            write_format(format, directory, &mut reader, model, &names)?;
        }
        Ok(())
    }
}
