//! What follows a linear solve: multipliers, poses, velocities; and taking a step back.

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;

use super::parts::{copy_pose, copy_spatial, select, select_pose};
use super::{BodyPose, Component};
use crate::formulation::Formulation;

impl<T: Real> Component<T> {
    /// Lines 10 and 11 of Algorithm 1: `lambda += dlambda`, `p += dp` with `dp = M^-1 (J^T dlambda - g)`, in the lanes
    /// where `active` >= 0.
    #[inline(never)]
    pub fn update(&mut self, formulation: Formulation, active: T) {
        T::dispatch(
            #[inline(always)]
            || self.update_kernel(formulation, active),
        )
    }

    #[inline(always)]
    fn update_kernel(&mut self, formulation: Formulation, active: T) {
        let geometric = formulation.momentum();
        let with_momentum = formulation.momentum() || std::mem::take(&mut self.torques_wait);
        let Self { system, scratch, dlambda, lambda, pulls, pushes, .. } = self;
        if pushes.is_empty() {
            scratch.fill(Spatial::zero());
        } else {
            scratch.copy_from_slice(pushes);
        }
        if geometric {
            pulls.fill(Vec3::zero());
        }
        for (j, &dlambda) in dlambda.iter().enumerate() {
            let q_a = system.frame(j);
            lambda[j] = select(active, lambda[j].plus(dlambda, T::splat(1.0)), lambda[j]);
            let terms = &system.joints[j];
            system.add_impulse(j, terms.multipliers_to_world(dlambda, q_a), scratch);
            if geometric {
                // While they pass by: the next evaluation need not gather them.
                let [a, b] = system.topology.joints[j];
                pulls[a as usize] += lambda[j].linear * terms.offsets[0];
                pulls[b as usize] -= lambda[j].linear * terms.offsets[1];
            }
        }
        if geometric {
            self.add_loads_pulls();
        }
        let mut largest = T::zero();
        for i in 0..self.segments {
            let mut correction = self.system.correction(i, self.scratch[i]);
            if with_momentum {
                correction = correction.plus(self.momentum[i], T::splat(1.0));
                largest = largest.max(self.motion(i, correction));
            }
            self.poses[i] = moved(self.poses[i], correction, active);
        }
        if formulation.momentum() {
            self.correction = active.select(largest.sqrt(), self.correction);
        }
    }

    /// [`Component::update`] with corrections `dp = M^-1 J^T dlambda` from elsewhere, one entry a body: those of fixed
    /// bodies are left out.
    pub fn correct(&mut self, formulation: Formulation, dp: &[Spatial<T>]) {
        let with_momentum = formulation.momentum() || std::mem::take(&mut self.torques_wait);
        for (lambda, &dlambda) in self.lambda.iter_mut().zip(&self.dlambda) {
            *lambda = lambda.plus(dlambda, T::splat(1.0));
        }
        // The next evaluation gathers those of the new multipliers.
        self.pulls_hold = false;
        for (i, &dp) in dp[..self.segments].iter().enumerate() {
            let zero = if with_momentum { self.momentum[i] } else { Spatial::zero() };
            self.poses[i] = moved(self.poses[i], zero.plus(dp, self.bodies[i].free), T::splat(1.0));
        }
    }

    /// Lines 16 to 19 of Algorithm 1: velocities from the poses, `v = (x' - x) / dt`, `w = 2 Im(q' conj(q)) / dt`, in
    /// the lanes where `active` >= 0; beside them those at the end of the step, where the integrator has them.
    #[inline(never)]
    pub fn update_velocities(&mut self, formulation: Formulation, active: T) {
        T::dispatch(
            #[inline(always)]
            || self.update_velocities_kernel(formulation, active),
        )
    }

    #[inline(always)]
    fn update_velocities_kernel(&mut self, formulation: Formulation, active: T) {
        for i in 0..self.segments {
            let new = self.over_step(i);
            if self.multistep.is_some() {
                self.end_step(i, new, !formulation.momentum(), active);
            }
            self.velocities[i] = select(active, new, self.velocities[i]);
        }
        self.know_step(active);
        self.last_dt = active.select(T::splat(self.dt), self.last_dt);
        self.last_effective = active.select(self.effective, self.last_effective);
        self.take_in(active);
        self.end_eyelets();
        self.end_laws();
        if formulation.momentum() {
            let rate = T::splat(1.0) / self.effective;
            let per_dt2 = rate * rate;
            for (held, pull) in self.held.iter_mut().zip(&self.pulls) {
                let new = Spatial { linear: *pull * per_dt2, angular: Vec3::zero() };
                *held = select(active, new, Spatial { linear: *held, angular: Vec3::zero() }).linear;
            }
            self.keep_rigid_pulls(active);
        }
    }

    /// Velocities of a segment over the step.
    #[inline(always)]
    pub(super) fn over_step(&self, i: usize) -> Spatial<T> {
        let (pose, start) = (&self.poses[i], &self.start[i]);
        let turn = (pose.q * start.q.conj()).upper();
        let (rate, twice) = (T::splat(1.0 / self.dt), T::splat(2.0 / self.dt));
        Spatial { linear: (pose.x - start.x) * rate, angular: turn.v * twice }
    }

    /// Takes the step under way back.
    pub fn roll_back(&mut self) {
        self.poses.copy_from_slice(&self.start);
        self.lambda.fill(Spatial::zero());
        self.roll_back_eyelets();
    }

    /// Movement of a body since the start of the step: of its centre in segment lengths, and its turn [rad].
    pub fn movement(&self, body: usize) -> Spatial<T> {
        let (pose, start) = (&self.poses[body], &self.start[body]);
        let turn = (pose.q * start.q.conj()).upper().v * T::splat(2.0);
        Spatial { linear: (pose.x - start.x) * (T::splat(1.0) / self.bodies[body].length), angular: turn }
    }

    /// Takes the step under way back in one lane.
    pub fn roll_back_lane(&mut self, lane: usize) {
        for (pose, start) in self.poses.iter_mut().zip(&self.start) {
            copy_pose(pose, lane, start, lane);
        }
        for lambda in &mut self.lambda {
            copy_spatial(lambda, lane, &Spatial::<f64>::zero(), 0);
        }
    }
}

/// A pose after a correction, in the lanes where `active` >= 0.
#[inline(always)]
fn moved<T: Real>(old: BodyPose<T>, correction: Spatial<T>, active: T) -> BodyPose<T> {
    select_pose(active, BodyPose { x: old.x + correction.linear, q: old.q.turned(correction.angular) }, old)
}
