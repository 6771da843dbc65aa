//! What is kept of a run's frames for its files.

use anyhow::{Error, Result};
use chart::Conditions;
use export::Envelope;
use rod::{JointForce, Model, Part, State, Wrench};
use scene::Scene;
use serde::Serialize;
use solver::simulation::{ContactForce, Simulation, contact_wrenches};
use solver::snapshot::Snapshot;
use view::{Frame, Recorder};

use crate::files::{ENVELOPE, Files, Wanted, Written, names, write_player};
use crate::going_on::write_snapshot;
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
    /// What presses on what in the last frame, where that is wanted.
    contacts: Vec<ContactForce>,
    /// What contacts give to each segment in the last frame, where that is kept.
    contact_loads: Vec<Wrench>,
    keeps_contacts: bool,
    /// Every so many steps a frame is kept.
    every: usize,
    /// What the player shows of the model, where that is not all.
    part: Option<Part>,
}

impl<'a> Keep<'a> {
    /// Takes the run's folder and the first frame, at `time` [s], when the scene's model is `model`. `label` names the run in
    /// the player.
    pub(crate) fn open(wanted: Wanted<'a>, scene: &Scene, model: &Model, label: &str, time: f64) -> Result<Self> {
        let Scene { state, run, .. } = scene;
        let joints = |are_wanted: bool| if are_wanted { model.joints.len() } else { 0 };
        let (view, plot, keeps_forces) = (wanted.view, wanted.plot, wanted.keeps_forces());
        let keeps_contacts = wanted.keeps_contacts(scene);
        let part = wanted.part(model);
        let drawn = part.as_ref().map_or(model, |part| &part.model);
        let mut keep = Self {
            files: Files::open(wanted, scene, run.dt, joints(keeps_forces), time)?,
            player: view.then(|| Recorder::new(label, run.dt, drawn)),
            plots: plot.then(Vec::new),
            sampler: None,
            forces: vec![JointForce::default(); joints(view || keeps_forces)],
            contacts: Vec::new(),
            contact_loads: Vec::new(),
            keeps_contacts,
            every: run.every,
            part,
        };
        if view || plot {
            let (sampler, start) = Sampler::new(model, state, run.steps, run.every, time);
            keep.sampler = Some(sampler);
            keep.take(start, state);
        }
        Ok(keep)
    }

    /// Whether the frame after so many steps is kept; the `last` one is.
    pub(crate) fn wants(&self, step: usize, last: bool) -> bool {
        last || step.is_multiple_of(self.every)
    }

    /// Takes the frame after so many steps, one that [`Keep::wants`].
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
        if self.keeps_contacts || self.files.wanted.contact_forces {
            simulation.store_contact_forces(&mut self.contacts);
        }
        if self.keeps_contacts {
            contact_wrenches(&self.contacts, state, &mut self.contact_loads);
        }
        self.files.writer.push_with_contacts(state, forces, &self.contact_loads, simulation.time())?;
        if self.files.wanted.contact_forces {
            self.files.add_contacts(&self.contacts, simulation.time())?;
        }
        if let Some(sampler) = self.sampler.as_mut().filter(|sampler| last || sampler.wants(step)) {
            let sample = sampler.sample(model, state, simulation, step);
            if let (Some(player), true) = (&mut self.player, model.has_timed_grips()) {
                let part = self.files.wanted.part(model);
                player.take_grips(part.as_ref().map_or(model, |part| &part.model));
            }
            self.take(sample, state);
        }
        Ok(())
    }

    fn take(&mut self, sample: Sample, state: &State) {
        if let Some(player) = &mut self.player {
            let part = self.part.as_ref().map(|part| (part.state(state), part.forces(&self.forces)));
            let (state, forces) = part.as_ref().map_or((state, &self.forces), |(state, forces)| (state, forces));
            player.push(&Frame {
                time: sample.time,
                state,
                forces,
                energy: sample.energy.total(),
                length_ratio: sample.length_ratio,
                iterations: sample.iterations,
            });
        }
        if let Some(plots) = &mut self.plots {
            plots.push(sample);
        }
    }

    /// Whether a snapshot of the end is wanted.
    pub(crate) fn wants_snapshot(&self) -> bool {
        self.files.wanted.snapshot
    }

    /// Writes all files, with a snapshot and a table of extremes if there are any, or, where the disk has `refused` frames, what fits.
    pub(crate) fn close(
        self,
        scene: &Scene,
        summary: &impl Serialize,
        conditions: &Conditions,
        snapshot: Option<&Snapshot>,
        envelope: Option<&Envelope>,
        refused: Option<Error>,
    ) -> Result<Written> {
        let Self { files, player, plots, .. } = self;
        files.close(scene, summary, refused, |directory| {
            if let Some(snapshot) = snapshot {
                write_snapshot(directory, scene, snapshot)?;
            }
            if let Some(envelope) = envelope {
                envelope.write(&directory.join(ENVELOPE), &scene.model, &names(scene, &scene.model))?;
            }
            if let Some(samples) = &plots {
                plots::write(directory, samples, conditions)?;
            }
            if let Some(player) = player {
                write_player(directory, player)?;
            }
            Ok(())
        })
    }
}
