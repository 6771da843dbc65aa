//! What is held and by what, from one step to the next: motions that are given on the way, grips that attach and release.

mod change;

use std::sync::Arc;

use nalgebra::Vector3;
use rod::{Driven, Model, Pose};

/// A grip of the model that has times.
#[derive(Debug)]
pub(super) struct Scheduled {
    /// Index into [`Model::motions`].
    index: usize,
    /// As the model has it.
    given: Arc<Driven>,
    /// As it has taken hold, and let go.
    driven: Arc<Driven>,
    phase: Phase,
    taken: Option<Taken>,
}

impl Scheduled {
    fn grip(&self) -> TimedGrip {
        TimedGrip { motion: self.index, taken: self.taken, until: self.driven.until }
    }
}

/// Where and when a grip has taken hold of its body on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taken {
    /// Pose of the body then.
    pub pose: Pose,
    /// Where a motion that moves along with its body was moved to [m].
    pub centre: Vector3<f64>,
    /// When [s].
    pub time: f64,
}

/// What has become of one of the model's grips with times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedGrip {
    /// Index into [`Model::motions`].
    pub motion: usize,
    /// Where and when it took hold; `None` where it has not, or holds from the start.
    pub taken: Option<Taken>,
    /// When it lets go, or has let go [s].
    pub until: f64,
}

impl TimedGrip {
    /// The grip as it was and will be, from that of the model.
    pub fn of(&self, given: &Driven) -> Driven {
        let taken = self.taken.map(|Taken { pose, centre, time }| given.taken(&pose, &centre, time));
        Driven { until: self.until, ..taken.unwrap_or_else(|| given.clone()) }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Waits,
    Holds,
    Done,
}

impl Phase {
    const ALL: [Self; 3] = [Phase::Waits, Phase::Holds, Phase::Done];
}

/// The grips of a model that have times.
pub(super) fn schedule(model: &Model) -> Vec<Scheduled> {
    let timed = model.motions.iter().enumerate().filter(|(_, driven)| driven.is_timed());
    timed
        .map(|(index, driven)| {
            let phase = if driven.begins_by(0.0) { Phase::Holds } else { Phase::Waits };
            let given = Arc::new(driven.clone());
            Scheduled { index, driven: given.clone(), given, phase, taken: None }
        })
        .collect()
}
