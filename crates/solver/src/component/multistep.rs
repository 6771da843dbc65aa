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
//! A segment is a symmetric top, whose angular momentum about its axis no torque across it changes. World axes do not keep
//! that from step to step: as the axis tilts, a part of the momentum across it in the steps before lies along it, and a thin
//! segment, which is light to spin, would take it for a spin of its own, many times that which it has. The `xpbd`
//! formulations, which have the spin from the poses, therefore carry the share along the axis on as it was. `newton` does
//! not: it balances world vectors, and so the angular momentum of a whole rod, to second order.
//!
//! Velocities of Algorithm 1 remain those over the last step; those at its end are kept here.

mod back;

use nalgebra::Vector3;

use super::begin::{Group, scatter};
use super::derivative::set_slope;
use super::lanes::{copy_lane, copy_spatial, pick, pick_pose, pick_spatial, put};
use super::predict::angular_momentum;
use super::state::rate;
use super::update::select;
use super::{BodyConstants, Component};
use crate::integrator::Integrator;
use crate::kernel::Spatial;
use crate::kernel::dual::Dual;
use crate::kernel::lane::Real;
use crate::kernel::math::{Quat, Vec3};
use crate::snapshot::Tape;

pub(super) use back::{gyroscopic_back, momentum_back};

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
    /// Per segment: its discrete momentum over the last step, in world axes [kg m^2/s].
    over: Vec<Vec3<T>>,
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
    /// beta, the share of implicit Euler, and `omega^2 / (1 + 2 omega)`, by which velocities go on, of the step under way.
    share: T,
    weight: T,
    /// Shares of velocities that damping leaves, linear and angular: over the step under way, and over the last one.
    decay: [[T; 2]; 2],
}

impl<T: Real> Multistep<T> {
    /// beta: the step's share of implicit Euler.
    #[inline(always)]
    pub(super) fn share(&self) -> T {
        self.share
    }

    /// Velocity and angular momentum (world axes) that a segment brings along to the end of the step, without forces.
    #[inline(always)]
    pub(super) fn brought(&self, body: usize) -> Spatial<T> {
        let weight = self.weight;
        let [[linear, angular], [linear_before, angular_before]] = self.decay;
        let (now, earlier) = (self.now[body], self.earlier[body]);
        let on = |now: Vec3<T>, earlier: Vec3<T>, before: T, kept: T| (now + (now - earlier * before) * weight) * kept;
        Spatial {
            linear: on(now.linear, earlier.linear, linear_before, linear),
            angular: on(now.angular, earlier.angular, angular_before, angular),
        }
    }

    /// What is brought along with what the last step adds to it: velocity over the step, and its discrete momentum (world
    /// axes), without forces. `over` is the velocity over the last step.
    #[inline(always)]
    pub(super) fn predicted(&self, body: usize, over: Vec3<T>) -> Spatial<T> {
        let share = self.share;
        let rest = T::splat(1.0) - share;
        let brought = self.brought(body);
        Spatial {
            linear: brought.linear * share + over * rest,
            angular: brought.angular * share + self.over[body] * rest,
        }
    }

    /// By how much a segment's axis has tilted since an orientation; zero of a rigid body.
    #[inline(always)]
    fn tilt(&self, body: usize, since: Quat<T>, axis: Vec3<T>) -> Vec3<T> {
        let (one, zero) = (T::splat(1.0), T::zero());
        let of_top = self.moments.get(body).map_or(one, |(_, is_rigid)| is_rigid.select(zero, one));
        (axis - since.axis()) * of_top
    }

    /// `I x` of a segment that is oriented so, both in world axes.
    #[inline(always)]
    pub(super) fn inertia(&self, body: usize, q: Quat<T>, x: Vec3<T>) -> Vec3<T> {
        let (constants, axis) = (&self.bodies[body], q.axis());
        let of_top = x * constants.transverse + axis * (axis.dot(x) * (constants.axial - constants.transverse));
        let Some((moments, is_rigid)) = self.moments.get(body) else { return of_top };
        let own = q.rotate_back(x);
        let turning = q.rotate(Vec3([0, 1, 2].map(|k| own.0[k] * moments.0[k])));
        Vec3([0, 1, 2].map(|k| is_rigid.select(turning.0[k], of_top.0[k])))
    }

    /// Moments of inertia of a segment about its own axes, without what air adds to them.
    fn own_moments(&self, body: usize) -> Vec3<T> {
        let BodyConstants { transverse, axial, .. } = self.bodies[body];
        let of_top = [transverse, transverse, axial];
        let Some((moments, is_rigid)) = self.moments.get(body) else { return Vec3(of_top) };
        Vec3([0, 1, 2].map(|k| is_rigid.select(moments.0[k], of_top[k])))
    }

    /// The inertia across the axis, without what air adds to it.
    #[inline(always)]
    pub(super) fn transverse(&self, body: usize) -> T {
        self.bodies[body].transverse
    }

    /// Shows a tape what the next step builds on; the rest is of one step.
    pub(super) fn tape(&mut self, tape: &mut Tape<'_>) {
        let Self { now, earlier, over, goes_on, .. } = self;
        tape.list(now, Tape::spatial);
        tape.list(earlier, Tape::spatial);
        tape.list(over, Tape::vector);
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
            over: self.over.iter().map(|x| pick(*x, lane)).collect(),
            bodies: self.bodies.iter().map(|body| body.pick(lane)).collect(),
            moments: self.moments.iter().map(|(own, is_rigid)| (pick(*own, lane), is_rigid.lane(lane))).collect(),
            goes_on: self.goes_on.lane(lane),
            held_back: self.held_back,
            ratio: self.ratio.lane(lane),
            share: self.share.lane(lane),
            weight: self.weight.lane(lane),
            decay: self.decay.map(|pair| pair.map(|x| x.lane(lane))),
        }
    }

    /// Puts what [`Multistep::pick`] took, some steps later, back into its lane.
    pub(super) fn put(&mut self, lane: usize, from: &Multistep<f64>) {
        for (own, x) in self.now.iter_mut().zip(&from.now).chain(self.earlier.iter_mut().zip(&from.earlier)) {
            copy_spatial(own, lane, x, 0);
        }
        for (own, x) in self.over.iter_mut().zip(&from.over) {
            put(own, lane, x.0);
        }
        self.goes_on.set_lane(lane, from.goes_on);
    }
}

/// What a step knows of those before.
#[derive(Clone, Debug)]
pub(super) struct StepsBefore {
    now: Vec<Spatial<f64>>,
    earlier: Vec<Spatial<f64>>,
    over: Vec<Vec3<f64>>,
    goes_on: f64,
}

impl StepsBefore {
    /// What several sets know of the steps before, each with the places of its segments among all `segments`.
    pub(super) fn together<'a>(parts: impl Iterator<Item = (&'a Self, &'a [usize])>, segments: usize) -> Option<Self> {
        let zero = || vec![Spatial::zero(); segments];
        let mut all: Option<Self> = None;
        for (part, places) in parts {
            let new =
                || Self { now: zero(), earlier: zero(), over: vec![Vec3::zero(); segments], goes_on: part.goes_on };
            let all = all.get_or_insert_with(new);
            scatter(&mut all.now, &part.now, places);
            scatter(&mut all.earlier, &part.earlier, places);
            scatter(&mut all.over, &part.over, places);
        }
        all
    }
}

impl<T: Real> Multistep<T> {
    /// What the step under way knows of those before, in one lane.
    pub(super) fn before(&self, lane: usize) -> StepsBefore {
        let all = |of: &[Spatial<T>]| of.iter().map(|x| pick_spatial(x, lane)).collect::<Vec<_>>();
        let over = self.over.iter().map(|x| pick(*x, lane)).collect();
        StepsBefore { now: all(&self.now), earlier: all(&self.earlier), over, goes_on: self.goes_on.lane(lane) }
    }

    /// Takes it over, as constants.
    pub(super) fn go_back(&mut self, before: &StepsBefore) {
        let lists = [(&mut self.now, &before.now), (&mut self.earlier, &before.earlier)];
        for (own, from) in lists.into_iter().flat_map(|(own, from)| own.iter_mut().zip(from)) {
            *own = Spatial::splat(*from);
        }
        for (own, from) in self.over.iter_mut().zip(&before.over) {
            *own = Vec3::splat(*from);
        }
        self.goes_on = T::splat(before.goes_on);
    }

    /// Takes it over in one lane.
    pub(super) fn go_back_in(&mut self, lane: usize, before: &StepsBefore) {
        let lists = [(&mut self.now, &before.now), (&mut self.earlier, &before.earlier)];
        for (own, from) in lists.into_iter().flat_map(|(own, from)| own.iter_mut().zip(from)) {
            copy_spatial(own, lane, from, 0);
        }
        self.over.iter_mut().zip(&before.over).for_each(|(own, from)| put(own, lane, from.0));
        self.goes_on.set_lane(lane, before.goes_on);
    }
}

impl<const D: usize> Multistep<Dual<D>> {
    /// Lets the reciprocal of a segment's mass and its moments of inertia about its own axes change along a direction.
    pub(super) fn seed_inertia(&mut self, index: usize, k: usize, inverse_mass: f64, moments: &Vector3<f64>) {
        let own = &mut self.bodies[index];
        own.inverse_mass.slope[k] = inverse_mass;
        (own.transverse.slope[k], own.axial.slope[k]) = (0.5 * (moments.x + moments.y), moments.z);
        if let Some((own, _)) = self.moments.get_mut(index) {
            set_slope(own, k, moments);
        }
    }

    /// Lets a number of a segment's state change along a direction.
    pub(super) fn seed_state(&mut self, group: Group, index: usize, k: usize, [linear, angular]: &[Vector3<f64>; 2]) {
        let spatial = match group {
            Group::Now => &mut self.now[index],
            Group::Earlier => &mut self.earlier[index],
            _ => return set_slope(&mut self.over[index], k, linear),
        };
        set_slope(&mut spatial.linear, k, linear);
        set_slope(&mut spatial.angular, k, angular);
    }

    /// Lets a segment's velocity at the start change along a direction.
    pub(super) fn seed_velocity(&mut self, index: usize, k: usize, by: &Vector3<f64>) {
        set_slope(&mut self.now[index].linear, k, by);
    }
}

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
        let (last_dt, one) = (self.last_dt, T::splat(1.0));
        let Some(steps) = &mut self.multistep else { return };
        for lane in 0..T::LANES {
            let last = last_dt.lane(lane);
            let goes_on = steps.goes_on.lane(lane) >= 0.0 && !steps.held_back && dt <= LARGEST_RATIO * last;
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
            let momentum = steps.inertia(i, q, variable) * cosine;
            for lane in 0..T::LANES {
                if self.given[i].lane(lane) >= 0.0 {
                    copy_lane(&mut steps.now[i].angular, lane, momentum);
                }
            }
        }
    }

    /// Velocities at the end of the step under way, in the lanes where `active` >= 0, from those over it, `new`, and over the
    /// last one, which are still the component's. Where `by_spin`, the momenta of the steps before keep what they have about
    /// the segment's axis as it tilts: see the module.
    #[inline(always)]
    pub(super) fn end_step(&mut self, body: usize, new: Spatial<T>, by_spin: bool, active: T) {
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
        steps.over[body] = select(active, new, kept).angular;
        steps.earlier[body] = select(active, before, steps.earlier[body]);
        steps.now[body] = select(active, now, steps.now[body]);
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
            let constants = &steps.bodies[i];
            let pull = self.gravity * constants.free + self.scratch[i].linear * constants.inverse_mass;
            let linear = self.velocities[i].linear + pull * rest;
            steps.now[i] = select(active, Spatial { linear, angular: steps.over[i] }, steps.now[i]);
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
        let Some(steps) = &self.multistep else { return Vec3::zero() };
        let u = pick(self.velocities[body].angular, lane) * (0.5 * self.last_dt.lane(lane));
        let end = pick_pose(&self.poses[body], lane).q;
        let momenta = [steps.now[body].angular, steps.over[body]].map(|momentum| pick(momentum, lane));
        further(pick(steps.own_moments(body), lane), u, end, momenta)
    }

    /// Velocity of a segment at the end of the last step [m/s, rad/s].
    pub(super) fn velocity_at_end(&self, body: usize) -> Spatial<T> {
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

/// What `I phi` leaves out of a body's change of discrete momentum (times the step's length) as it is turned by `phi` after
/// a turn by about `theta`: the share of second order, `([I theta x - theta x I] phi + phi x I theta) / 2`. `inertia` is I in
/// world axes.
#[inline(always)]
pub(super) fn gyroscopic<T: Real>(inertia: impl Fn(Vec3<T>) -> Vec3<T>, theta: Vec3<T>, phi: Vec3<T>) -> Vec3<T> {
    let sum = inertia(theta.cross(phi)) - theta.cross(inertia(phi)) + phi.cross(inertia(theta));
    sum * T::splat(0.5)
}
