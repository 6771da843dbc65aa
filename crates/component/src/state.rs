//! Between a component and the outside: poses, velocities, and what joints transmit.
//!
//! The solver's variable of a rotation is `w = 2 Im(q' conj(q)) / dt` (Algorithm 1, line 19), which is
//! `2 sin(angle / 2) / dt` for a turn by that angle in a step. Outside, an angular velocity is the true rate, angle / dt.
//! One that is given stays what it is until a step begins, whose length says which variable stands for it.

use std::f64::consts::FRAC_PI_2;

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;
use rod::{JointForce, State};

use super::parts::{copy_lane, get, get_quat, pick, put, vec3};
use super::turns::rate;
use super::{Component, Members};

/// The solver's variable that stands for a `rate` [rad/s] in a step of `dt` [s]. Beyond half a turn a step no sine tells
/// it; the variable goes on with the slope 2 / pi then, by which a prediction knows it.
fn variable<T: Real>(rate: Vec3<T>, dt: f64) -> Vec3<T> {
    let (half, most) = (rate.norm_squared().sqrt() * T::splat(0.5 * dt), T::splat(FRAC_PI_2));
    let half = (half - most).select(most, half);
    rate * (-half).select(T::splat(1.0), half.sin() / half)
}

impl<T: Real> Component<T> {
    /// Copies one lane's poses and velocities from `state`, at time 0.
    pub fn set_state(&mut self, state: &State, members: &Members, lane: usize) {
        for (k, &index) in members.segments.iter().enumerate() {
            let pose = &mut self.poses[k];
            put(&mut pose.x, lane, vec3(&state.positions[index]));
            put(&mut pose.q.v, lane, vec3(&state.orientations[index].imag()));
            pose.q.w.set_lane(lane, state.orientations[index].w);
        }
        self.set_velocities(state, members, lane, 0.0);
    }

    /// Copies one lane's velocities from `state`; fixed segments that nothing drives move on with them from their poses at
    /// `time` [s]. Those that [`Component::store_state`] has just stored change nothing.
    pub fn set_velocities(&mut self, state: &State, members: &Members, lane: usize, time: f64) {
        for (k, &index) in members.segments.iter().enumerate() {
            if self.is_fixed(k, lane) && self.is_driven(lane, k) {
                continue;
            }
            let (v, w) = (Vec3(vec3(&state.velocities[index])), Vec3(vec3(&state.angular_velocities[index])));
            let is_fixed = self.is_fixed(k, lane);
            if self.multistep.is_none() || v != self.velocity(k, lane) {
                self.give_velocity(k, lane, v);
            }
            if w != self.rate(k, lane) {
                put(&mut self.velocities[k].angular, lane, w.0);
                self.given[k].set_lane(lane, 1.0);
                self.has_given = true;
                if !is_fixed {
                    self.forget_steps(lane);
                }
            }
            if is_fixed {
                self.prescribe(lane, k, Spatial { linear: v, angular: w }, time);
            }
        }
    }

    /// Copies one lane's poses and velocities to `state`.
    pub fn store_state(&self, state: &mut State, members: &Members, lane: usize) {
        for (k, &index) in members.segments.iter().enumerate() {
            state.positions[index] = get(self.poses[k].x, lane);
            state.orientations[index] = get_quat(self.poses[k].q, lane);
            state.velocities[index] = self.velocity(k, lane).0.into();
            state.angular_velocities[index] = self.rate(k, lane).0.into();
        }
        self.store_laws(state);
    }

    /// Copies what one lane's joints transmit at the end of its last step to `forces`; zero before the first.
    pub fn store_joint_forces(&self, forces: &mut [JointForce], members: &Members, lane: usize) {
        let dt = self.last_effective.lane(lane);
        let share = if dt > 0.0 { 1.0 / (dt * dt) } else { 0.0 };
        for (k, &index) in members.joints.iter().enumerate() {
            forces[index] = self.joint_force(k, lane, share);
        }
    }

    /// Whether a segment is fixed; anchors are.
    pub fn is_fixed(&self, body: usize, lane: usize) -> bool {
        self.bodies[body].free.lane(lane) == 0.0
    }

    /// Angular velocity of a segment [rad/s].
    fn rate(&self, body: usize, lane: usize) -> Vec3<f64> {
        let w = pick(self.velocities[body].angular, lane);
        let is_rate = self.given[body].lane(lane) >= 0.0 || self.is_fixed(body, lane);
        if is_rate {
            return w;
        }
        let over_step = rate(w, self.last_dt.lane(lane));
        if self.multistep.is_some() { over_step + self.beyond(body, lane) } else { over_step }
    }

    /// Half the length of the last step; of the one under way before the first, whose velocities are taken as those of a step like it.
    #[inline(always)]
    pub(super) fn last_half(&self) -> T {
        let dt = T::splat(self.dt);
        (self.last_dt - T::splat(f64::MIN_POSITIVE)).select(self.last_dt, dt) * T::splat(0.5)
    }

    /// The solver's variable of a segment's rotation, and half the length of the step that it is of: the last one, or the
    /// one under way where the rate was given since, or where the last one was of another length and its rate goes on.
    pub(super) fn variable(&self, body: usize, last_half: T) -> (Vec3<T>, T) {
        let (mut w, mut half) = (self.velocities[body].angular, last_half);
        let given = variable(w, self.dt);
        let own_half = T::splat(0.5 * self.dt);
        if last_half != own_half {
            let is_same = -(last_half - own_half).abs();
            let goes_on = variable(rate(w, last_half + last_half), self.dt);
            w = Vec3([0, 1, 2].map(|k| is_same.select(w.0[k], goes_on.0[k])));
            half = own_half;
        }
        for lane in 0..T::LANES {
            if self.given[body].lane(lane) >= 0.0 {
                copy_lane(&mut w, lane, given);
                half.set_lane(lane, 0.5 * self.dt);
            }
        }
        (w, half)
    }

    /// A step has ended in the lanes where `active` >= 0: given rates have become the solver's variables there.
    pub(super) fn take_in(&mut self, active: T) {
        if self.has_given {
            self.given.iter_mut().for_each(|given| *given = active.select(T::splat(-1.0), *given));
            self.has_given = self.given.iter().any(|given| (0..T::LANES).any(|lane| given.lane(lane) >= 0.0));
        }
        self.follow_velocities(active);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_and_their_variables_say_the_same() {
        let axis = Vec3([0.48, -0.6, 0.64]);
        let dt = 0.02;
        assert_eq!(variable(Vec3::<f64>::zero(), dt), Vec3::zero());
        assert_eq!(rate(Vec3::<f64>::zero(), dt), Vec3::zero());
        for angle in [1e-12, 0.1, 1.0, 2.0, 3.1, 3.2, 20.0] {
            let own = variable(axis * (angle / dt), dt);
            let sine = 0.5 * dt * own.norm_squared().sqrt();
            // Up to half a turn it is a sine; beyond it is more than any.
            assert!(
                if angle < std::f64::consts::PI { (sine - (0.5 * angle).sin()).abs() < 1e-15 } else { sine > 1.0 },
                "{angle}: {sine}"
            );
            let back = rate(own, dt) - axis * (angle / dt);
            assert!(back.norm_squared().sqrt() < 1e-13 * angle / dt, "{angle}: {back:?}");
        }
    }
}
