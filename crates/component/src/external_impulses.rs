//! What contacts do to a component: impulses on its bodies from outside of its own joints.

use kernels::Spatial;
use kernels::lane::Real;

use super::{BodyPose, Component};
use crate::formulation::Formulation;

impl Component<f64> {
    /// Whether contacts pressed on any body at the end of the last step. Known with a momentum residual alone.
    pub fn is_pressed(&self) -> bool {
        self.pushed.iter().any(|pushed| *pushed != Spatial::zero())
    }
}

impl<T: Real> Component<T> {
    /// The corrections dp of `dlambda` alone, one entry a body: what the next update would do.
    #[inline(always)]
    pub fn corrections(&self, formulation: Formulation, out: &mut Vec<Spatial<T>>) {
        let Self { system, dlambda, .. } = self;
        out.clear();
        out.resize(self.poses.len(), Spatial::zero());
        for (j, &dlambda) in dlambda.iter().enumerate() {
            let q_a = system.frame(j);
            system.add_impulse(j, system.joints[j].multipliers_to_world(dlambda, q_a), out);
        }
        let with_momentum = formulation.momentum() || self.torques_wait;
        for (i, impulse) in out.iter_mut().enumerate() {
            *impulse = system.correction(i, *impulse);
            if with_momentum && i < self.segments {
                *impulse = impulse.plus(self.momentum[i], T::splat(1.0));
            }
        }
    }

    /// Asks for no correction but what `pushes` do, as if the last evaluation had left nothing to solve. In formulations
    /// without momentum residual nothing but the linear system's solution moves the bodies.
    pub fn rest(&mut self, formulation: Formulation) {
        self.dlambda.fill(Spatial::zero());
        if formulation.momentum() {
            self.momentum.fill(Spatial::zero());
            self.system.joints.iter_mut().for_each(|joint| joint.rhs = Spatial::zero());
        }
    }

    /// Takes what `pushes` will do to the joints into the right-hand sides of the linear system, so that its solution
    /// answers it: `b -= J M^-1 pushes`.
    #[inline(always)]
    pub fn answer_pushes(&mut self) {
        let Self { system, scratch, pushes, .. } = self;
        for (i, (own, &push)) in scratch.iter_mut().zip(pushes.iter()).enumerate() {
            *own = system.correction(i, push);
        }
        for j in 0..system.joints.len() {
            let q_a = system.frame(j);
            let terms = &system.joints[j];
            let change = terms.from_world(system.constraint_change(j, scratch), q_a);
            system.joints[j].rhs = terms.rhs.plus(change, T::splat(-1.0));
        }
    }

    /// Moves the bodies by `M^-1 pushes` at once, without an answer of the joints; no update adds them again.
    pub fn push(&mut self) {
        for i in 0..self.segments {
            let correction = self.system.correction(i, self.pushes[i]);
            let BodyPose { x, q } = self.poses[i];
            self.poses[i] = BodyPose { x: x + correction.linear, q: q.turned(correction.angular) };
        }
        self.pushes.fill(Spatial::zero());
        self.correction = T::splat(f64::INFINITY);
    }
}
