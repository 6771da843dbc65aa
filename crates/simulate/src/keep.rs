//! What is kept of a run's frames for its files.

use std::collections::HashMap;

use anyhow::{Error, Result};
use chart::Conditions;
use cosserat::motion::Wrench;
use cosserat::scene::Scene;
use cosserat::simulation::{ContactForce, Simulation, Snapshot, contact_wrenches};
use cosserat::state::{JointForce, Model, OnPulley, Part, Sliding, State};
use export::Envelope;
use serde::Serialize;
use terminal::Progress;
use view::{Frame, Pressing, Recorder};

use crate::breaks::Breaks;
use crate::curves::{self, Curves};
use crate::files::{ENVELOPE, Files, Wanted, Written, names, write_player};
use crate::going_on::Label;
use crate::plots;
use crate::sample::{Sample, Sampler};

/// When snapshots are written on the way, and what they say.
pub(crate) struct Rhythm {
    /// Time from one to the next [s].
    pub(crate) every: f64,
    pub(crate) label: Label,
}

impl Rhythm {
    /// Whether the step of `dt` [s] that is the `step`-th of the run is the first to end at a multiple of the rhythm, or after it.
    fn is_due(&self, step: usize, dt: f64) -> bool {
        // A sum of many steps that ends at a multiple may be a rounding error short of it.
        let passed = |step: usize| (step as f64 * dt / self.every * (1.0 + 1e-12)).floor();
        step > 0 && passed(step) > passed(step - 1)
    }
}

/// Takes the frames of a run for the files that are wanted.
pub(crate) struct Keep<'a> {
    files: Files<'a>,
    player: Option<Recorder>,
    /// Of what the player shows, where there is anything.
    curves: Option<Curves>,
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
    /// Memory for where eyelets are.
    sliding: Vec<Sliding>,
    /// Memory for where rods are on pulleys.
    pulleys: Vec<OnPulley>,
    /// Every so many steps a frame is kept.
    every: usize,
    /// What the player shows of the model, where that is not all.
    part: Option<Part>,
    /// How snapshots are written on the way, where that is wanted.
    rhythm: Option<Rhythm>,
}

impl<'a> Keep<'a> {
    /// Takes the run's folder and the first frame, at `time` [s], when the scene's model is `model`. `label` names the run in
    /// the player.
    pub(crate) fn open(wanted: Wanted<'a>, scene: &Scene, model: &Model, label: &str, time: f64) -> Result<Self> {
        let Scene { state, run, .. } = scene;
        let joints = |are_wanted: bool| if are_wanted { model.joints.len() } else { 0 };
        let (view, plot, keeps_forces) = (wanted.view, !wanted.plots.is_empty(), wanted.keeps_forces());
        let keeps_contacts = wanted.keeps_contacts(scene);
        let part = wanted.part(model);
        let drawn = part.as_ref().map_or(model, |part| &part.model);
        let player = view.then(|| curves::recorder(label, run.dt, scene, drawn));
        let curves = view.then(|| Curves::new(scene, model, part.as_ref())).filter(|curves| !curves.is_empty());
        let mut keep = Self {
            files: Files::open(wanted, scene, run.dt, joints(keeps_forces), time)?,
            player,
            curves,
            plots: plot.then(Vec::new),
            sampler: None,
            forces: vec![JointForce::default(); joints(view || keeps_forces)],
            contacts: Vec::new(),
            contact_loads: Vec::new(),
            keeps_contacts,
            sliding: Vec::new(),
            pulleys: Vec::new(),
            every: run.every,
            part,
            rhythm: None,
        };
        if view || plot {
            let (sampler, start) = Sampler::new(model, state, run.steps, run.every, time);
            keep.sampler = Some(sampler);
            keep.take(start, state);
        }
        if let Some(curves) = &mut keep.curves {
            curves.push(model, state, (&[], &[]), time);
            curves.keep(state, time);
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
        let sampled = self.sampler.as_mut().filter(|sampler| last || sampler.wants(step));
        let shows_contacts = sampled.is_some() && self.player.is_some() && !model.contacts.is_empty();
        let reads = self.curves.as_ref().is_some_and(|curves| sampled.is_some() && curves.reads_reactions());
        let sums_contacts = self.keeps_contacts || (reads && !model.contacts.is_empty());
        if sums_contacts || self.files.wanted.contact_forces || shows_contacts {
            simulation.store_contact_forces(&mut self.contacts);
        }
        if sums_contacts {
            contact_wrenches(&self.contacts, state, &mut self.contact_loads);
        }
        let kept: &[Wrench] = if self.keeps_contacts { &self.contact_loads } else { &[] };
        self.files.push(state, forces, kept, simulation.time())?;
        if self.files.wanted.contact_forces {
            self.files.add_contacts(&self.contacts, simulation.time())?;
        }
        if !self.files.wanted.eyelets.is_empty() {
            self.sliding.resize(model.sliding_joints.len(), Sliding::default());
            simulation.store_sliding(&mut self.sliding);
            self.files.add_eyelets(&self.sliding, simulation.time())?;
        }
        if !self.files.wanted.pulleys.is_empty() {
            self.pulleys.resize(model.pulleys.len(), OnPulley::default());
            simulation.store_pulleys(&mut self.pulleys);
            self.files.add_pulleys(&self.pulleys, simulation.time())?;
        }
        if let Some(curves) = &mut self.curves {
            if sampled.is_some() {
                curves.push(model, state, (&self.forces, &self.contact_loads), simulation.time());
            }
            curves.keep(state, simulation.time());
        }
        if let Some(sampler) = sampled {
            let sample = sampler.sample(model, state, simulation, step);
            let has_events = model.has_timed_grips() || !model.breakable.is_empty();
            if let (Some(player), true) = (&mut self.player, has_events) {
                let part = self.files.wanted.part(model);
                player.take_events(part.as_ref().map_or(model, |part| &part.model));
            }
            self.take(sample, state);
            if shows_contacts {
                self.take_contacts(state);
            }
        }
        Ok(())
    }

    /// Writes snapshots on the way, the first one now.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn write_snapshots(&mut self, rhythm: Rhythm, simulation: &mut Simulation) -> Result<()> {
        self.files.write_snapshot(&rhythm.label, &simulation.snapshot())?;
        self.rhythm = Some(rhythm);
        Ok(())
    }

    /// Whether a snapshot is due after so many steps of `dt` [s].
    pub(crate) fn wants_snapshot(&self, step: usize, dt: f64) -> bool {
        self.rhythm.as_ref().is_some_and(|rhythm| rhythm.is_due(step, dt))
    }

    /// Writes the snapshot that is due.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub(crate) fn push_snapshot(&mut self, snapshot: &Snapshot) -> Result<()> {
        let Some(rhythm) = &self.rhythm else { return Ok(()) };
        self.files.write_snapshot(&rhythm.label, snapshot)
    }

    /// What presses on what is shown, in the frame that was taken last.
    fn take_contacts(&mut self, state: &State) {
        let Some(player) = &mut self.player else { return };
        let own =
            |contact: &ContactForce| Pressing { segment: contact.segment, place: contact.place, force: contact.force };
        match &self.part {
            None => player.push_contacts(state, self.contacts.iter().map(own)),
            Some(part) => {
                let of: HashMap<usize, usize> =
                    part.segments.iter().enumerate().map(|(new, &old)| (old, new)).collect();
                let shown = self.contacts.iter().map(own);
                let shown = shown.filter_map(|one| Some(Pressing { segment: *of.get(&one.segment)?, ..one }));
                player.push_contacts(&part.state(state), shown);
            }
        }
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

    /// Writes a snapshot of the end.
    pub(crate) fn write_snapshot(&mut self, label: &Label, snapshot: &Snapshot) -> Result<()> {
        self.files.write_snapshot(label, snapshot)
    }

    /// Writes all files, with a table of extremes if there is one, or, where the disk has `refused` frames, what fits.
    pub(crate) fn close(
        self,
        scene: &Scene,
        summary: &impl Serialize,
        conditions: &Conditions,
        (envelope, breaks): (Option<&Envelope>, Option<&Breaks>),
        refused: Option<Error>,
        progress: &Progress,
    ) -> Result<Written> {
        let Self { files, mut player, curves, plots, .. } = self;
        if let (Some(player), Some(curves)) = (&mut player, curves) {
            curves.finish(player);
        }
        files.close(scene, summary, refused, progress, |directory| {
            if let Some(envelope) = envelope {
                envelope.write(&directory.join(ENVELOPE), &scene.model, &names(scene, &scene.model))?;
            }
            if let Some(breaks) = breaks {
                breaks.write(directory)?;
            }
            if let Some(samples) = &plots {
                plots::write(directory, samples, conditions, &plots::FILES)?;
            }
            if let Some(player) = player {
                write_player(directory, player)?;
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_snapshot_is_due_in_the_first_step_that_ends_at_a_multiple_or_after() {
        let label = Label { scene: String::new(), model: String::new(), holds: Vec::new() };
        let mut rhythm = Rhythm { every: 0.1, label };
        let due = |rhythm: &Rhythm, dt: f64| (0..=20).filter(|&k| rhythm.is_due(k, dt)).collect::<Vec<usize>>();
        assert_eq!(due(&rhythm, 0.02), [5, 10, 15, 20]);
        // No multiple of the step: 0.12, 0.21, 0.3 s.
        assert_eq!(due(&rhythm, 0.03), [4, 7, 10, 14, 17, 20]);
        // Shorter than a step: after each.
        rhythm.every = 1e-3;
        assert_eq!(due(&rhythm, 0.02), (1..=20).collect::<Vec<_>>());
    }
}
