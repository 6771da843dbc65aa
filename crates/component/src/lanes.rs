//! Filling the lanes of a component from a model and its state, and taking one lane out.

use jointed::system::System;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;
use rod::Model;

use super::inelastic::Laws;
use super::parts::{copy_pose, copy_spatial, pick, pick_pose, pick_spatial, put, vec3};
use super::sliding::Eyelets;
use super::{Component, Members};

impl<T: Real> Component<T> {
    pub(super) fn fill_lane(&mut self, model: &Model, members: &Members, lane: usize) {
        for (body, &index) in self.bodies.iter_mut().zip(&members.segments) {
            let segment = &model.segments[index];
            body.length.set_lane(lane, segment.length);
            body.radius.set_lane(lane, segment.radius);
            body.inverse_mass.set_lane(lane, 1.0 / segment.mass());
            body.transverse.set_lane(lane, segment.transverse_inertia());
            body.axial.set_lane(lane, segment.axial_inertia());
            body.free.set_lane(lane, 1.0);
        }
        self.fix(model, members, lane);
        for (k, &index) in members.joints.iter().enumerate() {
            let joint = &model.joints[index];
            let constants = &mut self.joints[k];
            constants.put_rest(lane, model.strain_measure, &joint.rest_darboux, joint.length);
            constants.stretch.set_lane(lane, joint.stretch_compliance);
            constants.shear.set_lane(lane, joint.shear_compliance);
            constants.bend.set_lane(lane, joint.bend_compliance);
            constants.twist.set_lane(lane, joint.twist_compliance);
            let terms = &mut self.system.joints[k];
            terms.offsets[0].set_lane(lane, joint.offset_a);
            terms.offsets[1].set_lane(lane, joint.offset_b);
            terms.length.set_lane(lane, joint.length);
        }
        self.add_loose(model, members, lane);
        for (pose, &index) in self.poses[members.segments.len()..].iter_mut().zip(&members.anchors) {
            let anchor = &model.anchors[index];
            put(&mut pose.x, lane, vec3(&anchor.position));
            put(&mut pose.q.v, lane, vec3(&anchor.orientation.imag()));
            pose.q.w.set_lane(lane, anchor.orientation.w);
        }
    }

    /// One lane as a component of its own.
    pub fn extract_lane(&self, lane: usize) -> Component<f64> {
        // Where a load is among those of its lane.
        let place = |load: usize| self.loads[..load].iter().filter(|own| own.lane == lane).count();
        let mut out = Component {
            system: System::new(self.system.topology.clone()),
            poses: self.poses.iter().map(|pose| pick_pose(pose, lane)).collect(),
            start: self.start.iter().map(|pose| pick_pose(pose, lane)).collect(),
            predicted: self.predicted.iter().map(|pose| pick_pose(pose, lane)).collect(),
            velocities: self.velocities.iter().map(|v| pick_spatial(v, lane)).collect(),
            strain_measure: self.strain_measure,
            lambda: self.lambda.iter().map(|lambda| pick_spatial(lambda, lane)).collect(),
            dlambda: vec![Spatial::zero(); self.lambda.len()],
            scratch: vec![Spatial::zero(); self.scratch.len()],
            momentum: Vec::new(),
            is_apart: false,
            pulls: vec![Vec3::zero(); self.pulls.len()],
            held: self.held.iter().map(|held| pick(*held, lane)).collect(),
            pushes: Vec::new(),
            pushed: Vec::new(),
            contact_stiffness: Vec::new(),
            given: self.given.iter().map(|given| given.lane(lane)).collect(),
            has_given: self.has_given,
            moved: self.moved.iter().filter(|moved| moved.lane == lane).map(|moved| moved.alone()).collect(),
            released: self.released.iter().filter(|one| one.lane == lane).map(|one| one.alone()).collect(),
            is_released_in_order: false,
            eyelets: Eyelets::default(),
            laws: Laws::default(),
            breakable: Vec::new(),
            broken: Vec::new(),
            resting: self
                .resting
                .iter()
                .filter(|resting| resting.lane == lane)
                .map(|resting| resting.alone())
                .collect(),
            longest_unit: f64::INFINITY,
            correction: f64::INFINITY,
            unsolved: 0.0,
            used: 1,
            pulls_hold: false,
            bodies: self.bodies.iter().map(|body| body.pick(lane)).collect(),
            joints: self.joints.iter().map(|joint| joint.pick(lane)).collect(),
            extras: self.extras.pick(lane),
            loads: self.loads.iter().filter(|load| load.lane == lane).map(|load| load.alone()).collect(),
            changing: self.changing.iter().filter(|own| own.lane == lane).map(|own| own.alone(place)).collect(),
            rigid: self.pick_rigid(lane),
            drag: self.drag.as_ref().map(|drag| Box::new(drag.pick(lane))),
            solves: self.solves,
            evaluations: self.evaluations,
            torques_wait: false,
            segments: self.segments,
            gravity: pick(self.gravity, lane),
            damping: self.damping.map(|rate| rate.lane(lane)),
            last_dt: self.last_dt.lane(lane),
            last_effective: self.last_effective.lane(lane),
            effective: self.effective.lane(lane),
            multistep: self.multistep.as_ref().map(|steps| Box::new(steps.pick(lane))),
            time: self.time,
            dt: self.dt,
        };
        out.extras.prepare(&mut out.system);
        for (terms, own) in out.system.joints.iter_mut().zip(&self.system.joints) {
            terms.offsets = own.offsets.map(|z| z.lane(lane));
            terms.length = own.length.lane(lane);
        }
        out
    }

    /// Puts poses and velocities of a component of its own back into its lane.
    pub fn insert_lane(&mut self, lane: usize, from: &Component<f64>) {
        self.put_motion(lane, from);
        for (lambda, own) in self.lambda.iter_mut().zip(&from.lambda) {
            copy_spatial(lambda, lane, own, 0);
        }
        for (given, own) in self.given.iter_mut().zip(&from.given) {
            given.set_lane(lane, *own);
        }
        self.insert_rigid(lane, &from.rigid);
        self.has_given |= from.has_given;
        if let (Some(steps), Some(from)) = (&mut self.multistep, &from.multistep) {
            steps.put(lane, from);
        }
    }

    /// Puts poses, velocities and pulls of a component of its own into its lane, and how long its last step was.
    #[inline(always)]
    pub(super) fn put_motion(&mut self, lane: usize, from: &Component<f64>) {
        for (pose, own) in self.poses.iter_mut().zip(&from.poses) {
            copy_pose(pose, lane, own, 0);
        }
        for (velocity, own) in self.velocities.iter_mut().zip(&from.velocities) {
            copy_spatial(velocity, lane, own, 0);
        }
        for (held, own) in self.held.iter_mut().zip(&from.held) {
            put(held, lane, own.0);
        }
        self.last_dt.set_lane(lane, from.last_dt);
        self.last_effective.set_lane(lane, from.last_effective);
    }
}
