//! Turns in a step that are too large for their measures: joints past half a turn, segments past a right angle.
//!
//! The strain goes with the vector part v of a relative rotation q, of which q and -q are the same: past half a turn it begins again on the other side, with -v
//! for v. A rod that folds so is as one that has been folded from the other side, and its energy stays what it is where nothing is at rest away from zero. With
//! a strain at rest, a law's memory or inner damping energy jumps, from nowhere; and a joint that is twisted so loses a whole turn.
//!
//! The discrete momentum of a turn by an angle is `I sin(angle) / dt`: it falls from a right angle on, where a torque of a load slows the spin that it should drive.

use kernels::lane::Real;
use kernels::math::Quat;
use rod::StrainMeasure;

use super::Component;

impl<T: Real> Component<T> {
    /// 1 in the lanes where loads alone have turned a segment by more than a right angle in the step under way, else 0.
    pub fn overturns(&self) -> T {
        let turned_by_loads = self.turned_by_loads();
        if (0..T::LANES).all(|lane| turned_by_loads.lane(lane) == 0.0) {
            return T::zero();
        }
        T::dispatch(
            #[inline(always)]
            || {
                let (zero, half) = (T::zero(), T::splat(0.5));
                let turns = self.start.iter().zip(&self.poses).zip(&self.bodies).take(self.segments);
                let found = turns.fold(zero, |found, ((start, pose), constants)| {
                    let cosine = start.q.w * pose.q.w + start.q.v.dot(pose.q.v);
                    (cosine * cosine - half).select(found, found.max(constants.free))
                });
                found * turned_by_loads
            },
        )
    }

    /// Whether a joint of a lane has turned past half a turn in the step under way: mostly about its axis, or with a rest strain that counts beside `target` [rad],
    /// a law or inner damping. Joints that turn freely, and those that transmit nothing, may.
    pub fn is_past_half_turn(&self, lane: usize, target: f64) -> bool {
        self.system.joints.iter().zip(&self.joints).enumerate().any(|(k, (terms, constants))| {
            // Inner damping leaves of the strain before the step a share as a rest strain.
            let rest = self.extras.damped.get(k).map_or(constants.rest, |own| own.rest);
            let angle = rest.norm_squared().lane(lane).sqrt() * terms.length.lane(lane);
            let may_fold = angle <= target && !self.laws.has(k);
            let may_slip = self.strain_measure == StrainMeasure::Angle;
            if may_fold && !may_slip {
                return false;
            }
            let [a, b] = self.system.topology.joints[k].map(|body| body as usize);
            let relative = |[a, b]: [Quat<T>; 2]| {
                let [a, b] = self.extras.rests.get(k).map_or([a, b], |rests| [a * rests[0], b * rests[1]]);
                a.conj() * b
            };
            let before = relative([self.start[a].q, self.start[b].q]);
            let now = relative([self.followed(a), self.followed(b)]);
            // A joint that has turned by half a turn about its axis, or has slipped by a whole one, has lost a turn of its twist.
            let is_twisted = 2.0 * now.v.0[2].lane(lane).powi(2) > now.v.norm_squared().lane(lane);
            let slips = may_slip && (before.w * now.w).lane(lane) < 0.0 && is_twisted;
            let (before, now) = (before.upper(), now.upper());
            let folds = !may_fold && (before.w * now.w + before.v.dot(now.v)).lane(lane) < 0.0;
            // Last, as it looks at all that is loose.
            (slips || folds) && !self.is_loose(k, lane)
        })
    }

    /// The orientation of a body now. That of what moves freely has come from its start by small turns, and keeps its sign; of what is driven either sign may be
    /// given, and the nearer one counts.
    fn followed(&self, body: usize) -> Quat<T> {
        let (start, now) = (self.start[body].q, self.poses[body].q);
        let nearer = (start.w * now.w + start.v.dot(now.v)).select(T::splat(1.0), T::splat(-1.0));
        let sign = (-self.bodies[body].free).select(nearer, T::splat(1.0));
        Quat { v: now.v * sign, w: now.w * sign }
    }
}
