//! What stays the same of bodies and joints from step to step, and loads.

use kernels::lane::Real;
use kernels::math::{Quat, Sym3, Vec3};
use nalgebra::Vector3;
use rod::StrainMeasure;

use super::parts::{pick, put, vec3};

/// What stays the same of a body; in air its inertia is that of the step under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyConstants<T> {
    pub(super) inverse_mass: T,
    /// Moments of inertia across and about the axis [kg m^2]; 1 where fixed.
    pub(super) transverse: T,
    pub(super) axial: T,
    /// 1 where the body moves freely, 0 where it is fixed.
    pub(super) free: T,
    pub(super) length: T,
    pub(super) radius: T,
}

impl<T: Real> BodyConstants<T> {
    /// `I x` in the body's frame.
    #[inline(always)]
    pub(super) fn inertia(&self, x: Vec3<T>) -> Vec3<T> {
        let [x, y, z] = x.0;
        Vec3([x * self.transverse, y * self.transverse, z * self.axial])
    }

    /// The inertia of a rod's segment in world axes.
    #[inline(always)]
    pub(super) fn world_inertia(&self, axis: Vec3<T>) -> Sym3<T> {
        Sym3::identity(self.transverse) + Sym3::outer(axis, self.axial - self.transverse)
    }

    pub(super) fn pick(&self, lane: usize) -> BodyConstants<f64> {
        BodyConstants {
            inverse_mass: self.inverse_mass.lane(lane),
            transverse: self.transverse.lane(lane),
            axial: self.axial.lane(lane),
            free: self.free.lane(lane),
            length: self.length.lane(lane),
            radius: self.radius.lane(lane),
        }
    }
}

/// What stays the same of a joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointConstants<T> {
    /// The strain at rest [1/m], by the set's measure; what turns freely has there what it has turned by.
    pub(super) rest: Vec3<T>,
    /// The Darboux vector at rest that it is of [1/m].
    pub(super) darboux: Vec3<T>,
    pub(super) stretch: T,
    pub(super) shear: T,
    pub(super) bend: T,
    pub(super) twist: T,
}

impl<T: Real> JointConstants<T> {
    /// Sets the Darboux vector at rest [1/m] of one lane of a joint of this `length` [m].
    pub(super) fn put_rest(&mut self, lane: usize, measure: StrainMeasure, darboux: &Vector3<f64>, length: f64) {
        put(&mut self.rest, lane, vec3(&measure.at_rest(darboux, length)));
        put(&mut self.darboux, lane, vec3(darboux));
    }

    pub(super) fn pick(&self, lane: usize) -> JointConstants<f64> {
        JointConstants {
            rest: pick(self.rest, lane),
            darboux: pick(self.darboux, lane),
            stretch: self.stretch.lane(lane),
            shear: self.shear.lane(lane),
            bend: self.bend.lane(lane),
            twist: self.twist.lane(lane),
        }
    }
}

/// What turns with a body: force and torque in its axes, and the force in world axes that the prediction of a step has added.
#[derive(Clone, Copy, Debug)]
pub(super) struct Follower<T> {
    pub(super) force: Vec3<T>,
    pub(super) torque: Vec3<T>,
    pub(super) predicted: Vec3<T>,
}

/// Loads on a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyLoad<T> {
    /// Index of the load in the model.
    pub(super) index: usize,
    /// The lane that feels it.
    pub(super) lane: usize,
    pub(super) body: usize,
    pub(super) offset: T,
    pub(super) force: Vec3<T>,
    pub(super) torque: Vec3<T>,
    /// Of a load that turns with the body: both in its axes, and the force that the prediction of the step has added.
    pub(super) own: Option<Follower<T>>,
    /// Mass of what the body displaces, of a load that stands for its buoyancy [kg]; else 0.
    pub(super) lift: f64,
    /// Whether it turns the body.
    pub(super) turns: bool,
}

impl<T: Real> BodyLoad<T> {
    /// Force and torque as they are given: in the body's axes if they turn with it.
    pub(super) fn given(&mut self) -> [&mut Vec3<T>; 2] {
        match &mut self.own {
            Some(Follower { force, torque, .. }) => [force, torque],
            None => [&mut self.force, &mut self.torque],
        }
    }

    /// Force and torque in world axes, where the body is oriented so.
    #[inline(always)]
    pub(super) fn in_world(&self, q: &Quat<T>) -> [Vec3<T>; 2] {
        match &self.own {
            Some(own) => [q.rotate(own.force), q.rotate(own.torque)],
            None => [self.force, self.torque],
        }
    }

    /// Turns them with the body, which is oriented so; returns by how much the force is not the predicted one.
    #[inline(always)]
    pub(super) fn turn(&mut self, q: &Quat<T>) -> Vec3<T> {
        [self.force, self.torque] = self.in_world(q);
        self.own.as_ref().map_or(Vec3::zero(), |own| self.force - own.predicted)
    }

    /// Turns them with the body, at the beginning of a step, as [`Self::turn`].
    #[inline(always)]
    pub(super) fn begin(&mut self, q: &Quat<T>) {
        self.turn(q);
        if let Some(own) = &mut self.own {
            own.predicted = self.force;
        }
    }

    /// The same of a component of its own.
    pub(super) fn alone(&self) -> BodyLoad<f64> {
        let lane = self.lane;
        BodyLoad {
            index: self.index,
            lane: 0,
            body: self.body,
            offset: self.offset.lane(lane),
            lift: self.lift,
            force: pick(self.force, lane),
            torque: pick(self.torque, lane),
            own: self.own.map(|own| Follower {
                force: pick(own.force, lane),
                torque: pick(own.torque, lane),
                predicted: pick(own.predicted, lane),
            }),
            turns: self.turns,
        }
    }
}
