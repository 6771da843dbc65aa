//! The way back over what several steps add to a prediction: derivatives with respect to what went in.

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;

use super::Multistep;
use crate::BodyBar;
use crate::turns::angular_momentum;

impl<T: Real> Multistep<T> {
    /// By how much velocities at the end of the step under way are beyond those over it, as a share of the change since the
    /// last one.
    #[inline(always)]
    pub(crate) fn further(&self) -> T {
        self.ratio / (T::splat(1.0) + self.ratio)
    }

    /// The part of what velocities gained in the step before that a restart after the step under way adds to those over it.
    #[inline(always)]
    pub(crate) fn rest(&self) -> T {
        self.ratio * T::splat(0.5)
    }

    /// Back over [`Multistep::predicted`] in steps of these lengths, this one and the last: to the state, and to the rates of
    /// damping.
    #[inline(always)]
    pub(crate) fn carry_back(
        &self,
        body: usize,
        bar: Spatial<T>,
        [dt, last_dt]: [T; 2],
        start: &mut BodyBar<T>,
        damping: &mut [T; 2],
    ) {
        let (share, weight, one) = (self.share, self.weight, T::splat(1.0));
        let [kept, before] = self.decay;
        let (brought, earlier) = (self.brought(body), self.earlier[body]);
        let mut back = |k: usize, bar: Vec3<T>, brought: Vec3<T>, earlier: Vec3<T>| {
            let lost = weight * before[k] * kept[k];
            damping[k] += bar.dot(earlier) * lost * last_dt - bar.dot(brought) * dt;
            [bar * ((one + weight) * kept[k]), bar * -lost]
        };
        let [now, then] = back(0, bar.linear * share, brought.linear, earlier.linear);
        let [now_turning, then_turning] = back(1, bar.angular * share, brought.angular, earlier.angular);
        start.now = start.now.plus(Spatial { linear: now, angular: now_turning }, one);
        start.earlier = start.earlier.plus(Spatial { linear: then, angular: then_turning }, one);
        start.velocity.linear += bar.linear * (one - share);
        start.over += bar.angular * (one - share);
    }
}

/// `p = s I w - h w x I w`, the momentum of a turn with `h w` the sine and s the cosine of half its angle, and the derivative
/// with respect to w from that with respect to p.
#[inline(always)]
pub(crate) fn momentum_back<T: Real>(
    inertia: impl Fn(Vec3<T>) -> Vec3<T>,
    w: Vec3<T>,
    half: T,
    bar: Vec3<T>,
) -> [Vec3<T>; 2] {
    let (turning, cosine) = (inertia(w), (T::splat(1.0) - (w * half).norm_squared()).max(T::zero()).sqrt());
    let crossed = turning.cross(bar) + inertia(bar.cross(w));
    let of_w = inertia(bar) * cosine - w * (half * half * bar.dot(turning) / cosine) - crossed * half;
    [angular_momentum(turning, w * half), of_w]
}

/// Derivatives with respect to theta and phi from that with respect to [`gyroscopic`].
#[inline(always)]
pub(crate) fn gyroscopic_back<T: Real>(
    inertia: impl Fn(Vec3<T>) -> Vec3<T>,
    theta: Vec3<T>,
    phi: Vec3<T>,
    bar: Vec3<T>,
) -> [Vec3<T>; 2] {
    let turned = inertia(bar);
    let of_theta = phi.cross(turned) - inertia(phi).cross(bar) + inertia(bar.cross(phi));
    let of_phi = turned.cross(theta) - inertia(bar.cross(theta)) + inertia(theta).cross(bar);
    [of_theta * T::splat(0.5), of_phi * T::splat(0.5)]
}
