//! The way back over a step, body by body: from derivatives of a number with respect to the state at its end to those with
//! respect to the state at its start, and to what a body's own equations depend on.
//!
//! Poses change by a shift and a turn in world axes, `q' = exp(turn) q`. The turn between two orientations,
//! `theta = 2 Im(q' conj(q))` with the cosine c of half its angle, changes by `c (b - a) - theta x (a + b) / 2` as they are
//! turned by b and a. A derivative with respect to theta is so one with respect to both ([`of_ends`]). Of inertia that turns
//! with a body: `R I R^T x` is as it was where x is turned along.

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};

use super::asymmetric_jacobian::turn_since;
use super::multistep::{gyroscopic_back, momentum_back};
use super::parts::{copy_spatial, pick, pick_spatial, put, select};
use super::turns::angular_momentum;
use super::{BodyBar, Component};

/// A free rotation whose momentum is wrong by more than that of this sine, squared, goes on as the last one.
const UNSOLVED: f64 = 1e-14;

/// What a step's end says of a body: derivatives with respect to its pose there, and to its state before.
#[derive(Clone, Copy, Debug)]
pub struct Ended<T> {
    /// Of the pose at the end.
    pub pose: Spatial<T>,
    start: BodyBar<T>,
    moments: Vec3<T>,
}

impl<T: Real> Default for Ended<T> {
    #[inline(always)]
    fn default() -> Self {
        Self { pose: Spatial::zero(), start: BodyBar::default(), moments: Vec3::zero() }
    }
}

impl<T: Real> Default for BodyGradient<T> {
    #[inline(always)]
    fn default() -> Self {
        let zero = Vec3::zero();
        let (moments, own_moments, gravity, drag) = (zero, zero, zero, Spatial::zero());
        Self { mass: T::zero(), moments, own_moments, gravity, damping: [T::zero(); 2], drag }
    }
}

/// Derivatives with respect to a body's own numbers in a step.
#[derive(Clone, Copy, Debug)]
pub struct BodyGradient<T> {
    /// Of its mass in the step, but for the loads on it.
    pub mass: T,
    /// Of its moments of inertia in the step about its own axes.
    pub moments: Vec3<T>,
    /// Of those without what air adds.
    pub own_moments: Vec3<T>,
    /// Of gravity.
    pub gravity: Vec3<T>,
    /// Of the rates of damping.
    pub damping: [T; 2],
    /// Of what drag adds to the prediction's velocity and momentum.
    pub drag: Spatial<T>,
}

impl<T: Real> BodyGradient<T> {
    /// Those of one lane.
    pub fn pick(&self, lane: usize) -> BodyGradient<f64> {
        BodyGradient {
            mass: self.mass.lane(lane),
            moments: pick(self.moments, lane),
            own_moments: pick(self.own_moments, lane),
            gravity: pick(self.gravity, lane),
            damping: self.damping.map(|x| x.lane(lane)),
            drag: pick_spatial(&self.drag, lane),
        }
    }

    /// Puts those of one lane back.
    pub fn put(&mut self, lane: usize, from: &BodyGradient<f64>) {
        self.mass.set_lane(lane, from.mass);
        put(&mut self.moments, lane, from.moments.0);
        put(&mut self.own_moments, lane, from.own_moments.0);
        put(&mut self.gravity, lane, from.gravity.0);
        (0..2).for_each(|k| self.damping[k].set_lane(lane, from.damping[k]));
        copy_spatial(&mut self.drag, lane, &from.drag, 0);
    }
}

#[inline(always)]
pub(super) fn zip<T: Real>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    Vec3([a.0[0] * b.0[0], a.0[1] * b.0[1], a.0[2] * b.0[2]])
}

#[inline(always)]
fn spatial<T: Real>(linear: Vec3<T>, angular: Vec3<T>) -> Spatial<T> {
    Spatial { linear, angular }
}

/// The cosine of half a turn, of which this is the sine.
#[inline(always)]
fn cosine_of<T: Real>(sine: Vec3<T>) -> T {
    (T::splat(1.0) - sine.norm_squared()).max(T::zero()).sqrt()
}

/// Derivatives with respect to the turns of both ends, the first and the second, from that of the turn between them.
#[inline(always)]
pub(super) fn of_ends<T: Real>((cosine, turn): (T, Vec3<T>), bar: Vec3<T>) -> [Vec3<T>; 2] {
    let (along, across) = (bar * cosine, turn.cross(bar) * T::splat(0.5));
    [across - along, across + along]
}

impl<T: Real> Component<T> {
    /// From derivatives with respect to a free body's state at the end of the step that is solved, but has not ended.
    #[inline(always)]
    pub fn end_back(&self, i: usize, bar: &BodyBar<T>) -> Ended<T> {
        let (per, half) = (T::splat(1.0 / self.dt), T::splat(0.5));
        let (start, end) = (self.start[i].q, self.poses[i].q);
        let since = turn_since(end, start);
        let mut out = Ended::default();
        let (mut shift, mut turn) = (bar.velocity.linear * per, bar.velocity.angular * per);
        if let Some(steps) = &self.multistep {
            let further = steps.further();
            let beyond = per * (T::splat(1.0) + further);
            shift += bar.now.linear * beyond;
            out.start.velocity.linear = bar.now.linear * -further;
            out.start.over = bar.now.angular * -further;
            out.start.now = bar.earlier;
            out.start.now = out.start.now.plus(bar.gained, T::splat(1.0));
            out.start.earlier = Spatial::zero().plus(bar.gained, T::splat(-1.0));
            let of_momentum = bar.over * per + bar.now.angular * beyond;
            let [momentum, of_turn] = momentum_back(|x| steps.inertia(i, end, x), since.1, half, of_momentum);
            turn += of_turn;
            out.pose.angular = momentum.cross(of_momentum) - since.1.cross(of_turn);
            out.moments = moments_of_momentum(end, since.1, half, of_momentum);
        }
        let [first, second] = of_ends(since, turn);
        out.pose = out.pose.plus(spatial(shift, second), T::splat(1.0));
        out.start.pose = spatial(-shift, first);
        out
    }

    /// From the solution `field` of the transposed equations in a free body's rows, and what the step's end says.
    #[inline(always)]
    pub fn start_back(&self, i: usize, field: Spatial<T>, ended: &Ended<T>) -> (BodyBar<T>, BodyGradient<T>) {
        let (pose, predicted, begin) = (&self.poses[i], &self.predicted[i], &self.start[i]);
        let (one, dt) = (T::splat(1.0), T::splat(self.dt));
        let mass = one / self.bodies[i].inverse_mass;
        let mut start = ended.start;
        let mut of_velocity = field.linear * (mass * dt);
        let share = self.share();
        let mut gradient = BodyGradient {
            mass: field.linear.dot(predicted.x - pose.x),
            own_moments: ended.moments,
            gravity: of_velocity * (self.effective * share),
            ..BodyGradient::default()
        };
        start.pose.linear += field.linear * mass;

        // The inertia's torque.
        let inertia = self.inertia_of(i, pose.q);
        let inertia = |x: Vec3<T>| inertia.apply(x);
        let since = turn_since(pose.q, predicted.q);
        let mut of_phi = -inertia(field.angular);
        let (f, p) = (pose.q.rotate_back(field.angular), pose.q.rotate_back(since.1));
        gradient.moments -= zip(f, p);
        if self.multistep.is_some() {
            let theta = turn_since(pose.q, begin.q);
            let [of_theta, second] = gyroscopic_back(inertia, theta.1, since.1, field.angular);
            of_phi -= second;
            start.pose.angular += of_ends(theta, -of_theta)[0];
            let t = pose.q.rotate_back(theta.1);
            gradient.moments -= (zip(f, t.cross(p)) - zip(f.cross(t), p) + zip(f.cross(p), t)) * T::splat(0.5);
        }
        let of_predicted = of_ends(since, of_phi)[0];

        // The free rotation.
        start.pose.angular += of_predicted;
        let moments = self.moments_in_lanes(i);
        let (of_momentum, of_variable) =
            self.turn_back(i, (moments, predicted.q.rotate_back(of_predicted)), &mut gradient);
        let (variable, half) = self.variable_of(i);
        let w = begin.q.rotate_back(variable);
        gradient.drag = spatial(of_velocity * share, of_momentum * share);
        let mut of_w = of_variable;
        let damping = &mut gradient.damping;
        let old = self.velocities[i].linear;
        match &self.multistep {
            None => {
                let kept = [(-self.damping[0] * dt).exp(), (-self.damping[1] * dt).exp()];
                let bar = of_momentum * kept[1];
                let [momentum, of_turn] = momentum_back(|x| zip(moments, x), w, half, bar);
                of_w += of_turn;
                gradient.moments += moments_of_momentum(Quat::identity(), w, half, bar);
                damping[1] -= dt * momentum.dot(bar);
                damping[0] -= dt * kept[0] * old.dot(of_velocity);
                of_velocity = of_velocity * kept[0];
                start.velocity.linear += of_velocity;
            }
            Some(steps) => {
                let carried = steps.predicted(i, old);
                let heavier = self.bodies[i].transverse / steps.transverse(i);
                let own = begin.q.rotate_back(carried.angular);
                let across = (of_momentum.0[0] * own.0[0] + of_momentum.0[1] * own.0[1]) / steps.transverse(i);
                gradient.moments.0[0] += across;
                gradient.own_moments.0[0] -= across * heavier;
                let Vec3([x, y, z]) = of_momentum;
                let of_carried = begin.q.rotate(Vec3([x * heavier, y * heavier, z]));
                start.pose.angular += of_carried.cross(carried.angular);
                steps.carry_back(i, spatial(of_velocity, of_carried), [dt, self.last_dt], &mut start, damping);
            }
        }
        let of_world = begin.q.rotate(of_w);
        start.pose.angular += of_world.cross(variable);
        let of_world = if self.is_of_another_length() { self.length_back(i, of_world) } else { of_world };
        if self.has_given {
            start.velocity.angular += self.rate_back(i, of_world);
            self.given_back(i, &mut start, &mut gradient);
        } else {
            start.velocity.angular += of_world;
        }
        (start, gradient)
    }

    /// The step's share of implicit Euler.
    #[inline(always)]
    fn share(&self) -> T {
        match &self.multistep {
            Some(steps) => steps.share(),
            None => T::splat(1.0),
        }
    }

    /// The solver's variable of a body's rotation before the step under way, and half the length of the step that it is of.
    #[inline(always)]
    pub(super) fn variable_of(&self, i: usize) -> (Vec3<T>, T) {
        let half = self.last_half();
        let is_other = self.has_given || self.is_of_another_length();
        if is_other { self.variable(i, half) } else { (self.velocities[i].angular, half) }
    }

    /// Whether the last step was longer or shorter than the one under way.
    #[inline(always)]
    fn is_of_another_length(&self) -> bool {
        self.last_half() != T::splat(0.5 * self.dt)
    }

    /// Back over the free rotation, of which `s I u + u x I u = (dt / 2) m`: from the derivative with respect to a turn in the
    /// frame at its end to those with respect to m and, where there is no such rotation, to the variable of the last one.
    #[inline(always)]
    fn turn_back(
        &self,
        i: usize,
        (moments, bar): (Vec3<T>, Vec3<T>),
        gradient: &mut BodyGradient<T>,
    ) -> (Vec3<T>, Vec3<T>) {
        let half = T::splat(0.5 * self.dt);
        let Quat { v: u, w: s } = (self.start[i].q.conj() * self.predicted[i].q).upper();
        let of_u = (bar * s + u * (u.dot(bar) / s) - bar.cross(u)) * T::splat(2.0);
        let turning = zip(moments, u);
        let momentum = self.momentum_before(i, moments) * half;
        let missed = turning * s + u.cross(turning) - momentum;
        let sine = Vec3([0, 1, 2].map(|k| missed.0[k] / moments.0[k]));
        let solved = T::splat(UNSOLVED) - sine.norm_squared();
        let column = |e: [f64; 3], k: usize| {
            let e = Vec3([T::splat(e[0]), T::splat(e[1]), T::splat(e[2])]);
            let own = zip(moments, e);
            own * s - turning * (u.0[k] / s) + e.cross(turning) + u.cross(own)
        };
        let (a, b, c) = (column([1.0, 0.0, 0.0], 0), column([0.0, 1.0, 0.0], 1), column([0.0, 0.0, 1.0], 2));
        let [x, y, z] = of_u.0;
        let scale = T::splat(1.0) / a.dot(b.cross(c));
        let answer = (b.cross(c) * x + c.cross(a) * y + a.cross(b) * z) * scale;
        let zero = Vec3::zero();
        let answers = select(solved, spatial(answer, zero), spatial(zero, of_u));
        gradient.moments -= zip(u, answers.linear * s + answers.linear.cross(u));
        (answers.linear * half, answers.angular * half)
    }

    /// The momentum of the free rotation of a body, in its frame at the start of the step.
    #[inline(always)]
    fn momentum_before(&self, i: usize, moments: Vec3<T>) -> Vec3<T> {
        let q = self.start[i].q;
        let (momentum, share) = match &self.multistep {
            None => {
                let (variable, half) = self.variable_of(i);
                let w = q.rotate_back(variable);
                let kept = (-self.damping[1] * T::splat(self.dt)).exp();
                (angular_momentum(zip(moments, w), w * half) * kept, T::splat(1.0))
            }
            Some(steps) => {
                let Vec3([x, y, z]) = q.rotate_back(steps.predicted(i, self.velocities[i].linear).angular);
                let heavier = self.bodies[i].transverse / steps.transverse(i);
                (Vec3([x * heavier, y * heavier, z]), steps.share())
            }
        };
        match &self.drag {
            Some(drag) => momentum + drag.impulses[i].angular * share,
            None => momentum,
        }
    }

    /// From the derivative with respect to the solver's variable of the step under way to that of the last step's, in the lanes
    /// where that was of another length and no rate was given since: the rate goes on.
    #[cold]
    fn length_back(&self, i: usize, bar: Vec3<T>) -> Vec3<T> {
        let mut out = bar;
        let (own, last_half) = (0.5 * self.dt, self.last_half());
        let is_other = |lane: &usize| last_half.lane(*lane) != own && self.given[i].lane(*lane) < 0.0;
        for lane in (0..T::LANES).filter(is_other) {
            let (w, bar, last) = (pick(self.velocities[i].angular, lane), pick(bar, lane), last_half.lane(lane));
            let size = w.norm_squared().sqrt();
            let sine = size * last;
            if (1e-9..1.0).contains(&sine) {
                let turn = sine.asin() / last * own;
                let (ratio, slope) = (turn.sin() / (own * size), turn.cos() / (1.0 - sine * sine).sqrt());
                let along = w * (w.dot(bar) / (size * size));
                put(&mut out, lane, (bar * ratio + along * (slope - ratio)).0);
            }
        }
        out
    }

    /// From the derivative with respect to the solver's variable to that with respect to the rate, in the lanes where that was
    /// given.
    #[cold]
    fn rate_back(&self, i: usize, bar: Vec3<T>) -> Vec3<T> {
        let mut out = bar;
        for lane in (0..T::LANES).filter(|&lane| self.given[i].lane(lane) >= 0.0) {
            let (rate, own) = (pick(self.velocities[i].angular, lane), pick(bar, lane));
            let squared = rate.norm_squared();
            let half = 0.5 * self.dt * squared.sqrt();
            if half >= 1e-9 {
                let ratio = half.sin() / half;
                put(&mut out, lane, (own * ratio + rate * (rate.dot(own) * (half.cos() - ratio) / squared)).0);
            }
        }
        out
    }

    /// Back over the momentum of a rate, in the lanes where that was given: see `take_given_momenta`.
    #[cold]
    fn given_back(&self, i: usize, start: &mut BodyBar<T>, gradient: &mut BodyGradient<T>) {
        let (Some(steps), given) = (&self.multistep, self.given[i]) else { return };
        let zero = Spatial::zero();
        let taken = select(given, spatial(start.now.angular, Vec3::zero()), spatial(Vec3::zero(), start.now.angular));
        let bar = taken.linear;
        start.now.angular = taken.angular;
        let q = self.start[i].q;
        let (variable, half) = self.variable_of(i);
        let cosine = cosine_of(variable * half);
        let turning = steps.inertia(i, q, variable);
        let of_variable = steps.inertia(i, q, bar) * cosine - variable * (half * half * bar.dot(turning) / cosine);
        let turned = (turning * cosine).cross(bar) - variable.cross(of_variable);
        let moments = zip(q.rotate_back(bar), q.rotate_back(variable)) * cosine;
        let added = select(given, spatial(turned, moments), zero);
        start.pose.angular += added.linear;
        gradient.own_moments += added.angular;
        let of_rate = spatial(self.rate_back(i, of_variable), Vec3::zero());
        start.velocity.angular += select(given, of_rate, zero).linear;
    }

    /// Moments of inertia of a segment about its own axes, in the step under way [kg m^2].
    #[inline(always)]
    fn moments_in_lanes(&self, i: usize) -> Vec3<T> {
        let own = &self.bodies[i];
        let moments = Vec3([own.transverse, own.transverse, own.axial]);
        if self.rigid.is_empty() { moments } else { self.moments_of_rigid(i, moments) }
    }

    #[cold]
    fn moments_of_rigid(&self, i: usize, otherwise: Vec3<T>) -> Vec3<T> {
        let mut out = otherwise;
        (0..T::LANES).for_each(|lane| put(&mut out, lane, self.moments(i, lane).0));
        out
    }

    /// Derivatives with respect to each load on a free body, force and torque, and by how much its mass matters through it:
    /// `field` is that of [`Component::start_back`], one entry a body. `each` is told the load's index, the lane that feels it, and
    /// its body.
    pub fn loads_back(&self, field: &[Spatial<T>], mut each: impl FnMut(usize, usize, usize, [Vec3<f64>; 2], f64)) {
        for load in self.loads.iter().filter(|load| !self.is_still(load.body)) {
            let lane = load.lane;
            let effective = self.effective.lane(lane);
            let (pushed, dt2) = (self.dt * effective * self.share().lane(lane), effective * effective);
            let [linear, angular] = [field[load.body].linear, field[load.body].angular].map(|x| pick(x, lane));
            let arm = pick(self.system.bodies[load.body].axis * load.offset, lane);
            let force = linear * pushed + angular.cross(arm) * dt2;
            let inverse_mass = self.bodies[load.body].inverse_mass.lane(lane);
            let of_mass = -linear.dot(pick(load.force, lane)) * pushed * inverse_mass;
            each(load.index, lane, load.body, [force, angular * dt2], of_mass);
        }
    }

    /// Back over [`Component::begin_anew`] after the step that is solved: `bars` become those before it.
    pub fn begin_anew_back(&self, bars: &mut [BodyBar<T>]) {
        let Some(steps) = &self.multistep else { return };
        for (_, bar) in bars.iter_mut().enumerate().filter(|(i, _)| !self.is_still(*i)) {
            bar.velocity.linear += bar.now.linear;
            bar.over += bar.now.angular;
            bar.gained = Spatial::zero().plus(bar.now, steps.rest());
            bar.now = Spatial::zero();
        }
    }
}

/// Derivatives with respect to moments of inertia about the axes of q of the momentum `s I w - h w x I w` in `momentum_back`.
#[inline(always)]
fn moments_of_momentum<T: Real>(q: Quat<T>, w: Vec3<T>, half: T, bar: Vec3<T>) -> Vec3<T> {
    let (w, bar) = (q.rotate_back(w), q.rotate_back(bar));
    zip(w, bar * cosine_of(w * half) - bar.cross(w) * half)
}
