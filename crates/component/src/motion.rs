//! Prescribed motion of fixed segments and anchors: where they are at an absolute time, whatever steps led there.
//!
//! What is fixed answers nothing, so that nothing corrects an error of its pose. It is therefore never carried on from
//! step to step: each prediction places it anew, and no guess can move it.

mod step;

use std::sync::Arc;

use kernels::Spatial;
use kernels::math::{Quat, Vec3};
use rod::{Driven, MovingPose};

use super::parts::vec3;
use super::pose::BodyPose;
use crate::snapshot::StateVisitor;

/// Where a fixed segment or an anchor is at any time.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Motion {
    /// Constant velocities from a pose on.
    Steady(Steady),
    /// A way of its own, which no velocity changes.
    Driven(Arc<Driven>),
}

/// Constant velocities from a pose on: `x0 + v (t - t0)`, `exp(w (t - t0)) q0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steady {
    /// Time t0 of the pose that it begins at [s].
    since: f64,
    origin: BodyPose<f64>,
    /// v [m/s] and w [rad/s], in world axes.
    velocity: Spatial<f64>,
}

impl Steady {
    /// No motion.
    fn none() -> Self {
        let origin = BodyPose { x: Vec3::zero(), q: Quat::identity() };
        Self { since: 0.0, origin, velocity: Spatial::zero() }
    }

    /// The pose at `time` [s].
    fn pose_at(&self, time: f64) -> BodyPose<f64> {
        let elapsed = time - self.since;
        let turn = self.velocity.angular * elapsed;
        let half = 0.5 * turn.norm_squared().sqrt();
        let share = if half > 0.0 { 0.5 * half.sin() / half } else { 0.5 };
        let turn = Quat { v: turn * share, w: half.cos() };
        BodyPose { x: self.origin.x + self.velocity.linear * elapsed, q: turn * self.origin.q }
    }
}

/// By how much a body that is driven may turn in a step [rad]. Beyond a quarter of a turn the rods beside it can lose whole
/// turns.
pub const LARGEST_TURN: f64 = 1.0;

/// A pose with its velocities (v, w).
pub fn in_kernel(moving: &MovingPose) -> (BodyPose<f64>, Spatial<f64>) {
    let orientation = &moving.pose.orientation;
    let q = Quat { v: Vec3(vec3(&orientation.imag())), w: orientation.w };
    let velocity = Spatial { linear: Vec3(vec3(&moving.velocity)), angular: Vec3(vec3(&moving.angular_velocity)) };
    (BodyPose { x: Vec3(vec3(&moving.pose.position)), q }, velocity)
}

impl Motion {
    /// By how much it turns from one time to another [rad].
    fn turned(&self, from: f64, to: f64) -> f64 {
        match self {
            Motion::Steady(steady) => steady.velocity.angular.norm_squared().sqrt() * (to - from),
            Motion::Driven(driven) => driven.carried.motion.turned(from, to),
        }
    }

    /// The pose at `time` [s] and the velocities (v, w) with which it goes on.
    fn at(&self, time: f64) -> (BodyPose<f64>, Spatial<f64>) {
        match self {
            Motion::Steady(steady) => (steady.pose_at(time), steady.velocity),
            Motion::Driven(driven) => in_kernel(&driven.at(time)),
        }
    }
}

impl Motion {
    /// Shows it to a visitor.
    fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        let mut is_driven = matches!(self, Motion::Driven(_));
        visitor.flag(&mut is_driven);
        if is_driven {
            let mut driven = if let Motion::Driven(own) = self { Some(own.clone()) } else { None };
            visitor.motion(&mut driven);
            *self = driven.map_or(Motion::Steady(Steady::none()), Motion::Driven);
            return;
        }
        let mut steady = if let Motion::Steady(own) = self { *own } else { Steady::none() };
        let Steady { since, origin, velocity } = &mut steady;
        visitor.number(since);
        visitor.pose(origin);
        visitor.spatial(velocity);
        *self = Motion::Steady(steady);
    }
}

/// A fixed segment or an anchor in motion.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Moved {
    pub(super) lane: usize,
    body: usize,
    motion: Motion,
}

impl Moved {
    /// Whether it is of a lane's body.
    pub(super) fn is_of(&self, lane: usize, body: usize) -> bool {
        (self.lane, self.body) == (lane, body)
    }

    /// The same of a component of its own.
    pub(super) fn alone(&self) -> Self {
        Self { lane: 0, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_what_its_velocities_say_at_any_time() {
        let q = nalgebra::UnitQuaternion::from_euler_angles(0.4, -1.0, 2.2);
        let origin = BodyPose { x: Vec3([1.0, -2.0, 0.5]), q: Quat { v: Vec3([q.i, q.j, q.k]), w: q.w } };
        let (v, w) = (Vec3([0.1, 0.2, -0.3]), nalgebra::Vector3::new(0.6, 0.5, 1.0));
        let motion = Steady { since: 2.0, origin, velocity: Spatial { linear: v, angular: Vec3(w.into()) } };
        for time in [2.0, 2.0 + 1e-12, 2.01, 7.0, 1e3] {
            let pose = motion.pose_at(time);
            let turned = nalgebra::UnitQuaternion::from_scaled_axis(w * (time - 2.0)) * q;
            let apart =
                [pose.q.v.0[0] - turned.i, pose.q.v.0[1] - turned.j, pose.q.v.0[2] - turned.k, pose.q.w - turned.w];
            assert!(apart.iter().all(|x| x.abs() < 1e-12), "{time}: {apart:?}");
            let shift = pose.x - origin.x - v * (time - 2.0);
            assert!(shift.norm_squared().sqrt() < 1e-12 * time.max(1.0), "{time}: {shift:?}");
        }
        assert_eq!(motion.pose_at(2.0), origin);
    }
}
