//! The files of equilibria: a frame each, after that of the start.

use std::path::{Path, PathBuf};

use anyhow::{Error, Result};
use chart::Conditions;
use cosserat::scene::Scene;
use cosserat::simulation::{ContactForce, StageTimes, contact_wrenches};
use cosserat::state::measure::energy;
use cosserat::state::{JointForce, Model, State};
use serde::Serialize;
use terminal::Progress;
use view::{Frame, Recorder};

use crate::cli::StaticArgs;
use crate::curves::recorder;
use crate::files::{Files, Wanted, Written, write_player};
use crate::plots;
use crate::sample::{Sample, length};

/// What is written of equilibria.
pub(crate) struct AtRest<'a> {
    files: Files<'a>,
    keeps_contacts: bool,
    player: Option<Recorder>,
    samples: Option<Vec<Sample>>,
    first_length: f64,
    title: String,
}

impl StaticArgs {
    /// The files that are asked for, of this scene, with a table beside them.
    fn wanted<'a>(&'a self, scene: &'a Scene, table: Option<&'static str>) -> Option<Wanted<'a>> {
        let is_asked = self.view || self.plot || !self.export.is_empty();
        let by_default = || is_asked.then(|| PathBuf::from(format!("out/{}-static", scene.name)));
        let directory = self.out.clone().or_else(by_default)?;
        let plots = if self.plot { &plots::AT_REST[..] } else { &[] };
        let (view, formats, probes) = (self.view, &self.export[..], &scene.probes[..]);
        Some(Wanted { view, plots, formats, probes, table, ..Wanted::plain(&directory) })
    }
}

impl<'a> AtRest<'a> {
    /// Takes the folder and the start, if any files are asked for. `dt` [s] is the time between frames, or of what happens in them.
    ///
    /// # Errors
    /// As [`Files::open`].
    pub(crate) fn open(
        args: &'a StaticArgs,
        scene: &'a Scene,
        dt: f64,
        table: Option<&'static str>,
    ) -> Result<Option<Self>> {
        let Some(wanted) = args.wanted(scene, table) else { return Ok(None) };
        let title = format!("{}, at rest", scene.name);
        let player = wanted.view.then(|| recorder(&title, dt, scene, &scene.model));
        let samples = (!wanted.plots.is_empty()).then(Vec::new);
        let joints = if wanted.keeps_forces() { scene.model.joints.len() } else { 0 };
        let keeps_contacts = wanted.keeps_contacts(scene);
        let files = Files::open(wanted, scene, dt, joints, 0.0)?;
        let first_length = length(&scene.model, &scene.state);
        let mut own = Self { files, keeps_contacts, player, samples, first_length, title };
        own.show(&scene.model, &scene.state, &[], 0.0);
        Ok(Some(own))
    }

    /// Takes an equilibrium at `time` [s], with what joints transmit there and what presses on what, as the model is then.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn push(
        &mut self,
        model: &Model,
        state: &State,
        (forces, contacts): (&[JointForce], &[ContactForce]),
        time: f64,
    ) -> Result<()> {
        let kept = if self.files.wanted.keeps_forces() { forces } else { &[] };
        let mut loads = Vec::new();
        if self.keeps_contacts {
            contact_wrenches(contacts, state, &mut loads);
        }
        self.files.push(state, kept, &loads, time)?;
        self.show(model, state, forces, time);
        Ok(())
    }

    fn show(&mut self, model: &Model, state: &State, forces: &[JointForce], time: f64) {
        if self.player.is_none() && self.samples.is_none() {
            return;
        }
        let stages_us = StageTimes::default().by_name().map(|(name, _)| (name, 0.0));
        let length_ratio = length(model, state) / self.first_length;
        let sample = Sample { time, energy: energy(model, state), length_ratio, iterations: 0.0, stages_us };
        if let Some(player) = &mut self.player {
            let energy = sample.energy.total();
            player.push(&Frame { time, state, forces, energy, length_ratio, iterations: 0.0 });
        }
        if let Some(samples) = &mut self.samples {
            samples.push(sample);
        }
    }

    /// Writes all files: see [`Files::close`]; `more` writes the table.
    pub(crate) fn close(
        self,
        scene: &Scene,
        report: &impl Serialize,
        refused: Option<Error>,
        progress: &Progress,
        more: impl FnOnce(&Path) -> Result<()>,
    ) -> Result<Written> {
        let Self { files, player, samples, title, .. } = self;
        let conditions = Conditions::new("static", title).with("machine", export::machine());
        files.close(scene, report, refused, progress, |directory| {
            if let Some(samples) = &samples {
                plots::write(directory, samples, &conditions, &plots::AT_REST)?;
            }
            if let Some(player) = player {
                write_player(directory, player)?;
            }
            more(directory)
        })
    }
}
