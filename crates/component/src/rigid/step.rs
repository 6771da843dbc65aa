//! Rigid bodies of a component.

use kernels::lane::Real;
use kernels::math::{Quat, Vec3};
use rod::Model;

use super::Rigid;
use crate::parts::{copy_lane, pick, put, vec3};
use crate::turns::{angular_momentum, gyroscopic};
use crate::{Component, Members};

impl<T: Real> Component<T> {
    /// Takes in a model's rigid bodies in one lane.
    pub(crate) fn add_rigid(&mut self, model: &Model, members: &Members, lane: usize) {
        let joints = || members.joints.iter().map(|&k| &model.joints[k]);
        for (body, &index) in members.segments.iter().enumerate() {
            let segment = &model.segments[index];
            let Some(rigid) = &segment.body else { continue };
            let mut held_by = Vec::new();
            for (k, (joint, ends)) in joints().zip(&self.system.topology.joints).enumerate() {
                let across = joint.mount.map_or([Default::default(); 2], |mount| mount.across);
                for (end, (sign, along)) in [(1.0, joint.offset_a), (-1.0, joint.offset_b)].into_iter().enumerate() {
                    if ends[end] as usize == body {
                        held_by.push((k, sign, Vec3([across[end].x, across[end].y, along])));
                    }
                }
            }
            let none = [Vec3::zero(); 3];
            let inertia = Vec3::splat(Vec3(vec3(&rigid.inertia)));
            let (mass, drag_area) = (segment.mass(), rigid.drag_area);
            self.rigid.push(Rigid { lane, body, mass, drag_area, inertia, held_by, pull: none, held: none });
        }
    }

    /// Moments of inertia of a lane's segment about its own axes [kg m^2].
    pub(crate) fn moments(&self, body: usize, lane: usize) -> Vec3<f64> {
        let own = &self.bodies[body];
        let across = own.transverse.lane(lane);
        let rigid = self.rigid.iter().find(|rigid| (rigid.lane, rigid.body) == (lane, body));
        rigid.map_or(Vec3([across, across, own.axial.lane(lane)]), |rigid| pick(rigid.inertia, lane))
    }

    /// The spin of a segment that is oriented so, a time after or before it has this one, where nothing acts on it: Euler's equations to first order
    /// [rad/s, s].
    pub fn spin_after(&self, body: usize, spin: Vec3<f64>, q: Quat<f64>, time: f64) -> Vec3<f64> {
        let (own, Vec3(moments)) = (q.rotate_back(spin), self.moments(body, 0));
        let momentum = Vec3([0, 1, 2].map(|k| own.0[k] * moments[k]));
        let Vec3(torque) = momentum.cross(own);
        let rate = Vec3([0, 1, 2].map(|k| torque[k] / moments[k]));
        q.rotate(own + rate * time)
    }

    /// Those of all segments in all lanes, and >= 0 where one is a rigid body; none where none is.
    pub(crate) fn all_moments(&self) -> Vec<(Vec3<T>, T)> {
        let count = if self.rigid.is_empty() { 0 } else { self.segments };
        let mut all = vec![(Vec3::zero(), T::splat(-1.0)); count];
        for (body, (moments, _)) in all.iter_mut().enumerate() {
            (0..T::LANES).for_each(|lane| put(moments, lane, self.moments(body, lane).0));
        }
        for rigid in &self.rigid {
            all[rigid.body].1.set_lane(rigid.lane, 1.0);
        }
        all
    }

    /// Rigid bodies of one lane, for a component of its own.
    pub(crate) fn pick_rigid(&self, lane: usize) -> Vec<Rigid<f64>> {
        let own = self.rigid.iter().filter(|rigid| rigid.lane == lane).cloned();
        own.map(|Rigid { body, mass, drag_area, inertia, held_by, pull, held, .. }| Rigid {
            lane: 0,
            body,
            mass,
            drag_area,
            inertia: pick(inertia, lane),
            held_by,
            pull,
            held,
        })
        .collect()
    }

    /// Takes what one lane's rigid bodies were pulled by from a component of its own.
    pub(crate) fn insert_rigid(&mut self, lane: usize, from: &[Rigid<f64>]) {
        for (own, from) in self.rigid.iter_mut().filter(|rigid| rigid.lane == lane).zip(from) {
            own.held = from.held;
        }
    }

    /// The general tops' free rotation; `last_half` is half the last step, `kept` what damping leaves of an angular momentum.
    pub(crate) fn turn_rigid(&mut self, last_half: T, kept: T) {
        for k in 0..self.rigid.len() {
            let Rigid { lane, body, .. } = self.rigid[k];
            if self.is_fixed(body, lane) {
                continue;
            }
            let (rate, last_half) = self.variable(body, last_half);
            let (rigid, q) = (&self.rigid[k], self.start[body].q);
            let w = q.rotate_back(rate);
            let (mut m, share) = match &self.multistep {
                None => (angular_momentum(rigid.times_inertia(w), w * last_half) * kept, T::splat(1.0)),
                Some(steps) => {
                    let predicted = steps.predicted(body, self.velocities[body].linear);
                    (q.rotate_back(predicted.angular), steps.share())
                }
            };
            if let Some(drag) = &self.drag {
                m += drag.impulses[body].angular * share;
            }
            let half = T::splat(0.5 * self.dt);
            let q = (q * rigid.free_turn(m, w * half, half)).normalized();
            let predicted = &mut self.predicted[body].q;
            copy_lane(&mut predicted.v, lane, q.v);
            predicted.w.copy_lane(lane, q.w);
        }
    }

    /// The rigid bodies' inverse inertia at the current poses.
    pub(crate) fn evaluate_rigid(&mut self, geometric: bool) {
        let bodies = &self.bodies;
        for rigid in self.rigid.iter().filter(|rigid| bodies[rigid.body].free.lane(rigid.lane) != 0.0) {
            let inverse = rigid.inverse_inertia(self.poses[rigid.body].q, geometric);
            for (own, x) in self.system.bodies[rigid.body].inverse_inertia.0.iter_mut().zip(inverse.0) {
                own.copy_lane(rigid.lane, x);
            }
        }
    }

    /// The rigid bodies' corrections that the momentum residual asks for.
    pub(crate) fn momentum_of_rigid(&mut self) {
        let bodies = &self.bodies;
        for rigid in self.rigid.iter().filter(|rigid| bodies[rigid.body].free.lane(rigid.lane) != 0.0) {
            let (body, q) = (rigid.body, self.poses[rigid.body].q);
            let phi = (q * self.predicted[body].q.conj()).upper().v * T::splat(2.0);
            let inertia = |x: Vec3<T>| q.rotate(rigid.times_inertia(q.rotate_back(x)));
            let mut turning = inertia(phi);
            if self.multistep.is_some() {
                let theta = (q * self.start[body].q.conj()).upper().v * T::splat(2.0);
                turning += gyroscopic(inertia, theta, phi);
            }
            let dphi = self.system.bodies[body].inverse_inertia.apply(self.scratch[body].angular - turning);
            copy_lane(&mut self.momentum[body].angular, rigid.lane, dphi);
        }
    }

    /// Sums what pulls the rigid bodies: the multipliers of their joints, and loads times dt^2.
    pub(crate) fn gather_rigid_pulls(&mut self) {
        let Self { rigid, lambda, loads, effective, .. } = self;
        for Rigid { lane, body, held_by, pull, .. } in rigid {
            let dt = effective.lane(*lane);
            *pull = [Vec3::zero(); 3];
            for &(joint, sign, place) in held_by.iter() {
                let force = pick(lambda[joint].linear, *lane) * sign;
                for (pull, along) in pull.iter_mut().zip(place.0) {
                    *pull += force * along;
                }
            }
            for load in loads.iter().filter(|load| load.body == *body) {
                pull[2] += pick(load.force, *lane) * (load.offset.lane(*lane) * dt * dt);
            }
        }
    }

    /// The pulls with which a step begins: see `Component::expect_pulls`.
    pub(crate) fn expect_rigid_pulls(&mut self) {
        for rigid in &mut self.rigid {
            let dt = self.effective.lane(rigid.lane);
            rigid.pull = rigid.held.map(|held| held * (dt * dt));
        }
    }

    /// Keeps the pulls at the end of a step, in the lanes where `active` >= 0.
    pub(crate) fn keep_rigid_pulls(&mut self, active: T) {
        for rigid in self.rigid.iter_mut().filter(|rigid| active.lane(rigid.lane) >= 0.0) {
            let dt = self.effective.lane(rigid.lane);
            let per_dt2 = 1.0 / (dt * dt);
            rigid.held = rigid.pull.map(|pull| pull * per_dt2);
        }
    }
}
