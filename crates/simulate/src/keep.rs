//! What is kept of a run's frames for its files.

use anyhow::{Error, Result};
use chart::Conditions;
use rod::{JointForce, Model, State};
use scene::Scene;
use serde::Serialize;
use solver::simulation::Simulation;
use view::{Frame, Recorder};

use crate::files::{self, Files, Wanted, Written};
use crate::plots;
use crate::sample::{Sample, Sampler};

/// Takes the frames of a run for the files that are wanted.
pub(crate) struct Keep<'a> {
    files: Files<'a>,
    player: Option<Recorder>,
    plots: Option<Vec<Sample>>,
    /// Present where player or plots are.
    sampler: Option<Sampler>,
    /// What joints transmit, an entry each, where that is wanted; else empty.
    forces: Vec<JointForce>,
}

impl<'a> Keep<'a> {
    /// Takes the run's folder and the first frame. `label` names the run in the player.
    pub(crate) fn open(wanted: Wanted<'a>, scene: &Scene, label: &str) -> Result<Self> {
        let Scene { model, state, run, .. } = scene;
        let joints = |are_wanted: bool| if are_wanted { model.joints.len() } else { 0 };
        let (view, plot, keeps_forces) = (wanted.view, wanted.plot, wanted.keeps_forces());
        let mut keep = Self {
            files: Files::open(wanted, scene, run.dt, joints(keeps_forces))?,
            player: view.then(|| Recorder::new(label, run.dt, model)),
            plots: plot.then(Vec::new),
            sampler: None,
            forces: vec![JointForce::default(); joints(view || keeps_forces)],
        };
        if view || plot {
            let (sampler, start) = Sampler::new(model, state, run.steps);
            keep.sampler = Some(sampler);
            keep.take(start, state);
        }
        Ok(keep)
    }

    /// Takes the frame after so many steps; the `last` one in any case.
    pub(crate) fn push(
        &mut self,
        model: &Model,
        simulation: &Simulation,
        state: &State,
        step: usize,
        last: bool,
    ) -> Result<()> {
        if !self.forces.is_empty() {
            simulation.store_joint_forces(&mut self.forces);
        }
        let forces: &[JointForce] = if self.files.wanted.keeps_forces() { &self.forces } else { &[] };
        self.files.writer.push(state, forces, simulation.time())?;
        if let Some(sampler) = self.sampler.as_mut().filter(|sampler| last || sampler.wants(step)) {
            let sample = sampler.sample(model, state, simulation, step);
            if let (Some(player), true) = (&mut self.player, model.has_timed_grips()) {
                player.take_grips(model);
            }
            self.take(sample, state);
        }
        Ok(())
    }

    fn take(&mut self, sample: Sample, state: &State) {
        if let Some(player) = &mut self.player {
            player.push(&Frame {
                time: sample.time,
                state,
                forces: &self.forces,
                energy: sample.energy.total(),
                length_ratio: sample.length_ratio,
                iterations: sample.iterations,
            });
        }
        if let Some(plots) = &mut self.plots {
            plots.push(sample);
        }
    }

    /// Writes all files, or, where the disk has `refused` frames, what fits.
    pub(crate) fn close(
        self,
        scene: &Scene,
        summary: &impl Serialize,
        conditions: &Conditions,
        refused: Option<Error>,
    ) -> Result<Written> {
        let Self { files, player, plots, .. } = self;
        files.close(scene, summary, refused, |directory| {
            if let Some(samples) = &plots {
                plots::write(directory, samples, conditions)?;
            }
            if let Some(player) = player {
                let run = player.finish();
                view::write_run(&directory.join(files::RUN), &run)?;
                view::write_page(&directory.join(files::PAGE), &[run])?;
            }
            Ok(())
        })
    }
}
