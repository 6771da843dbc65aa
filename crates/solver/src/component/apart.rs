//! Joints that come apart: what is held is led where the rods cannot follow.

use rod::Joint;

use super::Component;
use super::update::select;
use crate::kernel::Spatial;
use crate::kernel::lane::Real;
use crate::kernel::math::{Quat, Vec3};
use crate::limits::APART;

/// Cosine of half the angle of a joint, below which it may have passed half a turn in a step: one that slips a turn of twist stood at a
/// right angle.
const NEAR_HALF_A_TURN: f64 = 0.85;

impl<T: Real> Component<T> {
    /// Not negative where a joint that does not yield in effect answers with such a force that it gapes by more than [`APART`]
    /// of its length, a lane each. The compliance of such joints is there for the solver's sake: a gap as wide solves the
    /// equations, and is no motion of the rod.
    #[inline(always)]
    pub(crate) fn gapes(&self) -> T {
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

    /// Not negative where a joint has passed half a turn in the step under way, a lane each: where the relative quaternion of its
    /// bodies, followed from the start of the step, has changed its sign. Joints that turn freely may do so.
    pub(crate) fn loses_turn(&self) -> T {
        let none = T::splat(-1.0);
        let mut lost = none;
        for (k, (terms, ends)) in self.system.joints.iter().zip(&self.system.topology.joints).enumerate() {
            let near = T::splat(NEAR_HALF_A_TURN) - terms.s;
            if (0..self.used).all(|lane| near.lane(lane) < 0.0) {
                continue;
            }
            let dot = |p: Quat<T>, q: Quat<T>| p.w * q.w + p.v.dot(q.v);
            let [now, start] = [&self.poses, &self.start].map(|poses| ends.map(|body| poses[body as usize].q));
            // What a motion drives may change the sign of its quaternion without turning.
            let sign = dot(now[0], start[0]) * dot(now[1], start[1]);
            let [now, start] = [now, start].map(|[a, b]| match self.beyond.rests.get(k) {
                None => dot(a, b),
                Some(rests) => dot(a * rests[0], b * rests[1]),
            });
            let crosses = near.select(-(now * start * sign), none);
            for lane in (0..self.used).filter(|&lane| crosses.lane(lane) > 0.0 && !self.is_loose(k, lane)) {
                lost.set_lane(lane, 1.0);
            }
        }
        lost
    }

    /// Whether a joint was apart already when the step under way began, in any lane: a shorter step does not help.
    pub(crate) fn begins_apart(&self) -> bool {
        let ends = self.system.topology.joints.iter().zip(&self.system.joints).zip(&self.joints);
        ends.enumerate().any(|(k, ((ends, terms), constants))| {
            let [a, b] = ends.map(|body| &self.start[body as usize]);
            let mut gap = a.x - b.x + a.q.axis() * terms.offsets[0] - b.q.axis() * terms.offsets[1];
            if let Some(places) = self.beyond.across.get(k) {
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
    pub(crate) fn stay(&mut self) {
        for ((pose, start), constants) in self.poses.iter_mut().zip(&self.start).zip(&self.bodies) {
            let free = constants.free - T::splat(0.5);
            let of = |linear, angular| Spatial { linear, angular };
            let kept = select(free, of(start.x, start.q.v), of(pose.x, pose.q.v));
            (pose.x, pose.q) = (kept.linear, Quat { v: kept.angular, w: free.select(start.q.w, pose.q.w) });
        }
        self.lambda.fill(Spatial::zero());
        self.pushed.fill(Spatial::zero());
        self.pulls.fill(Vec3::zero());
        self.pulls_hold = false;
    }
}
