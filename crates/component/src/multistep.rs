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
//! v, and for the discrete momentum of a step (see [`super::Component::predict`]), in the place of `(x' - x) / dt`. That momentum
//! is the body's half a step before, to second order, so that the combination at the end is of second order as well; and a
//! segment that feels nothing keeps it, and its energy, to rounding. (Wieloch and Arnold 2021 have BDF on Lie groups in
//! increments of poses; the variable of Moser and Veselov is one.)
//!
//! A segment is a symmetric top, whose angular momentum about its axis no torque across it changes. World axes do not keep
//! that from step to step: as the axis tilts, a part of the momentum across it in the steps before lies along it, and a thin
//! segment, which is light to spin, would take it for a spin of its own, many times that which it has. `xpbd`,
//! which has the spin from the poses, therefore carries the share along the axis on as it was. `newton` does
//! not: it balances world vectors, and so the angular momentum of a whole rod, to second order.
//!
//! Velocities of Algorithm 1 remain those over the last step; those at its end are kept here.

mod back;
mod step;

use kernels::Spatial;
use kernels::dual::Dual;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};
use nalgebra::Vector3;

use super::before::{Group, scatter};
use super::constants::BodyConstants;
use super::parts::{copy_spatial, pick, pick_spatial, put, set_slope};
use crate::snapshot::StateVisitor;

pub(super) use back::{gyroscopic_back, momentum_back};

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
    /// Per segment: what its velocity and angular momentum gained in the step before the last one.
    gained: Vec<Spatial<T>>,
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

    /// Shows a visitor what the next step builds on; the rest is of one step.
    pub(super) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        let Self { now, earlier, over, goes_on, .. } = self;
        visitor.list(now, StateVisitor::spatial);
        visitor.list(earlier, StateVisitor::spatial);
        visitor.list(over, StateVisitor::vector);
        visitor.real(goes_on);
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

    /// A segment's velocity at the end of the last step in a lane [m/s].
    pub(super) fn set_velocity(&mut self, index: usize, lane: usize, velocity: Vec3<f64>) {
        put(&mut self.now[index].linear, lane, velocity.0);
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
            gained: all(&self.gained),
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

    /// Goes on from the steps before, or not, as a step did that knew so much.
    pub(super) fn go_on_like(&mut self, before: &StepsBefore) {
        self.goes_on = T::splat(before.goes_on);
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
