//! The way back over what several steps add to a prediction: derivatives with respect to what went in.

use super::Multistep;
use crate::component::BodyBar;
use crate::component::predict::angular_momentum;
use crate::kernel::Spatial;
use crate::kernel::math::Vec3;

impl Multistep<f64> {
    /// By how much velocities at the end of the step under way are beyond those over it, as a share of the change since the
    /// last one.
    pub(in crate::component) fn further(&self) -> f64 {
        self.ratio / (1.0 + self.ratio)
    }

    /// Back over [`Multistep::predicted`] in steps of these lengths, this one and the last: to the state, and to the rates of
    /// damping.
    #[inline(always)]
    pub(in crate::component) fn carry_back(
        &self,
        body: usize,
        bar: Spatial<f64>,
        [dt, last_dt]: [f64; 2],
        start: &mut BodyBar,
        damping: &mut [f64; 2],
    ) {
        let (share, weight) = (self.share, self.weight);
        let [kept, before] = self.decay;
        let (brought, earlier) = (self.brought(body), self.earlier[body]);
        let mut back = |k: usize, bar: Vec3<f64>, brought: Vec3<f64>, earlier: Vec3<f64>| {
            let lost = weight * before[k] * kept[k];
            damping[k] += bar.dot(earlier) * lost * last_dt - bar.dot(brought) * dt;
            [bar * ((1.0 + weight) * kept[k]), bar * -lost]
        };
        let [now, then] = back(0, bar.linear * share, brought.linear, earlier.linear);
        let [now_turning, then_turning] = back(1, bar.angular * share, brought.angular, earlier.angular);
        start.now = start.now.plus(Spatial { linear: now, angular: now_turning }, 1.0);
        start.earlier = start.earlier.plus(Spatial { linear: then, angular: then_turning }, 1.0);
        start.velocity.linear += bar.linear * (1.0 - share);
        start.over += bar.angular * (1.0 - share);
    }
}

/// `p = s I w - h w x I w`, the momentum of a turn with `h w` the sine and s the cosine of half its angle, and the derivative
/// with respect to w from that with respect to p.
#[inline(always)]
pub(in crate::component) fn momentum_back(
    inertia: impl Fn(Vec3<f64>) -> Vec3<f64>,
    w: Vec3<f64>,
    half: f64,
    bar: Vec3<f64>,
) -> [Vec3<f64>; 2] {
    let (turning, cosine) = (inertia(w), (1.0 - (w * half).norm_squared()).max(0.0).sqrt());
    let crossed = turning.cross(bar) + inertia(bar.cross(w));
    let of_w = inertia(bar) * cosine - w * (half * half * bar.dot(turning) / cosine) - crossed * half;
    [angular_momentum(turning, w * half), of_w]
}

/// Derivatives with respect to theta and phi from that with respect to [`gyroscopic`].
#[inline(always)]
pub(in crate::component) fn gyroscopic_back(
    inertia: impl Fn(Vec3<f64>) -> Vec3<f64>,
    theta: Vec3<f64>,
    phi: Vec3<f64>,
    bar: Vec3<f64>,
) -> [Vec3<f64>; 2] {
    let turned = inertia(bar);
    let of_theta = phi.cross(turned) - inertia(phi).cross(bar) + inertia(bar.cross(phi));
    let of_phi = turned.cross(theta) - inertia(bar.cross(theta)) + inertia(theta).cross(bar);
    [of_theta * 0.5, of_phi * 0.5]
}
