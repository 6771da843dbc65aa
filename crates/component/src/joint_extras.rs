//! What joints may have beyond those of the paper: a second compliance of bending or across, rest frames, places across the
//! axes of rigid bodies, inner damping. A component without it holds empty lists and does nothing.

mod step;

use jointed::system::System;
use kernels::dual::Dual;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};
use rod::{InnerDamping, Joint, Model};

use super::Members;
use super::parts::{pick, put, vec3};
use crate::variation::JointVariation;

/// Lists with one entry a joint, each empty where no joint has such a thing.
#[derive(Clone, Debug)]
pub(super) struct JointExtras<T> {
    /// Compliance of bending about d2 less that about d1.
    pub(super) bend_extra: Vec<T>,
    /// Compliance along d2 of body a less that along its d1.
    pub(super) shear_extra: Vec<T>,
    /// Rest frames of bodies a and b.
    pub(super) rests: Vec<[Quat<T>; 2]>,
    /// Places of the connectors across the axes of bodies a and b, in their frames [m].
    pub(super) across: Vec<[Vec3<T>; 2]>,
    pub(super) damped: Vec<Damped<T>>,
    /// Whether a joint yields [`GRADED`] times as much to one moment as to another one.
    pub(super) is_graded: bool,
}

/// From this ratio of compliances on, digits of the smaller one are lost in their sum.
pub(super) const GRADED: f64 = 1e6;

/// Inner damping of a joint. A step of implicit Euler with the viscous force `tau / alpha dC / dt` is one with other
/// constants: `C - theta C_start + alpha' lambda = 0` with `theta = (tau / dt) / (1 + tau / dt)` and
/// `alpha' = alpha / (1 + tau / dt)`, C_start being the strain at the start of the step. With BDF2 the rate of the strain is
/// that over the step all the same: of first order.
#[derive(Clone, Copy, Debug)]
pub(super) struct Damped<T> {
    /// Relaxation times of bending, twist and stretch [s].
    pub(super) times: [T; 3],
    /// `Omega_0 + theta C_b` at the start of this step.
    pub(super) rest: Vec3<T>,
    /// `theta C_s` at the start of this step, in the frame of body a.
    pub(super) gap: Vec3<T>,
}

impl<T: Real> JointExtras<T> {
    /// That of joints that sets have in a model, one set a lane; the first also fills the lanes left over.
    pub(super) fn new(model: &Model, sets: &[&Members]) -> Self {
        let joints_of = |members: &Members| -> Vec<Joint> { members.joints.iter().map(|&k| model.joints[k]).collect() };
        let sets: Vec<Vec<Joint>> = sets.iter().map(|members| joints_of(members)).collect();
        let any = |has: &dyn Fn(&Joint) -> bool| sets.iter().flatten().any(has);
        let (is_second, is_sheared, is_turned, is_mounted, is_damped) = (
            any(&|joint| joint.bend_extra != 0.0),
            any(&|joint| joint.shear_extra != 0.0),
            any(&Joint::has_rest_frames),
            any(&|joint| joint.mount.is_some()),
            any(&|joint| joint.inner_damping != InnerDamping::NONE),
        );
        let count = sets.first().map_or(0, Vec::len);
        let list = |there: bool| if there { count } else { 0 };
        let still = Damped { times: [T::zero(); 3], rest: Vec3::zero(), gap: Vec3::zero() };
        let mut out = Self {
            bend_extra: vec![T::zero(); list(is_second)],
            shear_extra: vec![T::zero(); list(is_sheared)],
            rests: vec![[Quat::identity(); 2]; list(is_turned)],
            across: vec![[Vec3::zero(); 2]; list(is_mounted)],
            damped: vec![still; list(is_damped)],
            is_graded: any(&|joint| {
                let [x, y, z] = joint.bend_twist_compliance().into();
                x.max(y).max(z) > GRADED * x.min(y).min(z)
            }),
        };
        for lane in 0..T::LANES {
            let Some(joints) = sets.get(lane).or(sets.first()) else { continue };
            for (extra, joint) in out.bend_extra.iter_mut().zip(joints) {
                extra.set_lane(lane, joint.bend_extra);
            }
            for (extra, joint) in out.shear_extra.iter_mut().zip(joints) {
                extra.set_lane(lane, joint.shear_extra);
            }
            for (rests, joint) in out.rests.iter_mut().zip(joints) {
                for (rest, q) in rests.iter_mut().zip(&joint.rest_frames) {
                    put(&mut rest.v, lane, vec3(&q.imag()));
                    rest.w.set_lane(lane, q.w);
                }
            }
            for (across, joint) in out.across.iter_mut().zip(joints) {
                let Some(mount) = joint.mount else { continue };
                for (own, place) in across.iter_mut().zip(mount.across) {
                    put(own, lane, [place.x, place.y, 0.0]);
                }
            }
            for (damped, joint) in out.damped.iter_mut().zip(joints) {
                let InnerDamping { bending, twist, stretch } = joint.inner_damping;
                for (time, value) in damped.times.iter_mut().zip([bending, twist, stretch]) {
                    time.set_lane(lane, value);
                }
            }
        }
        out
    }

    /// Whether no joint has any of it.
    pub(super) fn is_empty(&self) -> bool {
        self.bend_extra.is_empty()
            && self.shear_extra.is_empty()
            && self.rests.is_empty()
            && self.across.is_empty()
            && self.damped.is_empty()
    }

    /// One lane.
    pub(super) fn pick(&self, lane: usize) -> JointExtras<f64> {
        let damped = |own: &Damped<T>| Damped {
            times: own.times.map(|time| time.lane(lane)),
            rest: pick(own.rest, lane),
            gap: pick(own.gap, lane),
        };
        JointExtras {
            bend_extra: self.bend_extra.iter().map(|extra| extra.lane(lane)).collect(),
            shear_extra: self.shear_extra.iter().map(|extra| extra.lane(lane)).collect(),
            rests: self
                .rests
                .iter()
                .map(|rests| rests.map(|q| Quat { v: pick(q.v, lane), w: q.w.lane(lane) }))
                .collect(),
            across: self.across.iter().map(|across| across.map(|place| pick(place, lane))).collect(),
            damped: self.damped.iter().map(damped).collect(),
            is_graded: self.is_graded,
        }
    }

    /// Gives a system the lists that its evaluation fills.
    pub(super) fn prepare(&self, system: &mut System<T>) {
        system.bend_extra.resize(self.bend_extra.len(), T::zero());
        system.shear_extra.resize(self.shear_extra.len(), T::zero());
        system.frames.resize(self.rests.len(), Quat::identity());
        system.across.resize(self.across.len(), [Vec3::zero(); 2]);
    }
}

impl<const D: usize> JointExtras<Dual<D>> {
    /// Lets what a joint has of it change along a direction, one of so many joints; a list that was empty is made where it is
    /// needed.
    pub(super) fn seed(&mut self, joints: usize, j: usize, k: usize, variation: &JointVariation) {
        let (zero, damping) = (Dual::splat(0.0), variation.inner_damping);
        let extra = |list: &mut Vec<Dual<D>>, by: f64| {
            if by != 0.0 {
                list.resize(joints, zero);
            }
            if let Some(own) = list.get_mut(j) {
                own.slope[k] = by;
            }
        };
        extra(&mut self.bend_extra, variation.bend_extra);
        extra(&mut self.shear_extra, variation.shear_extra);
        if damping != InnerDamping::NONE {
            self.damped.resize(joints, Damped { times: [zero; 3], rest: Vec3::zero(), gap: Vec3::zero() });
        }
        if let Some(own) = self.damped.get_mut(j) {
            for (time, by) in own.times.iter_mut().zip([damping.bending, damping.twist, damping.stretch]) {
                time.slope[k] = by;
            }
        }
    }
}
