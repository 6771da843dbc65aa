//! What is kept of a run's frames for its files.

use std::path::Path;

use anyhow::Result;
use chart::Conditions;
use export::TrajectoryWriter;
use rod::{JointForce, Model, State};
use scene::Scene;
use serde::Serialize;
use solver::simulation::Simulation;
use view::{Frame, Recorder};

use crate::files::{self, Wanted};
use crate::plots;
use crate::sample::{Sample, Sampler};

/// Takes the frames of a run for the files that are wanted.
pub(crate) struct Keep<'a> {
    wanted: Wanted<'a>,
    writer: TrajectoryWriter,
    player: Option<Recorder>,
    plots: Option<Vec<Sample>>,
    /// Present where player or plots are.
    sampler: Option<Sampler>,
    /// What joints transmit, an entry each, where that is wanted; else empty.
    forces: Vec<JointForce>,
}

impl<'a> Keep<'a> {
    /// Looks whether all files can be written, and takes the first frame. `label` names the run in the player.
    pub(crate) fn open(wanted: Wanted<'a>, scene: &Scene, label: &str) -> Result<Self> {
        let Scene { model, state, run, .. } = scene;
        let joints = |are_wanted: bool| if are_wanted { model.joints.len() } else { 0 };
        let mut keep = Self {
            wanted,
            writer: files::open(&wanted, scene, run.dt, joints(wanted.keeps_forces()))?,
            player: wanted.view.then(|| Recorder::new(label, run.dt, model)),
            plots: wanted.plot.then(Vec::new),
            sampler: None,
            forces: vec![JointForce::default(); joints(wanted.view || wanted.keeps_forces())],
        };
        if wanted.view || wanted.plot {
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
        let forces: &[JointForce] = if self.wanted.keeps_forces() { &self.forces } else { &[] };
        self.writer.push(state, forces, simulation.time())?;
        if let Some(sampler) = self.sampler.as_mut().filter(|sampler| last || sampler.wants(step)) {
            let sample = sampler.sample(model, state, simulation, step);
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

    /// Writes all files. Returns their folder and their names.
    pub(crate) fn close(
        self,
        scene: &Scene,
        summary: &impl Serialize,
        conditions: &Conditions,
    ) -> Result<(&'a Path, Vec<String>)> {
        let wanted = self.wanted;
        let mut written = files::close(self.writer, &wanted, scene, summary)?;
        if let Some(samples) = &self.plots {
            plots::write(wanted.directory, samples, conditions)?;
            written.extend(plots::FILES.map(str::to_owned));
        }
        if let Some(player) = self.player {
            let run = player.finish();
            view::write_run(&wanted.directory.join(files::RUN), &run)?;
            view::write_page(&wanted.directory.join(files::PAGE), &[run])?;
            written.extend([files::RUN, files::PAGE].map(str::to_owned));
        }
        Ok((wanted.directory, written))
    }
}
