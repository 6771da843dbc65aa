//! What goes with motions: obstacles, and bodies that are held.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use crate::{Body, DriveError, Motion, MovingPose, Pose};

/// What goes with a motion as one rigid body: an [`crate::Obstacle`], or the body of a [`Driven`].
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// The motion that it follows.
    pub motion: Arc<Motion>,
    /// Where it is in the frame of the motion's pose, as if it were gripped there.
    pub grip: Pose,
}

impl Carried {
    /// Something whose pose is the motion's.
    pub fn new(motion: Arc<Motion>) -> Self {
        Self { motion, grip: Pose { position: Vector3::zeros(), orientation: UnitQuaternion::identity() } }
    }

    /// Something that is gripped at `time` [s] where it is then, at `pose`, and goes with the motion from there.
    pub fn gripped(motion: Arc<Motion>, pose: &Pose, time: f64) -> Self {
        let grip = motion.grip(pose, time);
        Self { motion, grip }
    }

    /// Where it is at `time` [s], and how fast it goes on from there.
    pub fn at(&self, time: f64) -> MovingPose {
        self.motion.carry(&self.grip, time)
    }
}

/// A body that a motion drives: a fixed segment or an anchor. Nothing else moves it.
///
/// With times it is a grip that takes hold of the body in the first step that begins at `from` or later, with the pose that
/// the body has then, and lets it go in the first that begins at `until` or later: the body goes on with the velocity that
/// it has. Outside of its times the body is free (an anchor open), unless another one holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct Driven {
    /// The body.
    pub body: Body,
    /// The motion that it follows, and where it is on it.
    pub carried: Carried,
    /// When it takes hold [s]; 0 or less where it does from the start.
    pub from: f64,
    /// When it lets go [s]; infinite where it never does.
    pub until: f64,
    /// Whether a motion that takes hold later is moved to where the body is then, so that its way and its turns are the
    /// body's own. Else it is a gripper's, whose grip is wherever the two are then, and both go on as one rigid body.
    pub moves_along: bool,
    /// Whether a gripper that takes hold later goes on with the body's place at its own: the body keeps its orientation
    /// relative to it, and what holds it must yield to the jump, as an anchor behind springs does.
    pub snaps: bool,
}

/// Part of a time by which a sum of many steps may miss it.
const SAME_TIME: f64 = 1e-12;

impl Driven {
    /// A body whose pose is the motion's.
    pub fn new(body: Body, motion: Arc<Motion>) -> Self {
        Self::by(body, Carried::new(motion))
    }

    fn by(body: Body, carried: Carried) -> Self {
        Self { body, carried, from: 0.0, until: f64::INFINITY, moves_along: false, snaps: false }
    }

    /// The same, held from one time to another [s] alone.
    pub fn between(self, from: f64, until: f64) -> Self {
        Self { from, until, ..self }
    }

    /// Whether it holds its body for a part of the time alone.
    pub fn is_timed(&self) -> bool {
        self.from > 0.0 || self.until < f64::INFINITY
    }

    /// Whether it has taken hold when a step begins at `time` [s].
    pub fn begins_by(&self, time: f64) -> bool {
        self.from <= 0.0 || time * (1.0 + SAME_TIME) >= self.from
    }

    /// Whether it has let go when a step begins at `time` [s].
    pub fn ends_by(&self, time: f64) -> bool {
        time * (1.0 + SAME_TIME) >= self.until
    }

    /// Whether it held its body in the step that ended at `time` [s]; at time 0, whether it holds it from the start.
    pub fn held_until(&self, time: f64) -> bool {
        (self.from <= 0.0 || time * (1.0 - SAME_TIME) > self.from) && time * (1.0 - SAME_TIME) <= self.until
    }

    /// Takes hold of the body at `pose` at `time` [s]: see [`Driven`]. `centre` [m] is where its motion is moved to if it
    /// [moves along](Self::moves_along): the body's position, or of several bodies that go on as one a place of all.
    pub fn taken(&self, pose: &Pose, centre: &Vector3<f64>, time: f64) -> Self {
        let motion = &self.carried.motion;
        let away = centre - motion.at(time).pose.position;
        let motion = if self.moves_along { Arc::new(motion.shifted(&away)) } else { motion.clone() };
        let Self { until, moves_along, snaps, .. } = *self;
        let mut taken = Self { from: time, until, moves_along, snaps, ..Self::gripped(self.body, motion, pose, time) };
        if snaps {
            taken.carried.grip.position = Vector3::zeros();
        }
        taken
    }

    /// A body that is gripped at `time` [s] where it is then, at `pose`, and goes with the motion from there.
    pub fn gripped(body: Body, motion: Arc<Motion>, pose: &Pose, time: f64) -> Self {
        Self::by(body, Carried::gripped(motion, pose, time))
    }

    /// Where the body is at `time` [s], and how fast it goes on from there.
    pub fn at(&self, time: f64) -> MovingPose {
        self.carried.at(time)
    }
}

/// How far a motion may begin from where its body is [m, rad]: rounding errors of positions of some kilometres.
const SAME_PLACE: f64 = 1e-9;

/// Checks that a motion begins where its body is.
pub(crate) fn begins_at(here: &Pose, begin: &Pose) -> Result<(), DriveError> {
    let distance = (begin.position - here.position).norm();
    let angle = begin.orientation.angle_to(&here.orientation);
    let is_there = distance <= SAME_PLACE * (1.0 + here.position.norm()) && angle <= 1e-6;
    if is_there { Ok(()) } else { Err(DriveError::Elsewhere { distance, angle }) }
}
