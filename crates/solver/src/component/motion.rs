//! Prescribed motion of fixed segments: where they are at an absolute time, whatever steps led there.
//!
//! A fixed segment answers nothing, so that nothing corrects an error of its pose. It is therefore never carried on from
//! step to step: each prediction places it anew, and no guess can move it.

use super::lanes::{copy_pose, pick_pose};
use super::{BodyPose, Component};
use crate::kernel::Spatial;
use crate::kernel::lane::Real;
use crate::kernel::math::Quat;

/// Constant velocities from a pose on: `x0 + v (t - t0)`, `exp(w (t - t0)) q0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    /// Time t0 of the pose that it begins at [s].
    since: f64,
    origin: BodyPose<f64>,
    /// v [m/s] and w [rad/s], in world axes.
    pub(super) velocity: Spatial<f64>,
}

impl Motion {
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

/// A fixed segment in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moved {
    pub(super) lane: usize,
    pub(super) body: usize,
    pub(super) motion: Motion,
}

impl<T: Real> Component<T> {
    /// Lets a fixed segment of a lane go on with the velocities (v, w) from its pose at `time` [s]; it keeps the motion that
    /// it has if the velocities are the same.
    pub(super) fn prescribe(&mut self, lane: usize, body: usize, velocity: Spatial<f64>, time: f64) {
        let here = |moved: &Moved| (moved.lane, moved.body) == (lane, body);
        let old = self.moved.iter().position(here);
        if old.is_some_and(|k| self.moved[k].motion.velocity == velocity) {
            return;
        }
        if let Some(k) = old {
            self.moved.swap_remove(k);
        }
        if velocity != Spatial::zero() {
            let motion = Motion { since: time, origin: pick_pose(&self.poses[body], lane), velocity };
            self.moved.push(Moved { lane, body, motion });
        }
    }

    /// Puts the fixed segments that move to their places at `time` [s], as a prediction.
    pub(super) fn follow_motions(&mut self, time: f64) {
        for Moved { lane, body, motion } in &self.moved {
            copy_pose(&mut self.predicted[*body], *lane, &motion.pose_at(time), 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::math::Vec3;

    #[test]
    fn a_motion_is_what_its_velocities_say_at_any_time() {
        let q = nalgebra::UnitQuaternion::from_euler_angles(0.4, -1.0, 2.2);
        let origin = BodyPose { x: Vec3([1.0, -2.0, 0.5]), q: Quat { v: Vec3([q.i, q.j, q.k]), w: q.w } };
        let (v, w) = (Vec3([0.1, 0.2, -0.3]), nalgebra::Vector3::new(0.6, 0.5, 1.0));
        let motion = Motion { since: 2.0, origin, velocity: Spatial { linear: v, angular: Vec3(w.into()) } };
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
