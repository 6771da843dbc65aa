//! Whether a rod is pressed so far beyond its buckling load that what a step found is a saddle of its incremental potential, and not a minimum.
//!
//! Two segments in a row, of lengths l and l', whose joint moves across both of them by y while all else stays, turn by y / l and y / l'. Bending (a joint's
//! stiffness k at each of three joints at most) and inertia resist, and a force P that presses along them gains (Timoshenko and Gere 1961, section 2.3, for
//! a bar of two links):
//!
//! ```text
//! k (1/l^2 + (1/l + 1/l')^2 + 1/l'^2) + (m (1/4 + I / (m l^2)) + m' (...)) / dt^2 < P (1/l + 1/l')
//! ```
//!
//! Where that holds the state is not stable, whatever the rest of the rod does.

use kernels::lane::Real;

use super::Component;

impl<T: Real> Component<T> {
    /// 1 in the lanes where two segments in a row are pressed beyond the load at which they buckle, 0 elsewhere: at the last evaluation of
    /// formulation `newton`. What contacts, eyelets or pulleys press is left out, as they may hold it.
    pub fn buckles(&self) -> T {
        let mut found = T::zero();
        if !self.laws.is_empty() || self.slides() {
            return found;
        }
        T::dispatch(
            #[inline(always)]
            || {
                let (zero, one) = (T::zero(), T::splat(1.0));
                let stiffness = self.system.joints.iter().map(|terms| one / (terms.length * terms.length * terms.bend));
                let stiffest = stiffness.fold(zero, T::max);
                for ((terms, &[a, b]), lambda) in
                    self.system.joints.iter().zip(&self.system.topology.joints).zip(&self.lambda)
                {
                    let [a, b] = [a as usize, b as usize];
                    if a.max(b) >= self.segments {
                        continue;
                    }
                    let [first, second] = [&self.bodies[a], &self.bodies[b]];
                    let half = T::splat(0.5);
                    let reach = [terms.offsets[0] - first.length * half, terms.offsets[1] + second.length * half];
                    let press = [a, b].map(|body| -lambda.linear.dot(self.system.bodies[body].axis));
                    let [by_first, by_second] = [one / first.length, one / second.length];
                    let gained = press[0] * by_first + press[1] * by_second;
                    let both = by_first + by_second;
                    let bent = stiffest * (by_first * by_first + both * both + by_second * by_second);
                    let moved = |body: &super::constants::BodyConstants<T>, by: T| {
                        T::splat(0.25) / body.inverse_mass + body.transverse * by * by
                    };
                    let resists = bent + moved(first, by_first) + moved(second, by_second);
                    let is_there = (gained - resists).select(one, zero) * first.free * second.free;
                    for lane in (0..T::LANES).filter(|&lane| is_there.lane(lane) > 0.0) {
                        let is_end = |x: T, length: T| x.lane(lane).abs() <= 1e-9 * length.lane(lane);
                        let is_pushed =
                            |body: usize| self.pushed.get(body).is_some_and(|push| push.dot(*push).lane(lane) != 0.0);
                        let in_a_row = is_end(reach[0], first.length) && is_end(reach[1], second.length);
                        if in_a_row && !is_pushed(a) && !is_pushed(b) {
                            found.set_lane(lane, 1.0);
                        }
                    }
                }
                found
            },
        )
    }
}
