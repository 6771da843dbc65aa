//! A frame of a trajectory as formats read it.

use std::borrow::Cow;

use rod::{JointForce, Model, State, Wrench};

use crate::{ExportError, TrajectoryReader};

/// A frame of a trajectory.
#[derive(Default)]
pub(super) struct Frame {
    /// Time [s].
    pub(super) time: f64,
    pub(super) state: State,
    /// The mode that it shows, number and frequency [Hz], if it shows one.
    pub(super) mode: Option<(usize, f64)>,
    /// What each joint transmits; empty where that was not kept.
    pub(super) forces: Vec<JointForce>,
    /// What contacts give to each segment; empty where that was not kept.
    pub(super) contacts: Vec<Wrench>,
}

impl Frame {
    /// Makes what of a model changes over time that of this frame.
    pub(super) fn set_time(&self, model: &mut Cow<'_, Model>) {
        if model.varies() {
            model.to_mut().set_time(self.time);
        }
    }

    /// Reads frame `index` in place of the last one.
    pub(super) fn read(&mut self, trajectory: &mut TrajectoryReader, index: usize) -> Result<(), ExportError> {
        self.time = trajectory.read_frame(index, &mut self.state)?;
        self.mode = trajectory.mode(index);
        trajectory.read_forces(index, &mut self.forces)?;
        trajectory.read_contacts(index, &mut self.contacts)
    }
}
