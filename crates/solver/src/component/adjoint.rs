//! The way back over a step, body by body: from derivatives of a number with respect to the state at its end to those with
//! respect to the state at its start, and to what a body's own equations depend on.
//!
//! Poses change by a shift and a turn in world axes, `q' = exp(turn) q`. The turn between two orientations,
//! `theta = 2 Im(q' conj(q))` with the cosine c of half its angle, changes by `c (b - a) - theta x (a + b) / 2` as they are
//! turned by b and a. A derivative with respect to theta is so one with respect to both ([`of_ends`]). Of inertia that turns
//! with a body: `R I R^T x` is as it was where x is turned along.

use super::multistep::{gyroscopic_back, momentum_back};
use super::predict::angular_momentum;
use super::whole::turn_since;
use super::{BodyBar, Component};
use crate::kernel::Spatial;
use crate::kernel::math::{Quat, Vec3};

type V = Vec3<f64>;

/// A free rotation whose momentum is wrong by more than this, squared, goes on as the last one.
const UNSOLVED: f64 = 1e-14;

/// What a step's end says of a body: derivatives with respect to its pose there, and to its state before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ended {
    /// Of the pose at the end.
    pub(crate) pose: Spatial<f64>,
    start: BodyBar,
    moments: V,
}

impl Default for Ended {
    fn default() -> Self {
        Self { pose: Spatial::zero(), start: BodyBar::default(), moments: Vec3::zero() }
    }
}

impl Default for BodyGradient {
    fn default() -> Self {
        let zero = Vec3::zero();
        let (moments, own_moments, gravity, drag) = (zero, zero, zero, Spatial::zero());
        Self { mass: 0.0, moments, own_moments, gravity, damping: [0.0; 2], drag }
    }
}

/// Derivatives with respect to a body's own numbers in a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyGradient {
    /// Of its mass in the step, but for the loads on it.
    pub(crate) mass: f64,
    /// Of its moments of inertia in the step about its own axes.
    pub(crate) moments: V,
    /// Of those without what air adds.
    pub(crate) own_moments: V,
    /// Of gravity.
    pub(crate) gravity: V,
    /// Of the rates of damping.
    pub(crate) damping: [f64; 2],
    /// Of what drag adds to the prediction's velocity and momentum.
    pub(crate) drag: Spatial<f64>,
}

fn zip(a: V, b: V) -> V {
    Vec3([a.0[0] * b.0[0], a.0[1] * b.0[1], a.0[2] * b.0[2]])
}

fn spatial(linear: V, angular: V) -> Spatial<f64> {
    Spatial { linear, angular }
}

/// Derivatives with respect to the turns of both ends, the first and the second, from that of the turn between them.
#[inline(always)]
pub(super) fn of_ends((cosine, turn): (f64, V), bar: V) -> [V; 2] {
    let (along, across) = (bar * cosine, turn.cross(bar) * 0.5);
    [across - along, across + along]
}

impl Component<f64> {
    /// From derivatives with respect to a free body's state at the end of the step that is solved, but has not ended.
    pub(crate) fn end_back(&self, i: usize, bar: &BodyBar) -> Ended {
        let per = 1.0 / self.dt;
        let (start, end) = (self.start[i].q, self.poses[i].q);
        let since = turn_since(end, start);
        let mut out = Ended::default();
        let (mut shift, mut turn) = (bar.velocity.linear * per, bar.velocity.angular * per);
        if let Some(steps) = &self.multistep {
            let further = steps.further();
            shift += bar.now.linear * (per * (1.0 + further));
            out.start.velocity.linear = bar.now.linear * -further;
            out.start.over = bar.now.angular * -further;
            out.start.now = bar.earlier;
            let of_momentum = (bar.over + bar.now.angular * (1.0 + further)) * per;
            let inertia = |x: V| steps.inertia(i, end, x);
            let [momentum, of_turn] = momentum_back(inertia, since.1, 0.5, of_momentum);
            turn += of_turn;
            out.pose.angular = momentum.cross(of_momentum) - since.1.cross(of_turn);
            out.moments = moments_of_momentum(end, since.1, 0.5, of_momentum);
        }
        let [first, second] = of_ends(since, turn);
        out.pose = out.pose.plus(spatial(shift, second), 1.0);
        out.start.pose = spatial(-shift, first);
        out
    }

    /// From the solution `field` of the transposed equations in a free body's rows, and what the step's end says.
    pub(crate) fn start_back(&self, i: usize, field: Spatial<f64>, ended: &Ended) -> (BodyBar, BodyGradient) {
        let (pose, predicted, begin) = (&self.poses[i], &self.predicted[i], &self.start[i]);
        let mass = 1.0 / self.bodies[i].inverse_mass;
        let mut start = ended.start;
        let mut of_velocity = field.linear * (mass * self.dt);
        let share = self.multistep.as_ref().map_or(1.0, |steps| steps.share());
        let mut gradient = BodyGradient {
            mass: field.linear.dot(predicted.x - pose.x),
            moments: Vec3::zero(),
            own_moments: ended.moments,
            gravity: of_velocity * (self.effective * share),
            damping: [0.0; 2],
            drag: Spatial::zero(),
        };
        start.pose.linear += field.linear * mass;

        // The inertia's torque.
        let inertia = self.inertia_of(i, pose.q);
        let inertia = |x: V| inertia.apply(x);
        let since = turn_since(pose.q, predicted.q);
        let mut of_phi = -inertia(field.angular);
        let [f, p] = [field.angular, since.1].map(|x| pose.q.rotate_back(x));
        gradient.moments -= zip(f, p);
        if self.multistep.is_some() {
            let theta = turn_since(pose.q, begin.q);
            let [of_theta, second] = gyroscopic_back(inertia, theta.1, since.1, field.angular);
            of_phi -= second;
            start.pose.angular += of_ends(theta, -of_theta)[0];
            let t = pose.q.rotate_back(theta.1);
            gradient.moments -= (zip(f, t.cross(p)) - zip(f.cross(t), p) + zip(f.cross(p), t)) * 0.5;
        }
        let of_predicted = of_ends(since, of_phi)[0];

        // The free rotation.
        start.pose.angular += of_predicted;
        let (of_momentum, of_variable) = self.turn_back(i, predicted.q.rotate_back(of_predicted), &mut gradient);
        let (variable, half) = self.variable_of(i);
        let w = begin.q.rotate_back(variable);
        gradient.drag = spatial(of_velocity * share, of_momentum * share);
        let mut of_w = of_variable;
        let damping = &mut gradient.damping;
        let old = self.velocities[i].linear;
        match &self.multistep {
            None => {
                let kept = self.damping.map(|rate| (-rate * self.dt).exp());
                let moments = self.moments(i, 0);
                let bar = of_momentum * kept[1];
                let [momentum, of_turn] = momentum_back(|x| zip(moments, x), w, half, bar);
                of_w += of_turn;
                gradient.moments += moments_of_momentum(Quat::identity(), w, half, bar);
                damping[1] -= self.dt * momentum.dot(bar);
                damping[0] -= self.dt * kept[0] * old.dot(of_velocity);
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
                steps.carry_back(i, spatial(of_velocity, of_carried), [self.dt, self.last_dt], &mut start, damping);
            }
        }
        let of_world = begin.q.rotate(of_w);
        start.pose.angular += of_world.cross(variable);
        start.velocity.angular += self.rate_back(i, of_world);
        self.given_back(i, &mut start, &mut gradient);
        (start, gradient)
    }

    /// The solver's variable of a body's rotation before the step under way, and half the length of the step that it is of.
    fn variable_of(&self, i: usize) -> (V, f64) {
        let half = 0.5 * if self.last_dt > f64::MIN_POSITIVE { self.last_dt } else { self.dt };
        self.variable(i, half)
    }

    /// Back over the free rotation, of which `s I u + u x I u = (dt / 2) m`: from the derivative with respect to a turn in the
    /// frame at its end to those with respect to m and, where there is no such rotation, to the variable of the last one.
    fn turn_back(&self, i: usize, bar: V, gradient: &mut BodyGradient) -> (V, V) {
        let half = 0.5 * self.dt;
        let Quat { v: u, w: s } = (self.start[i].q.conj() * self.predicted[i].q).upper();
        let of_u = (bar * s + u * (u.dot(bar) / s) - bar.cross(u)) * 2.0;
        let moments = self.moments(i, 0);
        let turning = zip(moments, u);
        let momentum = self.momentum_before(i) * half;
        let missed = turning * s + u.cross(turning) - momentum;
        if missed.norm_squared() > UNSOLVED * momentum.norm_squared() {
            return (Vec3::zero(), of_u * half);
        }
        let column = |k: usize| {
            let mut e = Vec3::zero();
            e.0[k] = 1.0;
            let own = zip(moments, e);
            own * s - turning * (u.0[k] / s) + e.cross(turning) + u.cross(own)
        };
        let [a, b, c] = [column(0), column(1), column(2)];
        let [x, y, z] = of_u.0;
        let answer = (b.cross(c) * x + c.cross(a) * y + a.cross(b) * z) * (1.0 / a.dot(b.cross(c)));
        gradient.moments -= zip(u, answer * s + answer.cross(u));
        (answer * half, Vec3::zero())
    }

    /// The momentum of the free rotation of a body, in its frame at the start of the step.
    fn momentum_before(&self, i: usize) -> V {
        let q = self.start[i].q;
        let (momentum, share) = match &self.multistep {
            None => {
                let (variable, half) = self.variable_of(i);
                let w = q.rotate_back(variable);
                let kept = (-self.damping[1] * self.dt).exp();
                (angular_momentum(zip(self.moments(i, 0), w), w * half) * kept, 1.0)
            }
            Some(steps) => {
                let Vec3([x, y, z]) = q.rotate_back(steps.predicted(i, self.velocities[i].linear).angular);
                let heavier = self.bodies[i].transverse / steps.transverse(i);
                (Vec3([x * heavier, y * heavier, z]), steps.share())
            }
        };
        self.drag.as_ref().map_or(momentum, |drag| momentum + drag.impulses[i].angular * share)
    }

    /// From the derivative with respect to the solver's variable to that with respect to the rate, where that was given.
    fn rate_back(&self, i: usize, bar: V) -> V {
        if self.given[i] < 0.0 {
            return bar;
        }
        let rate = self.velocities[i].angular;
        let squared = rate.norm_squared();
        let half = 0.5 * self.dt * squared.sqrt();
        if half < 1e-9 {
            return bar;
        }
        let ratio = half.sin() / half;
        bar * ratio + rate * (rate.dot(bar) * (half.cos() - ratio) / squared)
    }

    /// Back over the momentum of a rate that was given: see `take_given_momenta`.
    fn given_back(&self, i: usize, start: &mut BodyBar, gradient: &mut BodyGradient) {
        let Some(steps) = self.multistep.as_ref().filter(|_| self.given[i] >= 0.0) else { return };
        let bar = std::mem::replace(&mut start.now.angular, Vec3::zero());
        let q = self.start[i].q;
        let (variable, half) = self.variable_of(i);
        let cosine = (1.0 - (variable * half).norm_squared()).max(0.0).sqrt();
        let turning = steps.inertia(i, q, variable);
        let of_variable = steps.inertia(i, q, bar) * cosine - variable * (half * half * bar.dot(turning) / cosine);
        start.pose.angular += (turning * cosine).cross(bar) - variable.cross(of_variable);
        gradient.own_moments += zip(q.rotate_back(bar), q.rotate_back(variable)) * cosine;
        start.velocity.angular += self.rate_back(i, of_variable);
    }

    /// Derivatives with respect to each load on a free body, force and torque, and by how much its mass matters through it:
    /// `field` is that of [`Component::start_back`], one entry a body.
    pub(crate) fn loads_back(&self, field: &[Spatial<f64>], mut each: impl FnMut(usize, usize, [V; 2], f64)) {
        let share = self.multistep.as_ref().map_or(1.0, |steps| steps.share());
        let (pushed, dt2) = (self.dt * self.effective * share, self.effective * self.effective);
        for load in self.loads.iter().filter(|load| !self.is_still(load.body)) {
            let Spatial { linear, angular } = field[load.body];
            let arm = self.system.bodies[load.body].axis * load.offset;
            let force = linear * pushed + angular.cross(arm) * dt2;
            let of_mass = -linear.dot(load.force) * pushed * self.bodies[load.body].inverse_mass;
            each(load.index, load.body, [force, angular * dt2], of_mass);
        }
    }

    /// Back over [`Component::begin_anew`] after the step that is solved: `bars` become those before it. `each` is told the
    /// derivative with respect to gravity of each free body, and `of_load` those with respect to the force of a load and, by it, the
    /// body's mass.
    pub(crate) fn begin_anew_back(
        &self,
        bars: &mut [BodyBar],
        mut each: impl FnMut(V),
        mut of_load: impl FnMut(usize, usize, V, f64),
    ) {
        let Some(steps) = &self.multistep else { return };
        let rest = if steps.goes_on() { 0.5 * self.dt } else { 0.0 };
        let pulls: Vec<V> = bars.iter().map(|bar| bar.now.linear * rest).collect();
        for (i, bar) in bars.iter_mut().enumerate().filter(|(i, _)| !self.is_still(*i)) {
            bar.velocity.linear += bar.now.linear;
            bar.over += bar.now.angular;
            bar.now = Spatial::zero();
            each(pulls[i]);
        }
        for load in self.loads.iter().filter(|load| !self.is_still(load.body)) {
            let (pull, inverse_mass) = (pulls[load.body], self.bodies[load.body].inverse_mass);
            let of_mass = -pull.dot(load.force) * inverse_mass * inverse_mass;
            of_load(load.index, load.body, pull * inverse_mass, of_mass);
        }
    }
}

/// Derivatives with respect to moments of inertia about the axes of q of the momentum `s I w - h w x I w` in `momentum_back`.
fn moments_of_momentum(q: Quat<f64>, w: V, half: f64, bar: V) -> V {
    let [w, bar] = [w, bar].map(|x| q.rotate_back(x));
    let cosine = (1.0 - (w * half).norm_squared()).max(0.0).sqrt();
    zip(w, bar * cosine - bar.cross(w) * half)
}
