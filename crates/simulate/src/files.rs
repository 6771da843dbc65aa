//! A run's folder and the files in it.

use std::path::{Path, PathBuf};

use anyhow::{Error, Result, anyhow};
use cosserat::live::Recording;
use cosserat::motion::Wrench;
use cosserat::scene::Scene;
use cosserat::simulation::{ContactForce, Snapshot, Touched};
use cosserat::state::{JointForce, Model, OnPulley, Part, Probe, Sliding, State};
use export::{
    Format, Names, RunFolder, TableWriter, TrajectoryInfo, TrajectoryReader, TrajectoryWriter, csv_field, write_format,
    write_json, write_probes, write_snapshots,
};
use serde::Serialize;
use terminal::Progress;
use view::Recorder;

use crate::breaks::BREAKS;
use crate::going_on::{Label, SNAPSHOT, hash_of_segments, write_snapshot};
use crate::kept_scene::KeptScene;

/// The motion, exactly.
pub(crate) const TRAJECTORY: &str = "trajectory.safetensors";
/// A picture of the motion.
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
const EYELETS: &str = "eyelets.csv";
const EYELET_COLUMNS: &str = "frame,time_s,eyelet,place_m,rate_m_s,force_x_n,force_y_n,force_z_n";
const PULLEYS: &str = "pulleys.csv";
const PULLEY_COLUMNS: &str =
    "frame,time_s,pulley,wrap_rad,turned_rad,rate_rad_s,force_x_n,force_y_n,force_z_n,torque_n_m";
/// What was done in a live view.
pub(crate) const INPUT: &str = "live-input.json";
/// A run as the player knows it, for `simulate view`, and the page that plays it.
pub(crate) const RUN: &str = "view.json";
pub(crate) const PAGE: &str = "view.html";

/// Which files a run leaves, and where.
pub(crate) struct Wanted<'a> {
    pub(crate) directory: PathBuf,
    /// Whether the trajectory is wanted.
    pub(crate) trajectory: bool,
    /// Whether the player's page is wanted.
    pub(crate) view: bool,
    /// The plots that are wanted.
    pub(crate) plots: &'static [&'static str],
    /// Whether a table of contacts is wanted.
    pub(crate) contact_forces: bool,
    /// Names of the eyelets, of which there is a table.
    pub(crate) eyelets: &'a [String],
    /// Names of the pulleys, of which there is a table.
    pub(crate) pulleys: &'a [String],
    /// Whether a table of the joints that break is wanted.
    pub(crate) breaks: bool,
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
    /// What was done in a live view, which is kept.
    pub(crate) input: Option<&'a Recording>,
}

impl Wanted<'_> {
    /// The trajectory and the summary.
    pub(crate) fn plain(directory: &Path) -> Self {
        Self {
            directory: directory.to_owned(),
            trajectory: true,
            view: false,
            plots: &[],
            contact_forces: false,
            eyelets: &[],
            pulleys: &[],
            breaks: false,
            envelope: false,
            snapshot: false,
            formats: &[],
            probes: &[],
            table: None,
            rods: None,
            input: None,
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

    /// Whether something is made of the whole motion, which goes through a trajectory on the disk.
    fn needs_motion(&self) -> bool {
        self.trajectory || !self.plots.is_empty() || !self.formats.is_empty() || !self.probes.is_empty()
    }

    /// All names, in the order in which they are written; folders of frames have a slash at the end. A trajectory that is not
    /// wanted but needed for others is among them.
    fn names(&self, model: &Model) -> Vec<&'static str> {
        let of_motion = [TRAJECTORY].into_iter().filter(|_| self.needs_motion());
        let of_plots = [SNAPSHOTS].iter().chain(self.plots).copied().filter(|_| !self.plots.is_empty());
        let of_view = [RUN, PAGE].into_iter().filter(|_| self.view);
        let of_probes = [PROBES].into_iter().filter(|_| !self.probes.is_empty());
        let of_contacts = [CONTACTS].into_iter().filter(|_| self.contact_forces);
        let of_eyelets = [EYELETS].into_iter().filter(|_| !self.eyelets.is_empty());
        let of_pulleys = [PULLEYS].into_iter().filter(|_| !self.pulleys.is_empty());
        let of_breaks = [BREAKS].into_iter().filter(|_| self.breaks);
        let of_envelope = [ENVELOPE].into_iter().filter(|_| self.envelope);
        let of_snapshot = [SNAPSHOT].into_iter().filter(|_| self.snapshot);
        let of_input = [INPUT].into_iter().filter(|_| self.input.is_some());
        let of_formats = self.formats.iter().flat_map(|format| format.outputs(model));
        let tables = self
            .table
            .into_iter()
            .chain(of_probes)
            .chain(of_contacts)
            .chain(of_eyelets)
            .chain(of_pulleys)
            .chain(of_breaks)
            .chain(of_envelope)
            .chain(of_formats);
        of_motion
            .chain(of_snapshot)
            .chain(of_input)
            .chain(of_plots)
            .chain(of_view)
            .chain(tables)
            .chain([SUMMARY])
            .collect()
    }
}

/// A run's folder with its files in the making.
pub(crate) struct Files<'a> {
    pub(crate) wanted: Wanted<'a>,
    folder: RunFolder,
    /// Where something needs the motion.
    writer: Option<TrajectoryWriter>,
    /// Frames so far.
    frames: usize,
    contacts: Option<TableWriter>,
    eyelets: Option<TableWriter>,
    pulleys: Option<TableWriter>,
    /// Whether this run has written one.
    has_snapshot: bool,
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
    /// Takes the folder, with the forces of so many `joints` in the trajectory, and takes the first frame, at `time` [s].
    ///
    /// # Errors
    /// If the folder is in use or cannot be written to, or something that no run wrote is in the way.
    pub(crate) fn open(wanted: Wanted<'a>, scene: &Scene, dt: f64, joints: usize, time: f64) -> Result<Self> {
        let scene_file = KeptScene::of(scene)?;
        let own: Vec<&str> = wanted.names(&scene.model).into_iter().chain(scene_file.names()).collect();
        // A run that was killed may go on from its last snapshot until there is another one.
        let folder = RunFolder::take(&wanted.directory, &own, &[SNAPSHOT])?;
        let names = names(scene, &scene.model);
        let (writer, contacts, eyelets, pulleys) = (None, None, None, None);
        let mut files = Self {
            wanted,
            folder,
            writer,
            frames: 0,
            contacts,
            eyelets,
            pulleys,
            has_snapshot: false,
            names,
            scene_file,
        };
        files.begin(scene, dt, joints, time).map_err(|error| files.named(&error))?;
        Ok(files)
    }

    fn begin(&mut self, scene: &Scene, dt: f64, joints: usize, time: f64) -> Result<()> {
        self.scene_file.write(self.folder.path())?;
        if let Some(input) = self.wanted.input {
            write_json(&self.folder.path().join(INPUT), input)?;
        }
        let keeps_contacts = self.wanted.keeps_contacts(scene);
        if self.wanted.needs_motion() {
            let segments_hash = Some(hash_of_segments(&scene.model));
            let info = TrajectoryInfo { scene: scene.name.clone(), dt, segments_hash };
            let writer = TrajectoryWriter::create(self.folder.path(), scene.state.len(), joints, info)?;
            self.writer = Some(if keeps_contacts { writer.keeping_contacts() } else { writer });
        }
        if self.wanted.contact_forces {
            self.contacts = Some(TableWriter::create(&self.folder.path().join(CONTACTS), CONTACT_COLUMNS)?);
        }
        if !self.wanted.eyelets.is_empty() {
            self.eyelets = Some(TableWriter::create(&self.folder.path().join(EYELETS), EYELET_COLUMNS)?);
        }
        if !self.wanted.pulleys.is_empty() {
            self.pulleys = Some(TableWriter::create(&self.folder.path().join(PULLEYS), PULLEY_COLUMNS)?);
        }
        let contacts = vec![Wrench::default(); if keeps_contacts { scene.state.len() } else { 0 }];
        self.push(&scene.state, &vec![JointForce::default(); joints], &contacts, time)
    }

    /// Says that the frames after the first show modes of these `frequencies` [Hz], so many `frames` each.
    pub(crate) fn show_modes(&mut self, frequencies: Vec<f64>, frames: usize) {
        if let Some(writer) = &mut self.writer {
            writer.show_modes(frequencies, frames);
        }
    }

    /// Takes a frame at `time` [s] with what joints transmit, as many as [`Files::open`] was told of, and what contacts give to each
    /// segment, where [`Wanted::keeps_contacts`] says so.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn push(&mut self, state: &State, forces: &[JointForce], contacts: &[Wrench], time: f64) -> Result<()> {
        self.frames += 1;
        if let Some(writer) = &mut self.writer {
            writer.push_with_contacts(state, forces, contacts, time)?;
        }
        Ok(())
    }

    /// Adds what presses on what in the frame that was written last, at `time` [s].
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn add_contacts(&mut self, forces: &[ContactForce], time: f64) -> Result<()> {
        let frame = self.frames - 1;
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

    /// Takes where eyelets are in the frame that was taken last, and what they do.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn add_eyelets(&mut self, sliding: &[Sliding], time: f64) -> Result<()> {
        let frame = self.frames - 1;
        let Some(table) = &mut self.eyelets else { return Ok(()) };
        table.add(|writer| {
            for (name, Sliding { place, rate, force }) in self.wanted.eyelets.iter().zip(sliding) {
                write!(writer, "{frame},{time:?},{},{place:?},{rate:?}", csv_field(name))?;
                force.iter().try_for_each(|value| write!(writer, ",{value:?}"))?;
                writeln!(writer)?;
            }
            Ok(())
        })?;
        Ok(())
    }

    /// Takes where rods are on pulleys in the frame that was taken last, and what these do.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn add_pulleys(&mut self, pulleys: &[OnPulley], time: f64) -> Result<()> {
        let frame = self.frames - 1;
        let Some(table) = &mut self.pulleys else { return Ok(()) };
        table.add(|writer| {
            for (name, OnPulley { wrap, turned, rate, force, torque }) in self.wanted.pulleys.iter().zip(pulleys) {
                write!(writer, "{frame},{time:?},{},{wrap:?},{turned:?},{rate:?}", csv_field(name))?;
                force.iter().try_for_each(|value| write!(writer, ",{value:?}"))?;
                writeln!(writer, ",{torque:?}")?;
            }
            Ok(())
        })?;
        Ok(())
    }

    /// Writes a snapshot from which the run can go on, in the place of the one before.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn write_snapshot(&mut self, label: &Label, snapshot: &Snapshot) -> Result<()> {
        write_snapshot(self.folder.path(), label, snapshot)?;
        self.has_snapshot = true;
        Ok(())
    }

    /// Finishes the trajectory and writes what is made of the motion; `more` writes plots and player. What goes on is told to
    /// `progress`. Where the disk has `refused` frames, or refuses something now, what fits of the trajectory is kept, the
    /// summary says what is missing, and the error says why.
    pub(crate) fn close(
        mut self,
        scene: &Scene,
        summary: &impl Serialize,
        refused: Option<Error>,
        progress: &Progress,
        more: impl FnOnce(&Path) -> Result<()>,
    ) -> Result<Written> {
        let frames_computed = self.frames;
        progress.beside("writing the motion");
        let finished = match (refused, &mut self.writer) {
            (Some(refused), _) => Err(refused),
            (None, Some(writer)) => writer.finish().map(Some).map_err(Error::from),
            (None, None) => Ok(None),
        };
        let (frames, refused) = match finished {
            Ok(trajectory) => {
                let mut tables = [self.contacts.take(), self.eyelets.take(), self.pulleys.take()].into_iter().flatten();
                let tables = tables.try_for_each(TableWriter::finish).map_err(Error::from);
                let beside = tables.and_then(|()| self.write_beside(trajectory.as_deref(), scene, progress, more));
                (trajectory.map_or(0, |_| frames_computed), beside.err())
            }
            Err(refused) => {
                let salvaged = self.writer.take().and_then(|writer| writer.salvage().ok());
                (salvaged.map_or(0, |(_, frames)| frames), Some(refused))
            }
        };
        let place = self.folder.path().to_owned();
        // Where something else is missing, the motion is worth keeping.
        let keeps_trajectory = self.wanted.trajectory || refused.is_some();
        let is_due = |name: &&str| *name != TRAJECTORY || keeps_trajectory;
        let own = self.wanted.names(&scene.model).into_iter().filter(is_due);
        let names = own.chain(self.scene_file.names()).map(str::to_owned);
        let exists = |name: &String| match name.as_str() {
            SUMMARY => true,
            // That of an earlier run may be there.
            SNAPSHOT => self.has_snapshot,
            name => place.join(name.trim_end_matches('/')).exists(),
        };
        let (written, missing): (Vec<String>, Vec<String>) = names.partition(exists);
        let refused = refused.map(|error| format!("{:#}", self.named(&error)));
        let incomplete =
            refused.clone().map(|why| Incomplete { why, frames, frames_computed, missing: missing.clone() });
        let directory = self.folder.directory().to_owned();
        let account = Account { summary, names: &self.names, incomplete };
        write_json(&place.join(SUMMARY), &account).map_err(|error| self.named(&error.into()))?;
        self.folder.finish(&written)?;
        match refused {
            None => Ok(Written { directory, names: written }),
            Some(why) => Err(anyhow!(
                "{why}: {} has {frames} of {frames_computed} frames, without {}",
                directory.display(),
                missing.join(", ")
            )),
        }
    }

    /// An error about a file, as if it had been written where it is in the end.
    fn named(&self, error: &Error) -> Error {
        let [place, end] = [self.folder.path(), self.folder.directory()].map(|path| path.display().to_string());
        anyhow!(format!("{error:#}").replace(&place, &end))
    }

    fn write_beside(
        &self,
        trajectory: Option<&Path>,
        scene: &Scene,
        progress: &Progress,
        more: impl FnOnce(&Path) -> Result<()>,
    ) -> Result<()> {
        let directory = self.folder.path();
        let writing = |what: &str| progress.beside(&format!("writing {what}"));
        if self.wanted.view || !self.wanted.plots.is_empty() {
            writing("the page and pictures");
        }
        more(directory)?;
        let Some(trajectory) = trajectory else { return Ok(()) };
        let mut reader = TrajectoryReader::open(trajectory)?;
        if !self.wanted.probes.is_empty() {
            writing(PROBES);
            write_probes(&directory.join(PROBES), &mut reader, &scene.model, self.wanted.probes)?;
        }
        let part = self.wanted.part(&scene.model);
        if let Some(part) = &part {
            reader.only(&part.segments, &part.joints);
        }
        let model = part.as_ref().map_or(&scene.model, |part| &part.model);
        let names = names(scene, model);
        if !self.wanted.plots.is_empty() {
            write_snapshots(&directory.join(SNAPSHOTS), &mut reader, model)?;
        }
        for &format in self.wanted.formats {
            writing(&format.outputs(model).join(", "));
            write_format(format, directory, &mut reader, model, &names)?;
        }
        Ok(())
    }
}
