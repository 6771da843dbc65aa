//! The backward differences of second order (BDF2): what the steps before add to a prediction.
//!
//! With omega, the length of a step over that of the one before, and `beta = (1 + omega) / (1 + 2 omega)`, the rule is
//!
//! ```text
//! v' = (1 + omega^2 / (1 + 2 omega)) v - omega^2 / (1 + 2 omega) v_before + h~ M^-1 f',    h~ = beta dt,
//! (x' - x) / dt = beta v' + (1 - beta) (x - x_before) / dt_before
//! ```
//!
//! so that a step is one of implicit Euler of length h~ from another prediction: compliances are divided by h~^2, forces
//! multiplied by it. omega = 0 is Euler's rule. The same rule holds for the angular momentum in world axes, in the place of
//! v, and for the discrete momentum of a step (see [`Component::predict`]), in the place of `(x' - x) / dt`. That momentum
//! is the body's half a step before, to second order, so that the combination at the end is of second order as well; and a
//! segment that feels nothing keeps it, and its energy, to rounding. (Wieloch and Arnold 2021 have BDF on Lie groups in
//! increments of poses; the variable of Moser and Veselov is one.)
//!
//! Velocities of Algorithm 1 remain those over the last step; those at its end are kept here.

use super::lanes::{copy_spatial, pick, pick_spatial, put};
use super::predict::angular_momentum;
use super::update::select;
use super::{BodyConstants, Component};
use crate::integrator::Integrator;
use crate::kernel::Spatial;
use crate::kernel::lane::Real;
use crate::kernel::math::{Quat, Vec3};
use crate::snapshot::Tape;

/// Largest ratio of a step to the one before it: beyond 1 + sqrt 2 errors would grow from step to step. A longer step is one
/// of Euler's rule.
const LARGEST_RATIO: f64 = 2.0 + 1e-6;

/// Steps of Euler's rule after an impact: it damps the waves that are too fast for the time step, which to continue would
/// feed.
const SETTLING: f64 = 3.0;

/// The steps before, of one set of segments a lane.
#[derive(Clone, Debug)]
pub(super) struct Multistep<T> {
    /// Per segment: velocity [m/s] and angular momentum in world axes [kg m^2/s] at the end of the last step.
    now: Vec<Spatial<T>>,
    /// The same one step earlier.
    earlier: Vec<Spatial<T>>,
    /// Per segment: what its rate at the end of the last step is beyond that over it [rad/s].
    beyond: Vec<Vec3<T>>,
    /// Per segment: its inertia, without what air adds to it.
    bodies: Vec<BodyConstants<T>>,
    /// Per segment: moments of inertia about its own axes [kg m^2], and >= 0 where it is a rigid body, a lane each; empty
    /// where none is.
    moments: Vec<(Vec3<T>, T)>,
    /// 0 where a step goes on from those before; elsewhere less, by the number of steps until then, each of which knows
    /// velocities at its start, and nothing before.
    goes_on: T,
    /// Whether the step is one of Euler's rule, whatever is known: what touches takes steps of one kind.
    held_back: bool,
    /// omega of the step under way; 0 where it does not go on.
    ratio: T,
    /// Shares of velocities that damping leaves, linear and angular: over the step under way, and over the last one.
    decay: [[T; 2]; 2],
}

impl<T: Real> Multistep<T> {
    /// beta: the step's share of implicit Euler.
    #[inline(always)]
    pub(super) fn share(&self) -> T {
        let (one, ratio) = (T::splat(1.0), self.ratio);
        (one + ratio) / (one + ratio + ratio)
    }

    /// Velocity and angular momentum (world axes) that a segment brings along to the end of the step, without forces.
    #[inline(always)]
    pub(super) fn brought(&self, body: usize) -> Spatial<T> {
        let (one, ratio) = (T::splat(1.0), self.ratio);
        let weight = ratio * ratio / (one + ratio + ratio);
        let [[linear, angular], [linear_before, angular_before]] = self.decay;
        let (now, earlier) = (self.now[body], self.earlier[body]);
        let on = |now: Vec3<T>, earlier: Vec3<T>, before: T, kept: T| (now + (now - earlier * before) * weight) * kept;
        Spatial {
            linear: on(now.linear, earlier.linear, linear_before, linear),
            angular: on(now.angular, earlier.angular, angular_before, angular),
        }
    }

    /// What the last step adds to what is brought along: velocity over the step, and its discrete momentum in the body's
    /// frame, without forces. `over` is the velocity over the last step, `w` its rotation's variable in the body's frame.
    #[inline(always)]
    pub(super) fn predicted(&self, body: usize, q: Quat<T>, over: Vec3<T>, w: Vec3<T>, last_half: T) -> Spatial<T> {
        let share = self.share();
        let rest = T::splat(1.0) - share;
        let brought = self.brought(body);
        let momentum = self.momentum(body, w, last_half);
        Spatial {
            linear: brought.linear * share + over * rest,
            angular: q.rotate_back(brought.angular) * share + momentum * rest,
        }
    }

    /// `I x` of a segment, both in its frame.
    #[inline(always)]
    fn inertia(&self, body: usize, x: Vec3<T>) -> Vec3<T> {
        match self.moments.get(body) {
            None => self.bodies[body].inertia(x),
            Some((moments, _)) => Vec3([0, 1, 2].map(|k| x.0[k] * moments.0[k])),
        }
    }

    /// Angular momentum at the end of a step that turned a segment with `w`, both in its frame.
    #[inline(always)]
    fn momentum(&self, body: usize, w: Vec3<T>, half: T) -> Vec3<T> {
        angular_momentum(self.inertia(body, w), w * half)
    }

    /// `I^-1 momentum` of a segment that is oriented so, both in world axes.
    #[inline(always)]
    fn rate(&self, body: usize, q: Quat<T>, momentum: Vec3<T>) -> Vec3<T> {
        let of_top = rate_of(&self.bodies[body], q.axis(), momentum);
        let Some((moments, is_rigid)) = self.moments.get(body) else { return of_top };
        let own = q.rotate_back(momentum);
        let rate = q.rotate(Vec3([0, 1, 2].map(|k| own.0[k] / moments.0[k])));
        Vec3([0, 1, 2].map(|k| is_rigid.select(rate.0[k], of_top.0[k])))
    }

    /// The inertia across the axis, without what air adds to it.
    #[inline(always)]
    pub(super) fn transverse(&self, body: usize) -> T {
        self.bodies[body].transverse
    }

    /// Takes the velocities at the end of a step, in the lanes where `active` >= 0, from those over it and over the last one.
    #[inline(always)]
    fn take_in(&mut self, body: usize, [old, new]: [Spatial<T>; 2], active: T) {
        let further = self.ratio / (T::splat(1.0) + self.ratio);
        let change = new.plus(old, T::splat(-1.0));
        self.earlier[body] = select(active, self.now[body], self.earlier[body]);
        self.now[body] = select(active, new.plus(change, further), self.now[body]);
    }

    /// Shows a tape what the next step builds on; the rest is of one step.
    pub(super) fn tape(&mut self, tape: &mut Tape<'_>) {
        let Self { now, earlier, beyond, goes_on, .. } = self;
        tape.list(now, Tape::spatial);
        tape.list(earlier, Tape::spatial);
        tape.list(beyond, Tape::vector);
        tape.real(goes_on);
    }

    /// A segment's inertia is that of `body` in a lane from now on, about its own axes `moments`.
    pub(super) fn set_inertia(&mut self, index: usize, lane: usize, body: &BodyConstants<T>, moments: Vec3<f64>) {
        if let Some((own, _)) = self.moments.get_mut(index) {
            put(own, lane, moments.0);
        }
        let own = &mut self.bodies[index];
        own.inverse_mass.set_lane(lane, body.inverse_mass.lane(lane));
        own.transverse.set_lane(lane, body.transverse.lane(lane));
        own.axial.set_lane(lane, body.axial.lane(lane));
        own.free.set_lane(lane, body.free.lane(lane));
    }

    /// The same of one lane.
    pub(super) fn pick(&self, lane: usize) -> Multistep<f64> {
        let all = |of: &[Spatial<T>]| of.iter().map(|x| pick_spatial(x, lane)).collect::<Vec<_>>();
        Multistep {
            now: all(&self.now),
            earlier: all(&self.earlier),
            beyond: self.beyond.iter().map(|x| pick(*x, lane)).collect(),
            bodies: self.bodies.iter().map(|body| body.pick(lane)).collect(),
            moments: self.moments.iter().map(|(own, is_rigid)| (pick(*own, lane), is_rigid.lane(lane))).collect(),
            goes_on: self.goes_on.lane(lane),
            held_back: self.held_back,
            ratio: self.ratio.lane(lane),
            decay: self.decay.map(|pair| pair.map(|x| x.lane(lane))),
        }
    }

    /// Puts what [`Multistep::pick`] took, some steps later, back into its lane.
    pub(super) fn put(&mut self, lane: usize, from: &Multistep<f64>) {
        for (own, x) in self.now.iter_mut().zip(&from.now).chain(self.earlier.iter_mut().zip(&from.earlier)) {
            copy_spatial(own, lane, x, 0);
        }
        for (own, x) in self.beyond.iter_mut().zip(&from.beyond) {
            put(own, lane, x.0);
        }
        self.goes_on.set_lane(lane, from.goes_on);
    }
}

impl<T: Real> Component<T> {
    /// Integrates from here on by a rule; components begin with Euler's. Poses and velocities stay.
    pub fn integrate_by(&mut self, integrator: Integrator) {
        let (zero, one) = (T::zero(), T::splat(1.0));
        self.multistep = (integrator == Integrator::Bdf2).then(|| {
            let now = vec![Spatial::zero(); self.segments];
            let beyond = vec![Vec3::zero(); self.segments];
            Box::new(Multistep {
                earlier: now.clone(),
                now,
                beyond,
                bodies: self.bodies[..self.segments].to_vec(),
                moments: self.all_moments(),
                goes_on: T::splat(-1.0),
                held_back: false,
                ratio: zero,
                decay: [[one; 2]; 2],
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
    pub(crate) fn can_go_on(&self) -> bool {
        let all = |steps: &Multistep<T>| (0..T::LANES).all(|lane| steps.goes_on.lane(lane) >= 0.0);
        self.multistep.as_ref().is_none_or(|steps| all(steps))
    }

    /// Says whether the steps to come are of Euler's rule, whatever is known of those before.
    pub(crate) fn hold_back(&mut self, held_back: bool) {
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
    pub(super) fn begin_step(&mut self, time: f64, dt: f64) {
        (self.time, self.dt) = (time, dt);
        self.effective = T::splat(dt);
        let last_dt = self.last_dt;
        let Some(steps) = &mut self.multistep else { return };
        for lane in 0..T::LANES {
            let last = last_dt.lane(lane);
            let goes_on = steps.goes_on.lane(lane) >= 0.0 && !steps.held_back && dt <= LARGEST_RATIO * last;
            steps.ratio.set_lane(lane, if goes_on { dt / last } else { 0.0 });
            for (k, rate) in self.damping.into_iter().enumerate().filter(|(_, rate)| *rate > 0.0) {
                steps.decay[0][k].set_lane(lane, (-rate * dt).exp());
                steps.decay[1][k].set_lane(lane, (-rate * last).exp());
            }
        }
        self.effective = self.effective * steps.share();
    }

    /// The momenta of rates that were given since the last step: `I w`, with the variable of a step of the length of the one
    /// under way as its discrete momentum has it, so that a spin about a main axis goes on at its rate.
    pub(super) fn take_given_momenta(&mut self) {
        if !self.has_given || self.multistep.is_none() {
            return;
        }
        for i in 0..self.segments {
            let (variable, half) = self.variable(i, T::splat(0.5 * self.dt));
            let q = self.poses[i].q;
            let Some(steps) = &mut self.multistep else { return };
            let u = variable * half;
            let cosine = (T::splat(1.0) - u.norm_squared()).max(T::zero()).sqrt();
            let momentum = q.rotate(steps.inertia(i, q.rotate_back(variable))) * cosine;
            for lane in 0..T::LANES {
                if self.given[i].lane(lane) >= 0.0 {
                    put(&mut steps.now[i].angular, lane, pick(momentum, lane).0);
                }
            }
        }
    }

    /// Velocities at the end of the step under way, in the lanes where `active` >= 0, from the velocities over it, `new`, and
    /// over the last one, which are still the component's.
    #[inline(always)]
    pub(super) fn end_step(&mut self, body: usize, new: Spatial<T>, active: T) {
        let (half, last_half) = (T::splat(0.5 * self.dt), self.last_dt * T::splat(0.5));
        let Some(steps) = &mut self.multistep else { return };
        let (start, end) = (self.start[body].q, self.poses[body].q);
        let momentum = |q: Quat<T>, w: Vec3<T>, half: T| q.rotate(steps.momentum(body, q.rotate_back(w), half));
        let old = self.velocities[body];
        let over = [
            Spatial { linear: old.linear, angular: momentum(start, old.angular, last_half) },
            Spatial { linear: new.linear, angular: momentum(end, new.angular, half) },
        ];
        let beside = steps.rate(body, middle(start, end), over[1].angular);
        steps.take_in(body, over, active);
        let beyond = steps.rate(body, end, steps.now[body].angular) - beside;
        let kept = steps.beyond[body];
        steps.beyond[body] = Vec3([0, 1, 2].map(|k| active.select(beyond.0[k], kept.0[k])));
    }

    /// After a step that is accepted in the lanes where `active` >= 0, others can go on from it.
    #[inline(always)]
    pub(super) fn know_step(&mut self, active: T) {
        if let Some(steps) = &mut self.multistep {
            let nearer = -(-T::splat(1.0) - steps.goes_on).max(T::zero());
            steps.goes_on = active.select(nearer, steps.goes_on);
        }
    }

    /// Lets the next step begin with what the velocities over the last one have become at its end by gravity and loads, in the
    /// lanes where `active` >= 0: something else in it, such as an impact, will not go on.
    pub(crate) fn begin_anew(&mut self, active: T) {
        let half = self.last_dt * T::splat(0.5);
        let Some(steps) = &mut self.multistep else { return };
        // The velocities over a step of Euler's rule are those at its end already.
        let rest = (-steps.ratio).select(T::zero(), half);
        self.scratch.fill(Spatial::zero());
        for load in &self.loads {
            self.scratch[load.body].linear += load.force;
        }
        for i in 0..self.segments {
            let (start, end) = (self.start[i].q, self.poses[i].q);
            let over = self.velocities[i];
            let constants = &steps.bodies[i];
            let pull = self.gravity * constants.free + self.scratch[i].linear * constants.inverse_mass;
            let momentum = end.rotate(steps.momentum(i, end.rotate_back(over.angular), half));
            let beyond = steps.rate(i, end, momentum) - steps.rate(i, middle(start, end), momentum);
            steps.now[i] =
                select(active, Spatial { linear: over.linear + pull * rest, angular: momentum }, steps.now[i]);
            let kept = steps.beyond[i];
            steps.beyond[i] = Vec3([0, 1, 2].map(|k| active.select(beyond.0[k], kept.0[k])));
        }
        steps.goes_on = active.select(T::splat(-SETTLING), steps.goes_on);
    }

    /// Forgets the steps before in a lane: velocities at the start of the next step are all there is.
    pub(super) fn forget_steps(&mut self, lane: usize) {
        if let Some(steps) = &mut self.multistep {
            steps.goes_on.set_lane(lane, -1.0);
        }
    }

    /// Velocity of a segment at the end of the last step, or given since [m/s].
    pub(super) fn velocity(&self, body: usize, lane: usize) -> Vec3<f64> {
        let of_step = self.velocities[body].linear;
        let is_fixed = self.bodies[body].free.lane(lane) == 0.0;
        let own = self.multistep.as_ref().filter(|_| !is_fixed).map_or(of_step, |steps| steps.now[body].linear);
        pick(own, lane)
    }

    /// Sets that velocity, between two steps. Of what moves freely nothing is known then but velocities.
    pub(super) fn give_velocity(&mut self, body: usize, lane: usize, v: Vec3<f64>) {
        put(&mut self.velocities[body].linear, lane, v.0);
        let is_free = self.bodies[body].free.lane(lane) != 0.0;
        let Some(steps) = &mut self.multistep else { return };
        put(&mut steps.now[body].linear, lane, v.0);
        if is_free {
            self.forget_steps(lane);
        }
    }

    /// What a segment's rate at the end of the last step is beyond that over it [rad/s].
    pub(super) fn beyond(&self, body: usize, lane: usize) -> Vec3<f64> {
        self.multistep.as_ref().map_or(Vec3::zero(), |steps| pick(steps.beyond[body], lane))
    }
}

impl<T: Real> Component<T> {
    /// Adds to the residuals of momentum what `I phi` leaves out.
    #[inline(always)]
    pub(super) fn add_gyroscopic_momentum(&mut self) {
        let two = T::splat(2.0);
        for i in 0..self.segments {
            let (pose, axis) = (&self.poses[i], self.system.bodies[i].axis);
            let [theta, phi] =
                [&self.start[i], &self.predicted[i]].map(|from| (pose.q * from.q.conj()).upper().v * two);
            let body = &self.bodies[i];
            let inertia = |x: Vec3<T>| x * body.transverse + axis * (axis.dot(x) * (body.axial - body.transverse));
            let turning = gyroscopic(inertia, theta, phi);
            self.momentum[i].angular -= self.system.bodies[i].inverse_inertia.apply(turning);
        }
    }
}

/// What `I phi` leaves out of a body's change of discrete momentum (times the step's length) as it is turned by `phi` after
/// a turn by about `theta`: the share of second order, `([I theta x - theta x I] phi + phi x I theta) / 2`. `inertia` is I in
/// world axes.
#[inline(always)]
pub(super) fn gyroscopic<T: Real>(inertia: impl Fn(Vec3<T>) -> Vec3<T>, theta: Vec3<T>, phi: Vec3<T>) -> Vec3<T> {
    let sum = inertia(theta.cross(phi)) - theta.cross(inertia(phi)) + phi.cross(inertia(theta));
    sum * T::splat(0.5)
}

/// `I^-1 momentum` of a body whose axis is `axis`.
#[inline(always)]
fn rate_of<T: Real>(body: &BodyConstants<T>, axis: Vec3<T>, momentum: Vec3<T>) -> Vec3<T> {
    let [across, along] = [body.transverse, body.axial].map(|inertia| T::splat(1.0) / inertia);
    momentum * across + axis * (axis.dot(momentum) * (along - across))
}

/// The orientation half way from one to another.
#[inline(always)]
fn middle<T: Real>(a: Quat<T>, b: Quat<T>) -> Quat<T> {
    let side = (a.v.dot(b.v) + a.w * b.w).select(T::splat(1.0), T::splat(-1.0));
    let sum = Quat { v: a.v + b.v * side, w: a.w + b.w * side };
    let size = (sum.v.dot(sum.v) + sum.w * sum.w).sqrt().max(T::splat(f64::MIN_POSITIVE));
    let share = T::splat(1.0) / size;
    Quat { v: sum.v * share, w: sum.w * share }
}
