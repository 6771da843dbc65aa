//! Whether a joint has turned past half a turn in a step, so that what its strain stores is not that of the turn.
//!
//! The strain is made of the sine of half the angle of a relative rotation q, of which q and -q are the same: past half a turn it begins again on the other
//! side, from `v` to `-v` (v: the vector part). Energy `(2 / l) sum K_i (v_i - r_i)^2` stays as it is there where nothing is at rest away from zero. Where it is,
//! with a rest strain `2 r / l`, a law's memory or inner damping, energy jumps by up to `(8 / l) sum K_i |v_i r_i|`, from nowhere.

use kernels::lane::Real;
use kernels::math::Quat;

use super::Component;

impl<T: Real> Component<T> {
    /// 1 in the lanes where a joint that transmits a moment has turned past half a turn since the start of the step, with a rest strain that counts beside
    /// `target` [rad], with a law or with inner damping; 0 elsewhere. At the last evaluation.
    pub fn flips(&self, target: T) -> T {
        T::dispatch(
            #[inline(always)]
            || {
                let (zero, one) = (T::zero(), T::splat(1.0));
                let mut found = zero;
                for (k, terms) in self.system.joints.iter().enumerate() {
                    let rest = self.extras.damped.get(k).map_or(self.joints[k].rest_darboux, |own| own.rest_darboux);
                    let mirrored = rest.norm_squared() * (T::splat(4.0) * terms.length * terms.length);
                    let strained = if self.laws.has(k) { one } else { (target * target - mirrored).select(zero, one) };
                    if (0..T::LANES).all(|lane| strained.lane(lane) == 0.0) {
                        continue;
                    }
                    let [a, b] = self.system.topology.joints[k].map(|body| body as usize);
                    let relative = |a: Quat<T>, b: Quat<T>| {
                        let [a, b] = self.extras.rests.get(k).map_or([a, b], |rests| [a * rests[0], b * rests[1]]);
                        (a.conj() * b).upper()
                    };
                    let before = relative(self.start[a].q, self.start[b].q);
                    let now = relative(self.poses[a].q, self.poses[b].q);
                    let same = before.w * now.w + before.v.dot(now.v);
                    let moment = self.lambda[k].angular.norm_squared();
                    found = found.max(same.select(zero, (-moment).select(zero, strained)));
                }
                found
            },
        )
    }
}
