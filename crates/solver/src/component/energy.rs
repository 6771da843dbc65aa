//! What energy a component gains in a step: contacts and joints can only take it.

use super::{BodyPose, Component};
use crate::kernel::Spatial;
use crate::kernel::math::Vec3;

impl Component<f64> {
    /// Whether more than gravity, steady loads, joints and contacts do work in the step under way, or the integrator keeps
    /// more of the steps before than velocities.
    pub(crate) fn has_other_work(&self) -> bool {
        let zero = Vec3::zero();
        let is_led = |i: usize| {
            let Spatial { linear, angular } = self.velocities[i];
            self.bodies[i].free == 0.0 && (linear != zero || angular != zero)
        };
        self.drag.is_some() || self.changes() || self.multistep.is_some() || (0..self.segments).any(is_led)
    }

    /// Energy in the joints [J] at the multipliers lambda of a step that is solved: `alpha lambda^2 / 2 dt^4`.
    pub(crate) fn stored(&self) -> f64 {
        let system = &self.system;
        let of = |(j, Spatial { linear, angular }): (usize, &Spatial<f64>)| {
            let [a, b, c] = system.bend_twist_compliance(j).0;
            let [x, y, z] = angular.0;
            linear.dot(system.stretch_compliance(j).apply(*linear)) + a * x * x + b * y * y + c * z * z
        };
        0.5 * self.lambda.iter().enumerate().map(of).sum::<f64>() / self.effective.powi(2)
    }

    /// Kinetic energy at the start of the step under way, and how much of it is won by its end beyond the work of gravity and
    /// loads [J]. Rotations count by what stands for their rates in a step of this length: in one of another it is not the same, and
    /// a free rotation keeps it, not its rate, from step to step.
    pub(crate) fn kinetic_and_won(&self) -> [f64; 2] {
        let (mut kinetic, mut won) = (0.0, 0.0);
        for i in (0..self.segments).filter(|&i| self.bodies[i].free != 0.0) {
            let (mass, moments) = (1.0 / self.bodies[i].inverse_mass, self.moments(i, 0));
            let of = |velocity: Spatial<f64>, pose: &BodyPose<f64>| {
                let w = pose.q.rotate_back(velocity.angular);
                let turning: f64 = w.0.iter().zip(moments.0).map(|(w, moment)| moment * w * w).sum();
                0.5 * (mass * velocity.linear.norm_squared() + turning)
            };
            let (angular, _) = self.variable_of(i);
            let before = of(Spatial { linear: self.velocities[i].linear, angular }, &self.start[i]);
            kinetic += before;
            won += of(self.over_step(i), &self.poses[i]) - before;
            won -= mass * self.gravity.dot(self.poses[i].x - self.start[i].x);
        }
        for load in &self.loads {
            let (start, end) = (&self.start[load.body], &self.poses[load.body]);
            let place = |pose: &BodyPose<f64>| pose.x + pose.q.axis() * load.offset;
            let turn = (end.q * start.q.conj()).upper().v * 2.0;
            won -= load.force.dot(place(end) - place(start)) + load.torque.dot(turn);
        }
        [kinetic, won]
    }
}
