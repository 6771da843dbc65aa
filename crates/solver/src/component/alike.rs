//! Components of their own in the lanes of one that is alike: what they begin a step with goes in, what its first linear system is comes back.
//!
//! Constants go in, too, so that one such component serves all that have its connectivity.

use super::Component;
use super::constants::{BodyConstants, JointConstants};
use super::parts::{pick, pick_pose, pick_spatial, put};
use crate::kernel::Spatial;
use crate::kernel::lane::Real;
use crate::kernel::math::Sym3;
use crate::system::{BodyTerms, JointTerms};

impl Component<f64> {
    /// Whether a step begins with nothing but poses, velocities, gravity, damping and air, of rods as the paper has them.
    pub(crate) fn is_plain(&self) -> bool {
        let is_driven = self.has_given || !self.moved.is_empty() || self.multistep.is_some();
        let is_loaded = !(self.loads.is_empty() && self.changing.is_empty());
        let is_other = !(self.rigid.is_empty() && self.loose.is_empty() && self.beyond.is_empty());
        !(is_driven || is_loaded || is_other)
    }
}

impl<T: Real> Component<T> {
    /// Takes what `from`, which is plain and alike, begins a step with into a lane.
    pub(crate) fn take_begin(&mut self, lane: usize, from: &Component<f64>) {
        self.put_motion(lane, from);
        put(&mut self.gravity, lane, from.gravity.0);
        for (rate, own) in self.damping.iter_mut().zip(from.damping) {
            rate.set_lane(lane, own);
        }
        for (body, own) in self.bodies.iter_mut().zip(&from.bodies) {
            let BodyConstants { inverse_mass, transverse, axial, free, length, radius } = *own;
            body.inverse_mass.set_lane(lane, inverse_mass);
            body.transverse.set_lane(lane, transverse);
            body.axial.set_lane(lane, axial);
            body.free.set_lane(lane, free);
            body.length.set_lane(lane, length);
            body.radius.set_lane(lane, radius);
        }
        for (joint, own) in self.joints.iter_mut().zip(&from.joints) {
            let JointConstants { rest_darboux, stretch, shear, bend, twist } = *own;
            put(&mut joint.rest_darboux, lane, rest_darboux.0);
            joint.stretch.set_lane(lane, stretch);
            joint.shear.set_lane(lane, shear);
            joint.bend.set_lane(lane, bend);
            joint.twist.set_lane(lane, twist);
        }
        for (terms, own) in self.system.joints.iter_mut().zip(&from.system.joints) {
            for (offset, own) in terms.offsets.iter_mut().zip(own.offsets) {
                offset.set_lane(lane, own);
            }
            terms.length.set_lane(lane, own.length);
        }
        if let (Some(drag), Some(own)) = (&mut self.drag, &from.drag) {
            drag.put(lane, own);
        }
    }

    /// Gives a lane's component the step's prediction, the linear system there, and its solution `dlambda`.
    pub(crate) fn give_begun(&self, lane: usize, to: &mut Component<f64>) {
        to.start.copy_from_slice(&to.poses);
        for (pose, own) in to.predicted.iter_mut().zip(&self.predicted) {
            *pose = pick_pose(own, lane);
        }
        to.poses.copy_from_slice(&to.predicted);
        to.lambda.fill(Spatial::zero());
        for (dlambda, own) in to.dlambda.iter_mut().zip(&self.dlambda) {
            *dlambda = pick_spatial(own, lane);
        }
        for (pull, own) in to.pulls.iter_mut().zip(&self.pulls) {
            *pull = pick(*own, lane);
        }
        (to.pulls_hold, to.torques_wait) = (self.pulls_hold, false);
        (to.unsolved, to.effective) = (self.unsolved.lane(lane), self.effective.lane(lane));
        (to.time, to.dt) = (self.time, self.dt);
        to.evaluations += 1;
        if self.drag.is_some() {
            for (body, own) in to.bodies.iter_mut().zip(&self.bodies) {
                (body.inverse_mass, body.transverse) = (own.inverse_mass.lane(lane), own.transverse.lane(lane));
            }
        }
        for ((terms, own), pose) in to.system.bodies.iter_mut().zip(&self.system.bodies).zip(&to.poses) {
            *terms = BodyTerms {
                inverse_mass: own.inverse_mass.lane(lane),
                orientation: pose.q,
                axis: pick(own.axis, lane),
                inverse_inertia: Sym3(own.inverse_inertia.0.map(|x| x.lane(lane))),
            };
        }
        for (terms, own) in to.system.joints.iter_mut().zip(&self.system.joints) {
            *terms = JointTerms {
                offsets: terms.offsets,
                length: terms.length,
                shear: own.shear.lane(lane),
                stretch_extra: own.stretch_extra.lane(lane),
                bend: own.bend.lane(lane),
                twist_extra: own.twist_extra.lane(lane),
                s: own.s.lane(lane),
                t: pick(own.t, lane),
                rhs: pick_spatial(&own.rhs, lane),
            };
        }
    }
}
