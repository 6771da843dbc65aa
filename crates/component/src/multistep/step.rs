//! The steps of a component that build on those before.

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};
use rod::Integrator;

use super::Multistep;
use crate::Component;
use crate::parts::{copy_lane, pick, pick_pose, put, select};
use crate::turns::{angular_momentum, rate};

/// Largest ratio of a step to the one before it: beyond 1 + sqrt 2 errors would grow from step to step. A longer step is one
/// of Euler's rule.
const LARGEST_RATIO: f64 = 2.0 + 1e-6;

/// Steps of Euler's rule after an impact. The first one still ends it: it begins with velocities from its midst, on which no second order may build.
const RESTART_STEPS: f64 = 2.0;

impl<T: Real> Component<T> {
    /// Integrates from here on by a rule; components begin with Euler's. Poses and velocities stay.
    pub fn integrate_by(&mut self, integrator: Integrator) {
        let (zero, one) = (T::zero(), T::splat(1.0));
        self.multistep = (integrator == Integrator::Bdf2).then(|| {
            let now = vec![Spatial::zero(); self.segments];
            Box::new(Multistep {
                earlier: now.clone(),
                now,
                over: vec![Vec3::zero(); self.segments],
                bodies: self.bodies[..self.segments].to_vec(),
                moments: self.all_moments(),
                goes_on: T::splat(-1.0),
                held_back: false,
                ratio: zero,
                share: one,
                weight: zero,
                decay: [[one; 2]; 2],
                gained: vec![Spatial::zero(); self.segments],
            })
        });
        let Some(steps) = &mut self.multistep else { return };
        for (i, velocity) in self.velocities[..self.segments].iter().enumerate() {
            steps.now[i].linear = velocity.linear;
            // Rates become momenta when the next step says how long it is.
            self.given[i] = zero;
        }
        self.has_given = self.segments > 0;
    }

    /// Whether the step that is to come can build on those before, in all lanes; Euler's rule always can.
    pub fn can_go_on(&self) -> bool {
        let Some(steps) = &self.multistep else { return true };
        let spun = self.spun_far();
        (0..T::LANES).all(|lane| steps.goes_on.lane(lane) >= 0.0 && spun.lane(lane) == 0.0)
    }

    /// Whether the step under way goes on from those before, in a lane.
    pub fn is_of_second_order(&self, lane: usize) -> bool {
        self.multistep.as_ref().is_some_and(|steps| steps.rest().lane(lane) > 0.0)
    }

    /// Says whether the steps to come are of Euler's rule, whatever is known of those before.
    pub fn hold_back(&mut self, held_back: bool) {
        if let Some(steps) = &mut self.multistep {
            steps.held_back = held_back;
        }
    }

    /// Length of the step of implicit Euler that the step under way amounts to [s]: its own with Euler's rule. Multipliers
    /// are forces times its square.
    pub fn effective_dt(&self) -> f64 {
        self.effective.lane(0)
    }

    /// Begins a step of `dt` [s] at `time` [s]: what the steps before say for it.
    #[inline(always)]
    pub(crate) fn begin_step(&mut self, time: f64, dt: f64) {
        (self.time, self.dt) = (time, dt);
        self.effective = T::splat(dt);
        let (last_dt, one) = (self.last_dt, T::splat(1.0));
        let spun = if self.multistep.is_some() { self.spun_far() } else { T::zero() };
        let Some(steps) = &mut self.multistep else { return };
        for lane in 0..T::LANES {
            let last = last_dt.lane(lane);
            let knows = steps.goes_on.lane(lane) >= 0.0 && spun.lane(lane) == 0.0;
            let goes_on = knows && !steps.held_back && dt <= LARGEST_RATIO * last;
            steps.ratio.set_lane(lane, if goes_on { dt / last } else { 0.0 });
        }
        for (k, rate) in self.damping.into_iter().enumerate() {
            let kept = |over: T| if rate == T::zero() { one } else { (-rate * over).exp() };
            (steps.decay[0][k], steps.decay[1][k]) = (kept(T::splat(dt)), kept(last_dt));
        }
        let ratio = steps.ratio;
        let scale = one / (one + ratio + ratio);
        (steps.share, steps.weight) = ((one + ratio) * scale, ratio * ratio * scale);
        self.effective = self.effective * steps.share;
    }

    /// The square of the sine of half the turn of a segment in the last step.
    #[inline(always)]
    fn turned(&self, segment: usize) -> T {
        (self.velocities[segment].angular * self.last_half()).norm_squared()
    }

    /// 1 in the lanes where loads alone have turned a segment by more than 60 degrees in the last step, else 0. The discrete momentum of such a turn,
    /// `I sin(angle) / dt`, hardly grows any more with the angle: steps are of Euler's rule then, and go on with the rate.
    fn spun_far(&self) -> T {
        let turned_by_loads = self.turned_by_loads();
        if (0..T::LANES).all(|lane| turned_by_loads.lane(lane) == 0.0) {
            return turned_by_loads;
        }
        let most = (0..self.segments).map(|i| self.turned(i)).fold(T::zero(), T::max);
        (most - T::splat(0.25)).select(turned_by_loads, T::zero())
    }

    /// The momenta of rates that were given since the last step, and of what has spun far: `I w`, with the variable of a step of the length of the one
    /// under way as its discrete momentum has it, so that a spin about a main axis goes on at its rate.
    pub(crate) fn take_momenta_of_rates(&mut self) {
        if self.multistep.is_none() {
            return;
        }
        let spun = self.spun_far();
        let has_spun = |lane: usize| spun.lane(lane) != 0.0;
        if !(self.has_given || (0..T::LANES).any(has_spun)) {
            return;
        }
        for i in 0..self.segments {
            let (variable, half) = self.variable(i, self.last_half());
            let q = self.poses[i].q;
            let Some(steps) = &mut self.multistep else { return };
            let u = variable * half;
            let cosine = (T::splat(1.0) - u.norm_squared()).max(T::zero()).sqrt();
            let momentum = steps.inertia(i, q, variable) * cosine;
            for lane in 0..T::LANES {
                if has_spun(lane) || self.given[i].lane(lane) >= 0.0 {
                    copy_lane(&mut steps.now[i].angular, lane, momentum);
                }
            }
        }
    }

    /// Velocities at the end of the step under way, in the lanes where `active` >= 0, from those over it, `new`, and over the
    /// last one, which are still the component's. Where `by_spin`, the momenta of the steps before keep what they have about
    /// the segment's axis as it tilts: see the module.
    #[inline(always)]
    pub(crate) fn end_step(&mut self, body: usize, new: Spatial<T>, by_spin: bool, active: T) {
        let half = T::splat(0.5 * self.dt);
        let (start, end) = (self.start[body].q, self.poses[body].q);
        let Some(steps) = &mut self.multistep else { return };
        let axis = end.axis();
        let tilt = if by_spin { steps.tilt(body, start, axis) } else { Vec3::zero() };
        let carried = |momentum: Vec3<T>| momentum - axis * tilt.dot(momentum);
        let old = Spatial { linear: self.velocities[body].linear, angular: carried(steps.over[body]) };
        let before = Spatial { linear: steps.now[body].linear, angular: carried(steps.now[body].angular) };
        let turning = steps.inertia(body, end, new.angular);
        let new = Spatial { linear: new.linear, angular: angular_momentum(turning, new.angular * half) };
        let further = steps.ratio / (T::splat(1.0) + steps.ratio);
        let now = new.plus(new.plus(old, T::splat(-1.0)), further);
        let kept = Spatial { linear: steps.now[body].linear, angular: steps.over[body] };
        let gained = steps.now[body].plus(steps.earlier[body], T::splat(-1.0));
        steps.gained[body] = select(active, gained, steps.gained[body]);
        steps.over[body] = select(active, new, kept).angular;
        steps.earlier[body] = select(active, before, steps.earlier[body]);
        steps.now[body] = select(active, now, steps.now[body]);
    }

    /// After a step that is accepted in the lanes where `active` >= 0, others can go on from it.
    #[inline(always)]
    pub(crate) fn know_step(&mut self, active: T) {
        if let Some(steps) = &mut self.multistep {
            let nearer = -(-T::splat(1.0) - steps.goes_on).max(T::zero());
            steps.goes_on = active.select(nearer, steps.goes_on);
        }
    }

    /// Restarts the integrator in the lanes where `active` >= 0: something in the last step, such as an impact, will not go on.
    /// The next step begins with the velocities over the last one, which are those in its middle, and with what the smooth forces of
    /// the step before add in the half of a step to its end: half of what velocities gained in that one.
    pub fn begin_anew(&mut self, active: T) {
        let Some(steps) = &mut self.multistep else { return };
        // The velocities over a step of Euler's rule are those at its end already.
        let rest = steps.rest();
        for i in 0..self.segments {
            let over = Spatial { linear: self.velocities[i].linear, angular: steps.over[i] };
            steps.now[i] = select(active, over.plus(steps.gained[i], rest), steps.now[i]);
        }
        steps.goes_on = active.select(T::splat(-RESTART_STEPS), steps.goes_on);
    }

    /// Forgets the steps before, so that the next one is of Euler's rule.
    pub fn restart(&mut self) {
        (0..T::LANES).for_each(|lane| self.forget_steps(lane));
    }

    /// Forgets the steps before in a lane: velocities at the start of the next step are all there is.
    pub(crate) fn forget_steps(&mut self, lane: usize) {
        if let Some(steps) = &mut self.multistep {
            steps.goes_on.set_lane(lane, steps.goes_on.lane(lane).min(-1.0));
        }
    }

    /// Velocity of a segment at the end of the last step, or given since [m/s].
    pub fn velocity(&self, body: usize, lane: usize) -> Vec3<f64> {
        let of_step = self.velocities[body].linear;
        let is_fixed = self.bodies[body].free.lane(lane) == 0.0;
        let own = self.multistep.as_ref().filter(|_| !is_fixed).map_or(of_step, |steps| steps.now[body].linear);
        pick(own, lane)
    }

    /// Sets that velocity, between two steps. Of what moves freely nothing is known then but velocities.
    pub(crate) fn give_velocity(&mut self, body: usize, lane: usize, v: Vec3<f64>) {
        put(&mut self.velocities[body].linear, lane, v.0);
        let is_free = self.bodies[body].free.lane(lane) != 0.0;
        let Some(steps) = &mut self.multistep else { return };
        put(&mut steps.now[body].linear, lane, v.0);
        if is_free {
            self.forget_steps(lane);
        }
    }

    /// What a segment's rate at the end of the last step is beyond that over it [rad/s].
    pub(crate) fn beyond(&self, body: usize, lane: usize) -> Vec3<f64> {
        let Some(steps) = &self.multistep else { return Vec3::zero() };
        let u = pick(self.velocities[body].angular, lane) * (0.5 * self.last_dt.lane(lane));
        let end = pick_pose(&self.poses[body], lane).q;
        let momenta = [steps.now[body].angular, steps.over[body]].map(|momentum| pick(momentum, lane));
        further(pick(steps.own_moments(body), lane), u, end, momenta)
    }

    /// Velocity of a segment at the end of the last step [m/s, rad/s].
    pub(crate) fn velocity_at_end(&self, body: usize) -> Spatial<T> {
        let Spatial { linear, angular } = self.velocities[body];
        let over_step = rate(angular, self.last_dt);
        let Some(steps) = &self.multistep else { return Spatial { linear, angular: over_step } };
        let (u, end) = (angular * (self.last_dt * T::splat(0.5)), self.poses[body].q);
        let further = further(steps.own_moments(body), u, end, [steps.now[body].angular, steps.over[body]]);
        Spatial { linear: steps.now[body].linear, angular: over_step + further }
    }
}

/// What the rate at the end of a step, which turned by about `2 u` to `end`, is beyond that over it: with the angular `momenta`
/// at its end and over it, and the `moments` of inertia.
fn further<T: Real>(moments: Vec3<T>, u: Vec3<T>, end: Quat<T>, momenta: [Vec3<T>; 2]) -> Vec3<T> {
    let one = T::splat(1.0);
    let cosine = (one - u.norm_squared()).max(T::zero()).sqrt();
    let middle = Quat { v: u, w: one + cosine }.normalized().conj() * end;
    let rate = |q: Quat<T>, momentum: Vec3<T>| {
        let own = q.rotate_back(momentum);
        q.rotate(Vec3([0, 1, 2].map(|k| own.0[k] / moments.0[k])))
    };
    rate(end, momenta[0]) - rate(middle, momenta[1])
}
