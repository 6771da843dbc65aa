//! Joints that come apart: what is held is led where the rods cannot follow.

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};
use rod::Joint;

use super::Component;
use super::parts::select;
use crate::APART;

impl<T: Real> Component<T> {
    /// Not negative where a joint that does not yield in effect answers with such a force that it gapes by more than [`APART`]
    /// of its length, a lane each. The compliance of such joints is there for the solver's sake: a gap as wide solves the
    /// equations, and is no motion of the rod.
    #[inline(always)]
    pub fn gapes(&self) -> T {
        let (rigid, none) = (T::splat(Joint::RIGID), T::splat(-1.0));
        let mut worst = none;
        for ((terms, constants), lambda) in self.system.joints.iter().zip(&self.joints).zip(&self.lambda) {
            let (gap, most) = (terms.shear, terms.length * T::splat(APART));
            let beyond = lambda.linear.norm_squared() * (gap * gap) - most * most;
            let yields = constants.shear.max(constants.stretch);
            worst = worst.max((rigid - yields).select(beyond, none));
        }
        worst
    }

    /// Whether a joint was apart already when the step under way began, in any lane: a shorter step does not help.
    pub fn begins_apart(&self) -> bool {
        let ends = self.system.topology.joints.iter().zip(&self.system.joints).zip(&self.joints);
        ends.enumerate().any(|(k, ((ends, terms), constants))| {
            let [a, b] = ends.map(|body| &self.start[body as usize]);
            let mut gap = a.x - b.x + a.q.axis() * terms.offsets[0] - b.q.axis() * terms.offsets[1];
            if let Some(places) = self.extras.across.get(k) {
                gap = gap + a.q.rotate(places[0]) - b.q.rotate(places[1]);
            }
            let most = terms.length * T::splat(APART);
            let beyond = gap.norm_squared() - most * most;
            let yields = constants.shear.max(constants.stretch);
            (0..self.used)
                .any(|lane| beyond.lane(lane) > 0.0 && yields.lane(lane) <= Joint::RIGID && !self.is_loose(k, lane))
        })
    }

    /// Ends a step that has no solution: what moves freely stays where it was, what is held is where it is led.
    pub fn stay(&mut self) {
        for ((pose, start), constants) in self.poses.iter_mut().zip(&self.start).zip(&self.bodies) {
            let free = constants.free - T::splat(0.5);
            let of = |linear, angular| Spatial { linear, angular };
            let kept = select(free, of(start.x, start.q.v), of(pose.x, pose.q.v));
            (pose.x, pose.q) = (kept.linear, Quat { v: kept.angular, w: free.select(start.q.w, pose.q.w) });
        }
        self.lambda.fill(Spatial::zero());
        self.roll_back_eyelets();
        self.rest_eyelets();
        if self.slides() {
            // Pulleys press as they did before the step.
            self.begin_pulleys();
            self.gather_eyelets();
        }
        self.pushed.fill(Spatial::zero());
        self.pulls.fill(Vec3::zero());
        self.pulls_hold = false;
    }
}
