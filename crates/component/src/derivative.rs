//! A component beside itself in dual numbers: what a step's equations change by, and how bodies follow.

use kernels::Spatial;
use kernels::dual::Dual;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};
use nalgebra::Vector3;
use rod::{Air, Model};

use super::parts::set_slope;
use super::tangent::vector;
use super::{BodyPose, Component, Group, Members};
use crate::Interval;
use crate::forces::Varying;
use crate::formulation::Formulation;
use crate::variation::{AirVariation, JointVariation, SegmentVariation, Variation};

impl<T: Real> Component<T> {
    /// `-g` of a body that is not held, at the last evaluation: impulse times dt [kg m] and angular impulse times dt [kg m^2].
    #[inline(always)]
    pub(super) fn defect(&self, i: usize) -> Spatial<T> {
        let terms = &self.system.bodies[i];
        // What the evaluation has multiplied by its M^-1.
        let asked = self.momentum[i];
        let mass = T::splat(1.0) / terms.inverse_mass;
        Spatial { linear: asked.linear * mass, angular: terms.inverse_inertia.inverse().apply(asked.angular) }
    }

    /// `-(C + alpha~ lambda)` of a joint at the last evaluation, in world rows.
    #[inline(always)]
    pub(super) fn missed(&self, j: usize) -> Spatial<T> {
        let (system, terms) = (&self.system, &self.system.joints[j]);
        let rhs = terms.to_world(terms.rhs, system.frame(j));
        if self.is_apart {
            return rhs;
        }
        // The right-hand side of the dual system has J M^-1 g in it.
        rhs.plus(system.constraint_change(j, &self.momentum), T::splat(1.0))
    }

    /// Whether a body is held, or an anchor.
    pub fn is_still(&self, body: usize) -> bool {
        self.bodies[body].free.lane(0) == 0.0
    }

    /// Whether something moves a body that is held in a lane.
    pub fn is_moved(&self, body: usize, lane: usize) -> bool {
        self.moved.iter().any(|moved| moved.is_of(lane, body))
    }

    /// The prediction of a step, for which forces are set.
    pub fn predict_step(&mut self, Interval { time, dt }: Interval) {
        if self.has_air() {
            self.evaluate_drag(time, dt);
        }
        self.predict(time, dt, Formulation::Newton);
    }

    /// What the prediction of a step asks of the air.
    pub fn evaluate_drag_step(&mut self, Interval { time, dt }: Interval) {
        self.evaluate_drag(time, dt);
    }

    /// [`Component::evaluate`] of formulation `newton`.
    pub fn evaluate_step(&mut self) {
        self.pulls_hold = false;
        self.evaluate(Formulation::Newton);
    }

    /// Ends a step that is solved.
    pub fn end_solved_step(&mut self) {
        self.update_velocities(Formulation::Newton, T::splat(1.0));
    }
}

fn slope<const D: usize>(x: Vec3<Dual<D>>, k: usize) -> Vec3<f64> {
    Vec3([x.0[0].slope[k], x.0[1].slope[k], x.0[2].slope[k]])
}

fn value<const D: usize>(x: Vec3<Dual<D>>) -> Vec3<f64> {
    Vec3([x.0[0].value, x.0[1].value, x.0[2].value])
}

/// The slope of a spatial vector along a direction.
pub fn slope_of<const D: usize>(x: &Spatial<Dual<D>>, k: usize) -> [Vector3<f64>; 2] {
    [vector(slope(x.linear, k)), vector(slope(x.angular, k))]
}

/// Lets a pose change along a direction, by a shift and a turn in world axes.
pub fn move_along<const D: usize>(pose: &mut BodyPose<Dual<D>>, k: usize, [shift, turn]: &[Vector3<f64>; 2]) {
    set_slope(&mut pose.x, k, shift);
    let half = turn * 0.5;
    let (v, w) = (vector(value(pose.q.v)), pose.q.w.value);
    set_slope(&mut pose.q.v, k, &(half * w + half.cross(&v)));
    pose.q.w.slope[k] = -half.dot(&v);
}

/// How a pose changes along a direction: the inverse of [`move_along`].
pub fn movement_along<const D: usize>(pose: &BodyPose<Dual<D>>, k: usize) -> [Vector3<f64>; 2] {
    let of = Quat { v: slope(pose.q.v, k), w: pose.q.w.slope[k] };
    let turn = of * Quat { v: value(pose.q.v), w: pose.q.w.value }.conj();
    [vector(slope(pose.x, k)), vector(turn.v * 2.0)]
}

impl<const D: usize> Component<Dual<D>> {
    /// Puts a step's solution in its place, as constants.
    pub fn place_constant(&mut self, poses: &[BodyPose<f64>], lambda: &[Spatial<f64>]) {
        for (own, pose) in self.poses.iter_mut().zip(poses) {
            *own = BodyPose::splat(pose);
        }
        for (own, lambda) in self.lambda.iter_mut().zip(lambda) {
            *own = Spatial::splat(*lambda);
        }
    }

    /// What `-g` of a body changes by along a direction; zero where it is held.
    pub fn defect_along(&self, defects: &[Spatial<Dual<D>>], i: usize, k: usize) -> [Vector3<f64>; 2] {
        if self.is_still(i) { [Vector3::zeros(); 2] } else { slope_of(&defects[i], k) }
    }

    /// `-g` of all bodies (not a number where one is held) and what all joints miss.
    pub fn right_hand_sides(&self, bodies: &mut Vec<Spatial<Dual<D>>>, joints: &mut Vec<Spatial<Dual<D>>>) {
        bodies.clear();
        bodies.extend((0..self.segments).map(|i| self.defect(i)));
        joints.clear();
        joints.extend((0..self.lambda.len()).map(|j| self.missed(j)));
    }

    /// Lets multipliers change along a direction, by a force and a torque times dt^2 in world rows.
    pub fn transmit_along(&mut self, j: usize, k: usize, world: &[Vector3<f64>; 2]) {
        let [force, torque] = world.map(|x| Vec3::splat(Vec3(x.into())));
        let rows = self.system.joints[j]
            .multipliers_from_world(Spatial { linear: force, angular: torque }, self.system.frame(j));
        let rows = self.without_free_rows(j, rows);
        let own = &mut self.lambda[j];
        set_slope(&mut own.linear, k, &vector(value(rows.linear)));
        set_slope(&mut own.angular, k, &vector(value(rows.angular)));
    }
}

impl<const D: usize> Component<Dual<D>> {
    /// Lets constants change along a direction.
    pub fn seed_constants(&mut self, members: &Members, model: &Model, k: usize, variation: &Variation) {
        for (i, &index) in members.segments.iter().enumerate() {
            self.seed_segment(i, k, &variation.segments[index]);
            let segment = &model.segments[index];
            let (Some(drag), Some(air)) = (&mut self.drag, &model.air) else { continue };
            drag.seed(i, k, segment.radius * segment.length, air, &variation.air);
        }
        for (j, &index) in members.joints.iter().enumerate() {
            self.seed_joint(j, k, &variation.joints[index]);
        }
        for (own, rate) in self.damping.iter_mut().zip(variation.damping) {
            own.slope[k] = rate;
        }
    }

    /// Lets the inertia of a segment change along a direction.
    pub(crate) fn seed_segment(&mut self, i: usize, k: usize, variation: &SegmentVariation) {
        if self.is_still(i) {
            return;
        }
        let transverse = 0.5 * (variation.inertia.x + variation.inertia.y);
        let constants = &mut self.bodies[i];
        let inverse = constants.inverse_mass.value;
        let inverse_slope = -variation.mass * inverse * inverse;
        constants.inverse_mass.slope[k] = inverse_slope;
        constants.transverse.slope[k] = transverse;
        constants.axial.slope[k] = variation.inertia.z;
        if let Some(steps) = &mut self.multistep {
            steps.seed_inertia(i, k, inverse_slope, &variation.inertia);
        }
        if let Some(drag) = &mut self.drag {
            drag.seed_inertia(i, k, variation.mass, transverse);
        }
        for rigid in self.rigid.iter_mut().filter(|rigid| rigid.body == i) {
            set_slope(&mut rigid.inertia, k, &variation.inertia);
        }
    }

    /// Lets a joint change along a direction.
    pub(crate) fn seed_joint(&mut self, j: usize, k: usize, variation: &JointVariation) {
        self.seed_rest(j, k, &variation.rest_darboux);
        let own = &mut self.joints[j];
        own.stretch.slope[k] = variation.stretch_compliance;
        own.shear.slope[k] = variation.shear_compliance;
        own.bend.slope[k] = variation.bend_compliance;
        own.twist.slope[k] = variation.twist_compliance;
        self.extras.seed(self.joints.len(), j, k, variation);
        self.extras.prepare(&mut self.system);
    }

    /// Lets the Darboux vector at rest of a joint change along a direction.
    fn seed_rest(&mut self, j: usize, k: usize, by: &Vector3<f64>) {
        let (length, measure) = (self.system.joints[j].length.value, self.strain_measure);
        let rest = self.joints[j].darboux.0.map(|x| x.value);
        let slope = measure.slope_at_rest(&rest.into(), length);
        set_slope(&mut self.joints[j].rest, k, &(slope * by));
    }

    /// Lets a body begin with other pose and velocities along a direction.
    pub fn seed_start(&mut self, i: usize, k: usize, pose: [Vector3<f64>; 2], velocity: [Vector3<f64>; 2]) {
        self.seed_pose(i, k, pose);
        set_slope(&mut self.velocities[i].linear, k, &velocity[0]);
        set_slope(&mut self.velocities[i].angular, k, &velocity[1]);
        if let Some(steps) = &mut self.multistep {
            steps.seed_velocity(i, k, &velocity[0]);
        }
    }

    /// Lets a pose change along a direction.
    pub fn seed_pose(&mut self, i: usize, k: usize, movement: [Vector3<f64>; 2]) {
        move_along(&mut self.poses[i], k, &movement);
    }

    /// Lets loads, gravity, rests that change over time and wind change along a direction: after forces have been set for a step.
    pub fn seed_forces(&mut self, k: usize, variation: &Variation) {
        set_slope(&mut self.gravity, k, &variation.gravity);
        for load in &mut self.loads {
            let [force, torque] = &variation.loads[load.index];
            set_slope(&mut load.force, k, force);
            set_slope(&mut load.torque, k, torque);
        }
        let rests: Vec<_> = self.changing.iter().filter_map(Varying::rest).collect();
        for (joint, index) in rests {
            self.seed_rest(joint, k, &variation.joints[index].rest_darboux);
        }
        if let Some(drag) = &mut self.drag {
            set_slope(&mut drag.breeze, k, &variation.air.wind);
        }
    }

    /// What a free segment's velocity at the end of the last step changes by along a direction [m/s, rad/s].
    pub fn velocity_along(&self, body: usize, k: usize) -> [Vector3<f64>; 2] {
        slope_of(&self.velocity_at_end(body), k)
    }
}

fn unit(k: usize) -> [Vector3<f64>; 2] {
    let mut out = [Vector3::zeros(); 2];
    out[k / 3][k % 3] = 1.0;
    out
}

impl Component<Dual<6>> {
    /// Lets the numbers of a group change by so much, each along a direction, of all bodies that are free.
    pub fn seed_group(&mut self, group: Group, by: f64) {
        let along = |x: &mut Spatial<Dual<6>>, k: usize| {
            let [linear, angular] = unit(k).map(|x| x * by);
            set_slope(&mut x.linear, k, &linear);
            set_slope(&mut x.angular, k, &angular);
        };
        for i in (0..self.segments).filter(|&i| self.bodies[i].free.value != 0.0) {
            for k in 0..6 {
                match group {
                    Group::Pose => move_along(&mut self.poses[i], k, &unit(k).map(|x| x * by)),
                    Group::Velocity => along(&mut self.velocities[i], k),
                    Group::Now | Group::Earlier | Group::Over => {
                        if let Some(steps) = &mut self.multistep {
                            steps.seed_state(group, i, k, &unit(k).map(|x| x * by));
                        }
                    }
                }
            }
        }
    }

    /// What drag does of a body changes by along a direction: what it adds to the prediction, the inverse mass, and the moment
    /// of inertia across the axis.
    pub fn drag_along(&self, i: usize, k: usize) -> ([Vector3<f64>; 2], [f64; 2]) {
        let constants = &self.bodies[i];
        let inertia = [constants.inverse_mass, constants.transverse].map(|x| x.slope[k]);
        (self.drag.as_ref().map_or([Vector3::zeros(); 2], |drag| slope_of(&drag.impulses[i], k)), inertia)
    }

    /// Lets masses and the moments of inertia about all three axes change by so much, along the first four directions.
    pub fn seed_inertias(&mut self, by: f64) {
        for i in 0..self.segments {
            for k in 0..4 {
                let mass = if k == 0 { by } else { 0.0 };
                let inertia = Vector3::from_fn(|axis, _| if axis + 1 == k { by } else { 0.0 });
                self.seed_segment(i, k, &SegmentVariation { mass, inertia });
            }
        }
    }

    /// Lets gravity and the rates of damping change by so much, along the first five directions.
    pub fn seed_gravity_and_damping(&mut self, by: f64) {
        for k in 0..3 {
            self.gravity.0[k].slope[k] = by;
        }
        for (k, rate) in self.damping.iter_mut().enumerate() {
            rate.slope[3 + k] = by;
        }
    }

    /// Lets the air's density, its two drag coefficients and its velocity change by so much.
    pub fn seed_air(&mut self, members: &Members, model: &Model, air: &Air, by: f64) {
        let Some(drag) = &mut self.drag else { return };
        let of = [[by, 0.0, 0.0], [0.0, by, 0.0], [0.0, 0.0, by]];
        for (i, &index) in members.segments.iter().enumerate() {
            let segment = &model.segments[index];
            let profile = segment.radius * segment.length;
            for (k, [density, normal_drag, tangential_drag]) in of.into_iter().enumerate() {
                let wind = Vector3::zeros();
                drag.seed(i, k, profile, air, &AirVariation { density, normal_drag, tangential_drag, wind });
            }
        }
        for k in 0..3 {
            drag.breeze.0[k].slope[3 + k] = by;
        }
    }

    /// Lets force and torque change of the load of each segment that comes as its `rank`th; returns loads with their segments.
    pub fn seed_loads(&mut self, rank: usize) -> Vec<(usize, usize)> {
        let mut seeded = Vec::new();
        let mut counts = vec![0; self.segments];
        for load in &mut self.loads {
            let count = &mut counts[load.body];
            *count += 1;
            if *count != rank + 1 {
                continue;
            }
            for k in 0..6 {
                let [force, torque] = unit(k);
                set_slope(&mut load.force, k, &force);
                set_slope(&mut load.torque, k, &torque);
            }
            if self.bodies[load.body].free.value != 0.0 {
                seeded.push((load.index, load.body));
            }
        }
        seeded
    }

    /// Makes loads and gravity constants.
    pub fn still_forces(&mut self) {
        for x in &mut self.gravity.0 {
            x.slope = [0.0; 6];
        }
        for load in &mut self.loads {
            for x in load.force.0.iter_mut().chain(&mut load.torque.0) {
                x.slope = [0.0; 6];
            }
        }
    }
}
