//! One connected set of segments in motion: the state, and the stages of Algorithm 1 (paper, section 3) on it.
//!
//! Bodies are the set's segments, in the model's order, followed by the anchors that its joints hold on to. Several
//! sets with the same connectivity can move side by side, one a lane.

use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rod::{Body, Model, State};

use crate::formulation::Formulation;
use crate::kernel::lane::Real;
use crate::kernel::math::{Quat, Sym3, Vec3};
use crate::system::{Six, System};
use crate::topology::Topology;

/// Position and orientation of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose<T> {
    /// Position x [m].
    pub x: Vec3<T>,
    /// Orientation q.
    pub q: Quat<T>,
}

/// What stays the same of a body.
#[derive(Clone, Copy, Debug)]
struct BodyConstants<T> {
    inverse_mass: T,
    /// Moments of inertia across and about the axis [kg m^2]; 1 where fixed.
    transverse: T,
    axial: T,
    /// 1 where the body moves freely, 0 where it is fixed.
    free: T,
    length: T,
}

/// What stays the same of a joint.
#[derive(Clone, Copy, Debug)]
struct JointConstants<T> {
    rest_darboux: Vec3<T>,
    stretch: T,
    shear: T,
    bend: T,
    twist: T,
}

/// Constant loads on a body.
#[derive(Clone, Copy, Debug)]
struct BodyLoad<T> {
    body: usize,
    offset: T,
    force: Vec3<T>,
    torque: Vec3<T>,
}

/// Which segments and joints of a model form a component, by their indices there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Members {
    /// Segments, ascending.
    pub segments: Vec<usize>,
    /// Joints, ascending.
    pub joints: Vec<usize>,
    /// Anchors, ascending.
    pub anchors: Vec<usize>,
}

/// Largest residuals over a component, in scaled units, a lane each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residuals<T> {
    /// Stretch-shear residual `|C_s + alpha~ lambda_s| / l`.
    pub stretch: T,
    /// Bend-twist residual `|C_b + alpha~ lambda_b| l` [rad].
    pub bend: T,
    /// Momentum residual as the correction it asks for, `|dx| / l` or `|dphi|`; zero where it is not part of the
    /// formulation.
    pub momentum: T,
    /// A sum of all of it, which is not finite if any part is not.
    pub check: T,
}

impl<T: Real> Residuals<T> {
    /// The largest of the three.
    pub fn worst(&self) -> T {
        self.stretch.max(self.bend).max(self.momentum)
    }
}

/// One connected set of segments in motion.
#[derive(Clone, Debug)]
pub struct Component<T> {
    /// The linear system as of the last evaluation.
    pub system: System<T>,
    /// Current poses p^j, one a body.
    pub poses: Vec<Pose<T>>,
    /// Poses p_t at the start of the step.
    pub start: Vec<Pose<T>>,
    /// Predicted poses p*.
    pub predicted: Vec<Pose<T>>,
    /// Velocities (v, w), one a body.
    pub velocities: Vec<Six<T>>,
    /// Multipliers lambda: stretch-shear in world axes [N s^2], bend-twist in the frame of body a [N m^2 s^2].
    pub lambda: Vec<Six<T>>,
    /// The linear solve's result, like `lambda`.
    pub dlambda: Vec<Six<T>>,
    /// Per body: impulses, then corrections.
    scratch: Vec<Six<T>>,
    /// Per body: the correction (dx, dphi) that the momentum residual asks for; empty where it is not used.
    momentum: Vec<Six<T>>,
    bodies: Vec<BodyConstants<T>>,
    joints: Vec<JointConstants<T>>,
    loads: Vec<BodyLoad<T>>,
    segments: usize,
    gravity: Vec3<T>,
    damping: [f64; 2],
    /// Length of the last step [s], a lane each; 0 before the first.
    last_dt: T,
    dt: f64,
}

fn vec3(v: &Vector3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z]
}

fn put<T: Real>(target: &mut Vec3<T>, lane: usize, v: [f64; 3]) {
    for (t, x) in target.0.iter_mut().zip(v) {
        t.set_lane(lane, x);
    }
}

fn pick<T: Real>(v: Vec3<T>, lane: usize) -> Vec3<f64> {
    Vec3(v.0.map(|x| x.lane(lane)))
}

fn pick_six<T: Real>(x: &Six<T>, lane: usize) -> Six<f64> {
    Six { stretch: pick(x.stretch, lane), bend: pick(x.bend, lane) }
}

fn pick_pose<T: Real>(pose: &Pose<T>, lane: usize) -> Pose<f64> {
    Pose { x: pick(pose.x, lane), q: Quat { v: pick(pose.q.v, lane), w: pose.q.w.lane(lane) } }
}

fn copy_pose<T: Real, U: Real>(to: &mut Pose<T>, lane: usize, from: &Pose<U>, from_lane: usize) {
    let from = pick_pose(from, from_lane);
    put(&mut to.x, lane, from.x.0);
    put(&mut to.q.v, lane, from.q.v.0);
    to.q.w.set_lane(lane, from.q.w);
}

fn get<T: Real>(v: Vec3<T>, lane: usize) -> Vector3<f64> {
    Vector3::new(v.0[0].lane(lane), v.0[1].lane(lane), v.0[2].lane(lane))
}

fn get_quat<T: Real>(q: Quat<T>, lane: usize) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::from_parts(q.w.lane(lane), get(q.v, lane)))
}

impl<T: Real> BodyConstants<T> {
    fn pick(&self, lane: usize) -> BodyConstants<f64> {
        BodyConstants {
            inverse_mass: self.inverse_mass.lane(lane),
            transverse: self.transverse.lane(lane),
            axial: self.axial.lane(lane),
            free: self.free.lane(lane),
            length: self.length.lane(lane),
        }
    }
}

impl<T: Real> JointConstants<T> {
    fn pick(&self, lane: usize) -> JointConstants<f64> {
        JointConstants {
            rest_darboux: pick(self.rest_darboux, lane),
            stretch: self.stretch.lane(lane),
            shear: self.shear.lane(lane),
            bend: self.bend.lane(lane),
            twist: self.twist.lane(lane),
        }
    }
}

impl<T: Real> BodyLoad<T> {
    fn pick(&self, lane: usize) -> BodyLoad<f64> {
        BodyLoad {
            body: self.body,
            offset: self.offset.lane(lane),
            force: pick(self.force, lane),
            torque: pick(self.torque, lane),
        }
    }
}

impl<T: Real> Component<T> {
    /// Sets that share `topology`, one a lane; the first also fills the lanes left over.
    pub fn new(model: &Model, state: &State, topology: Arc<Topology>, lanes: &[&Members]) -> Self {
        let system = System::new(topology);
        let (bodies, joints) = (system.bodies.len(), system.joints.len());
        let pose = Pose { x: Vec3::zero(), q: Quat::identity() };
        let zero = T::zero();
        let body = BodyConstants {
            inverse_mass: zero,
            transverse: T::splat(1.0),
            axial: T::splat(1.0),
            free: zero,
            length: T::splat(1.0),
        };
        let joint = JointConstants { rest_darboux: Vec3::zero(), stretch: zero, shear: zero, bend: zero, twist: zero };
        let mut component = Self {
            system,
            poses: vec![pose; bodies],
            start: vec![pose; bodies],
            predicted: vec![pose; bodies],
            velocities: vec![Six::zero(); bodies],
            lambda: vec![Six::zero(); joints],
            dlambda: vec![Six::zero(); joints],
            scratch: vec![Six::zero(); bodies],
            momentum: Vec::new(),
            bodies: vec![body; bodies],
            joints: vec![joint; joints],
            loads: Vec::new(),
            segments: lanes.first().map_or(0, |members| members.segments.len()),
            gravity: Vec3(vec3(&model.gravity).map(T::splat)),
            damping: [model.damping.linear, model.damping.angular],
            last_dt: zero,
            dt: 0.0,
        };
        for lane in 0..T::LANES {
            if let Some(members) = lanes.get(lane).or(lanes.first()) {
                component.fill_lane(model, members, lane);
                component.set_state(state, members, lane);
            }
        }
        component.add_loads(model, lanes);
        component
    }

    fn fill_lane(&mut self, model: &Model, members: &Members, lane: usize) {
        for (body, &index) in self.bodies.iter_mut().zip(&members.segments) {
            let segment = &model.segments[index];
            body.length.set_lane(lane, segment.length);
            if !segment.fixed {
                body.inverse_mass.set_lane(lane, 1.0 / segment.mass());
                body.transverse.set_lane(lane, segment.transverse_inertia());
                body.axial.set_lane(lane, segment.axial_inertia());
                body.free.set_lane(lane, 1.0);
            }
        }
        for (k, &index) in members.joints.iter().enumerate() {
            let joint = &model.joints[index];
            let constants = &mut self.joints[k];
            put(&mut constants.rest_darboux, lane, vec3(&joint.rest_darboux));
            constants.stretch.set_lane(lane, joint.stretch_compliance);
            constants.shear.set_lane(lane, joint.shear_compliance);
            constants.bend.set_lane(lane, joint.bend_compliance);
            constants.twist.set_lane(lane, joint.twist_compliance);
            let terms = &mut self.system.joints[k];
            terms.offsets[0].set_lane(lane, joint.offset_a);
            terms.offsets[1].set_lane(lane, joint.offset_b);
            terms.length.set_lane(lane, joint.length);
        }
        for (pose, &index) in self.poses[members.segments.len()..].iter_mut().zip(&members.anchors) {
            let anchor = &model.anchors[index];
            put(&mut pose.x, lane, vec3(&anchor.position));
            put(&mut pose.q.v, lane, vec3(&anchor.orientation.imag()));
            pose.q.w.set_lane(lane, anchor.orientation.w);
        }
    }

    fn add_loads(&mut self, model: &Model, lanes: &[&Members]) {
        for load in &model.loads {
            for (lane, members) in lanes.iter().enumerate() {
                let Ok(body) = members.segments.binary_search(&load.segment) else { continue };
                let zero = Vec3::zero();
                let mut own = BodyLoad { body, offset: T::zero(), force: zero, torque: zero };
                own.offset.set_lane(lane, load.offset);
                put(&mut own.force, lane, vec3(&load.force));
                put(&mut own.torque, lane, vec3(&load.torque));
                self.loads.push(own);
            }
        }
    }

    /// Number of segments (bodies without the anchors).
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// Number of loads.
    pub fn load_count(&self) -> usize {
        self.loads.len()
    }

    /// Whether velocities are damped.
    pub fn is_damped(&self) -> bool {
        self.damping != [0.0; 2]
    }

    /// Time step of the step under way [s].
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Copies one lane's poses and velocities from `state`.
    pub fn set_state(&mut self, state: &State, members: &Members, lane: usize) {
        for (k, &index) in members.segments.iter().enumerate() {
            let pose = &mut self.poses[k];
            put(&mut pose.x, lane, vec3(&state.positions[index]));
            put(&mut pose.q.v, lane, vec3(&state.orientations[index].imag()));
            pose.q.w.set_lane(lane, state.orientations[index].w);
            put(&mut self.velocities[k].stretch, lane, vec3(&state.velocities[index]));
            put(&mut self.velocities[k].bend, lane, vec3(&state.angular_velocities[index]));
        }
    }

    /// Copies one lane's poses and velocities to `state`.
    pub fn store_state(&self, state: &mut State, members: &Members, lane: usize) {
        for (k, &index) in members.segments.iter().enumerate() {
            state.positions[index] = get(self.poses[k].x, lane);
            state.orientations[index] = get_quat(self.poses[k].q, lane);
            state.velocities[index] = get(self.velocities[k].stretch, lane);
            state.angular_velocities[index] = get(self.velocities[k].bend, lane);
        }
    }

    /// Lines 1 to 5 of Algorithm 1: symplectic Euler for velocities and poses, and lambda = 0.
    ///
    /// The rotation is the discrete free motion of a symmetric top (the gyroscopic term included): with the relative
    /// rotation (s, u) of a step in the body's frame, `s I u + u x I u = (dt / 2) m`, where m is the body's angular
    /// momentum, `(2 / dt)(s I u - u x I u)` of the step before. It keeps the angular momentum to rounding and gives
    /// back `w = 2 Im(q' conj(q)) / dt` (Moser and Veselov 1991).
    #[inline(always)]
    pub fn predict(&mut self, dt: f64, formulation: Formulation) {
        let h = T::splat(dt);
        let half = T::splat(0.5 * dt);
        let last_half = self.last_dt * T::splat(0.5);
        let decay = self.damping.map(|rate| T::splat(if rate > 0.0 { (-rate * dt).exp() } else { 1.0 }));
        let one = T::splat(1.0);
        self.dt = dt;
        if !self.loads.is_empty() {
            self.scratch.fill(Six::zero());
            let implicit = formulation.momentum();
            for load in &self.loads {
                let target = &mut self.scratch[load.body];
                target.stretch += load.force;
                target.bend += load.torque;
                if !implicit {
                    target.bend += self.poses[load.body].q.axis().cross(load.force) * load.offset;
                }
            }
        }
        for i in 0..self.segments {
            let constants = &self.bodies[i];
            let pose = self.poses[i];
            self.start[i] = pose;
            let old = self.velocities[i];
            let free = constants.free;
            let kept = [one + (decay[0] - one) * free, one + (decay[1] - one) * free];
            let mut v = old.stretch * kept[0] + self.gravity * (h * free);
            let w = pose.q.rotate_back(old.bend);
            let mut m = angular_momentum(constants, w, last_half);
            m = m * kept[1];
            if !self.loads.is_empty() {
                let load = self.scratch[i];
                v += load.stretch * (h * constants.inverse_mass);
                m += pose.q.rotate_back(load.bend) * (h * free);
            }
            let turn = free_turn(constants, m, w, half);
            self.predicted[i] = Pose { x: pose.x + v * h, q: (pose.q * turn).normalized() };
        }
        for i in self.segments..self.poses.len() {
            self.predicted[i] = self.poses[i];
            self.start[i] = self.poses[i];
        }
        self.poses.copy_from_slice(&self.predicted);
        self.lambda.fill(Six::zero());
        self.set_compliances(dt);
    }

    fn set_compliances(&mut self, dt: f64) {
        let k = T::splat(1.0 / (dt * dt));
        for (terms, joint) in self.system.joints.iter_mut().zip(&self.joints) {
            terms.shear = joint.shear * k;
            terms.stretch_extra = (joint.stretch - joint.shear) * k;
            terms.bend = joint.bend * k;
            terms.twist_extra = (joint.twist - joint.bend) * k;
        }
    }

    /// Evaluates constraints, residuals, Jacobians and mass matrices at the current poses and multipliers: the linear
    /// system of this outer iteration (line 9 of Algorithm 1, its left half).
    #[inline(always)]
    pub fn evaluate(&mut self, formulation: Formulation) -> Residuals<T> {
        self.evaluate_bodies(formulation);
        let mut residuals = self.evaluate_joints();
        if formulation.momentum() {
            self.evaluate_momentum(&mut residuals);
        }
        residuals
    }

    #[inline(always)]
    fn evaluate_bodies(&mut self, formulation: Formulation) {
        let geometric = formulation.geometric();
        if geometric {
            self.gather_levers();
        }
        for (i, terms) in self.system.bodies.iter_mut().enumerate() {
            let constants = &self.bodies[i];
            let q = self.poses[i].q;
            let axis = q.axis();
            terms.orientation = q;
            terms.axis = axis;
            terms.inverse_mass = constants.inverse_mass;
            terms.inverse_inertia = if geometric {
                let inertia = Sym3::identity(constants.transverse)
                    + Sym3::outer(axis, constants.axial - constants.transverse)
                    + geometric_stiffness(self.scratch[i].stretch, axis);
                inertia.inverse() * constants.free
            } else {
                let (across, along) = (constants.free / constants.transverse, constants.free / constants.axial);
                Sym3::identity(across) + Sym3::outer(axis, along - across)
            };
        }
    }

    /// Sums `z lambda_s` (and dt^2 z F of the loads) per body, the force by which its axis is pulled.
    #[inline(always)]
    fn gather_levers(&mut self) {
        self.scratch.fill(Six::zero());
        for ((&[a, b], terms), lambda) in self.system.topology.joints.iter().zip(&self.system.joints).zip(&self.lambda)
        {
            self.scratch[a as usize].stretch += lambda.stretch * terms.offsets[0];
            self.scratch[b as usize].stretch -= lambda.stretch * terms.offsets[1];
        }
        let dt2 = T::splat(self.dt * self.dt);
        for load in &self.loads {
            self.scratch[load.body].stretch += load.force * (load.offset * dt2);
        }
    }

    #[inline(always)]
    fn evaluate_joints(&mut self) -> Residuals<T> {
        let zero = T::zero();
        let mut worst = Residuals { stretch: zero, bend: zero, momentum: zero, check: zero };
        for (k, terms) in self.system.joints.iter_mut().enumerate() {
            let [a, b] = self.system.topology.joints[k].map(|body| body as usize);
            let (first, second) = (&self.poses[a], &self.poses[b]);
            let (axis_a, axis_b) = (self.system.bodies[a].axis, self.system.bodies[b].axis);
            let constants = &self.joints[k];
            let lambda = self.lambda[k];
            let gap = first.x - second.x + axis_a * terms.offsets[0] - axis_b * terms.offsets[1];
            let relative = (first.q.conj() * second.q).upper();
            // Away from a half turn, where G loses a direction; the residual stays exact.
            terms.s = relative.w.max(T::splat(1e-6));
            terms.t = first.q.rotate(relative.v);
            let strain = relative.v * (T::splat(2.0) / terms.length) - constants.rest_darboux;
            let stretch =
                gap + lambda.stretch * terms.shear + axis_a * (terms.stretch_extra * axis_a.dot(lambda.stretch));
            let mut bend = strain + lambda.bend * terms.bend;
            bend.0[2] += lambda.bend.0[2] * terms.twist_extra;
            terms.rhs = Six { stretch: -stretch, bend: -bend };
            let inverse_length = T::splat(1.0) / terms.length;
            let stretch = stretch.norm_squared() * (inverse_length * inverse_length);
            let bend = bend.norm_squared() * (terms.length * terms.length);
            worst.stretch = worst.stretch.max(stretch);
            worst.bend = worst.bend.max(bend);
            worst.check += stretch + bend;
        }
        worst.stretch = worst.stretch.sqrt();
        worst.bend = worst.bend.sqrt();
        worst
    }

    /// Adds the momentum residual `g = M (p - p*) - J^T lambda` to the system: `b += J M^-1 g`.
    #[inline(always)]
    fn evaluate_momentum(&mut self, worst: &mut Residuals<T>) {
        let Self { system, scratch, momentum, lambda, .. } = self;
        momentum.resize(scratch.len(), Six::zero());
        scratch.fill(Six::zero());
        for (j, &lambda) in lambda.iter().enumerate() {
            let q_a = system.bodies[system.topology.joints[j][0] as usize].orientation;
            system.add_impulse(j, system.joints[j].multipliers_to_world(lambda, q_a), scratch);
        }
        let dt2 = T::splat(self.dt * self.dt);
        for load in &self.loads {
            scratch[load.body].bend += system.bodies[load.body].axis.cross(load.force) * (load.offset * dt2);
        }
        let two = T::splat(2.0);
        let mut largest = T::zero();
        for i in 0..self.segments {
            let (constants, pose, predicted) = (&self.bodies[i], &self.poses[i], &self.predicted[i]);
            let axis = system.bodies[i].axis;
            let phi = (pose.q * predicted.q.conj()).upper().v * two;
            let turning =
                phi * constants.transverse + axis * (axis.dot(phi) * (constants.axial - constants.transverse));
            // In these units the translation's part of M^-1 g needs no division by the mass.
            let dx = (predicted.x - pose.x) * constants.free + scratch[i].stretch * constants.inverse_mass;
            let dphi = system.bodies[i].inverse_inertia.apply(scratch[i].bend - turning);
            momentum[i] = Six { stretch: dx, bend: dphi };
            let size = dx.norm_squared() / (constants.length * constants.length);
            let turn = dphi.norm_squared();
            largest = largest.max(size).max(turn);
            worst.check += size + turn;
        }
        worst.momentum = largest.sqrt();
        for j in 0..system.joints.len() {
            let q_a = system.bodies[system.topology.joints[j][0] as usize].orientation;
            let terms = &system.joints[j];
            let change = terms.from_world(system.constraint_change(j, momentum), q_a);
            system.joints[j].rhs = terms.rhs.plus(change, T::splat(-1.0));
        }
    }

    /// Lines 10 and 11 of Algorithm 1: `lambda += dlambda`, `p += dp` with `dp = M^-1 (J^T dlambda - g)`, in the lanes
    /// where `active` >= 0.
    #[inline(always)]
    pub fn update(&mut self, formulation: Formulation, active: T) {
        let Self { system, scratch, dlambda, lambda, .. } = self;
        scratch.fill(Six::zero());
        for (j, &dlambda) in dlambda.iter().enumerate() {
            let q_a = system.bodies[system.topology.joints[j][0] as usize].orientation;
            lambda[j] = select(active, lambda[j].plus(dlambda, T::splat(1.0)), lambda[j]);
            system.add_impulse(j, system.joints[j].multipliers_to_world(dlambda, q_a), scratch);
        }
        for i in 0..self.segments {
            let mut correction = system.correction(i, scratch[i]);
            if formulation.momentum() {
                correction = correction.plus(self.momentum[i], T::splat(1.0));
            }
            let old = self.poses[i];
            let turned = old.q.turned(correction.bend);
            let moved = Six { stretch: old.x + correction.stretch, bend: turned.v };
            let kept = select(active, moved, Six { stretch: old.x, bend: old.q.v });
            self.poses[i] = Pose { x: kept.stretch, q: Quat { v: kept.bend, w: active.select(turned.w, old.q.w) } };
        }
    }

    /// Lines 16 to 19 of Algorithm 1: velocities from the poses, `v = (x' - x) / dt`, `w = 2 Im(q' conj(q)) / dt`.
    #[inline(always)]
    pub fn update_velocities(&mut self) {
        let rate = T::splat(1.0 / self.dt);
        let twice = T::splat(2.0 / self.dt);
        for i in 0..self.segments {
            let (pose, start) = (&self.poses[i], &self.start[i]);
            let turn = (pose.q * start.q.conj()).upper();
            self.velocities[i] = Six { stretch: (pose.x - start.x) * rate, bend: turn.v * twice };
        }
        self.last_dt = T::splat(self.dt);
    }

    /// Takes the step under way back.
    pub fn roll_back(&mut self) {
        self.poses.copy_from_slice(&self.start);
    }

    /// Takes the step under way back in one lane.
    pub fn roll_back_lane(&mut self, lane: usize) {
        for (pose, start) in self.poses.iter_mut().zip(&self.start) {
            copy_pose(pose, lane, start, lane);
        }
    }

    /// One lane as a component of its own.
    pub fn extract_lane(&self, lane: usize) -> Component<f64> {
        let mut out = Component {
            system: System::new(self.system.topology.clone()),
            poses: self.poses.iter().map(|pose| pick_pose(pose, lane)).collect(),
            start: self.start.iter().map(|pose| pick_pose(pose, lane)).collect(),
            predicted: self.predicted.iter().map(|pose| pick_pose(pose, lane)).collect(),
            velocities: self.velocities.iter().map(|v| pick_six(v, lane)).collect(),
            lambda: vec![Six::zero(); self.lambda.len()],
            dlambda: vec![Six::zero(); self.lambda.len()],
            scratch: vec![Six::zero(); self.scratch.len()],
            momentum: Vec::new(),
            bodies: self.bodies.iter().map(|body| body.pick(lane)).collect(),
            joints: self.joints.iter().map(|joint| joint.pick(lane)).collect(),
            loads: self.loads.iter().map(|load| load.pick(lane)).collect(),
            segments: self.segments,
            gravity: pick(self.gravity, lane),
            damping: self.damping,
            last_dt: self.last_dt.lane(lane),
            dt: self.dt,
        };
        for (terms, own) in out.system.joints.iter_mut().zip(&self.system.joints) {
            terms.offsets = own.offsets.map(|z| z.lane(lane));
            terms.length = own.length.lane(lane);
        }
        out
    }

    /// Puts poses and velocities of a component of its own back into its lane.
    pub fn insert_lane(&mut self, lane: usize, from: &Component<f64>) {
        for (pose, own) in self.poses.iter_mut().zip(&from.poses) {
            copy_pose(pose, lane, own, 0);
        }
        for (velocity, own) in self.velocities.iter_mut().zip(&from.velocities) {
            put(&mut velocity.stretch, lane, own.stretch.0);
            put(&mut velocity.bend, lane, own.bend.0);
        }
        self.last_dt.set_lane(lane, from.last_dt);
    }
}

/// `then` in the lanes where `condition` >= 0, else `otherwise`.
#[inline(always)]
fn select<T: Real>(condition: T, then: Six<T>, otherwise: Six<T>) -> Six<T> {
    let (a, b) = (then.to_array(), otherwise.to_array());
    let mut out = b;
    for k in 0..6 {
        out[k] = condition.select(a[k], b[k]);
    }
    Six::from_array(out)
}

/// K+, the geometric stiffness of a pull `f` [N m s^2] on a body's axis d, without its negative part.
///
/// `K = (f.d) I - sym(f d^T)` has the eigenvalues `|f| (cos, (cos + 1) / 2, (cos - 1) / 2)` with cos the cosine of the
/// angle between f and d; the last belongs to f/|f| + d, the second to f/|f| - d.
#[inline(always)]
fn geometric_stiffness<T: Real>(f: Vec3<T>, axis: Vec3<T>) -> Sym3<T> {
    let (zero, one) = (T::zero(), T::splat(1.0));
    let along = f.dot(axis);
    let size = f.norm_squared().sqrt();
    let unit = f * (one / size.max(T::splat(f64::MIN_POSITIVE)));
    let sign = along.select(one, -one);
    let pulled = along.select(one, zero);
    let cosine = unit.dot(axis) * sign;
    let bisector = unit + axis * sign;
    let rest = (size - along.abs()).max(zero) / (T::splat(4.0) * (one + cosine));
    Sym3::identity(along * pulled) + Sym3::sym_outer(f * pulled, -axis) + Sym3::outer(bisector, rest)
}

/// Angular momentum in the body's frame at the end of a step that turned with `w` (body frame): see
/// [`Component::predict`].
#[inline(always)]
fn angular_momentum<T: Real>(body: &BodyConstants<T>, w: Vec3<T>, half_dt: T) -> Vec3<T> {
    let one = T::splat(1.0);
    let u = w * half_dt;
    let s = (one - u.norm_squared()).max(T::zero()).sqrt();
    let [x, y, z] = w.0;
    let m = Vec3([x * body.transverse, y * body.transverse, z * body.axial]);
    m * s - u.cross(m)
}

/// Relative rotation, in the body's frame, of the free motion with angular momentum `m`; where there is none (more than
/// about a half turn a step) the rotation goes on with `w`. See [`Component::predict`].
#[inline(always)]
fn free_turn<T: Real>(body: &BodyConstants<T>, m: Vec3<T>, w: Vec3<T>, half_dt: T) -> Quat<T> {
    let one = T::splat(1.0);
    let [hx, hy, hz] = (m * half_dt).0;
    let difference = body.axial - body.transverse;
    // With y = s^2 and u_z = h_z / (s I_a): y + a / y + b / (c y + d / y) = 1.
    let uz = hz / body.axial;
    let (a, b, c) = (uz * uz, hx * hx + hy * hy, body.transverse * body.transverse);
    let d = difference * difference * a;
    let mut y = one;
    for _ in 0..4 {
        let inverse = one / y;
        let across = one / (c * y + d * inverse);
        let value = y + a * inverse + b * across - one;
        let slope = one - a * inverse * inverse - b * (c - d * inverse * inverse) * across * across;
        y = (y - value / slope).max(T::splat(0.01));
    }
    let s = y.sqrt();
    let z = uz / s;
    // s I_t u_x + (I_a - I_t) u_y u_z = h_x, s I_t u_y - (I_a - I_t) u_x u_z = h_y.
    let (p, r) = (s * body.transverse, difference * z);
    let inverse = one / (p * p + r * r);
    let top = Quat { v: Vec3([(p * hx - r * hy) * inverse, (p * hy + r * hx) * inverse, z]), w: s };
    let defect = (top.v.norm_squared() + s * s - one).abs();
    let solved = T::splat(1e-9) - defect;
    let u = w * half_dt;
    let scalar = (one - u.norm_squared()).max(T::zero()).sqrt();
    let plain = Quat { v: u, w: scalar };
    let pick = |x: T, y: T| solved.select(x, y);
    let v = Vec3([pick(top.v.0[0], plain.v.0[0]), pick(top.v.0[1], plain.v.0[1]), pick(top.v.0[2], plain.v.0[2])]);
    Quat { v, w: pick(s, plain.w) }
}

/// Splits a model into connected sets and gives each its connectivity.
pub fn split(model: &Model) -> Vec<(Members, Topology)> {
    let count = model.segments.len();
    let mut leader: Vec<usize> = (0..count).collect();
    fn find(leader: &mut [usize], mut i: usize) -> usize {
        while leader[i] != i {
            leader[i] = leader[leader[i]];
            i = leader[i];
        }
        i
    }
    for joint in &model.joints {
        if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b) {
            let (a, b) = (find(&mut leader, a), find(&mut leader, b));
            leader[a.max(b)] = a.min(b);
        }
    }
    let mut set_of = vec![usize::MAX; count];
    let mut local = vec![0_u32; count];
    let mut sets: Vec<Members> = Vec::new();
    for i in 0..count {
        let first = find(&mut leader, i);
        if first == i {
            set_of[i] = sets.len();
            sets.push(Members::default());
        }
        set_of[i] = set_of[first];
        local[i] = sets[set_of[i]].segments.len() as u32;
        sets[set_of[i]].segments.push(i);
    }
    for (k, joint) in model.joints.iter().enumerate() {
        let ((Body::Segment(segment), _) | (_, Body::Segment(segment))) = (joint.a, joint.b) else { continue };
        let set = &mut sets[set_of[segment]];
        set.joints.push(k);
        for body in [joint.a, joint.b] {
            if let Body::Anchor(anchor) = body {
                set.anchors.push(anchor);
            }
        }
    }
    sets.into_iter()
        .map(|mut set| {
            set.anchors.sort_unstable();
            set.anchors.dedup();
            let body = |body: Body| match body {
                Body::Segment(i) => local[i],
                Body::Anchor(i) => (set.segments.len() + set.anchors.partition_point(|&a| a < i)) as u32,
            };
            let ends = set.joints.iter().map(|&k| [body(model.joints[k].a), body(model.joints[k].b)]).collect();
            let fixed = set.segments.iter().map(|&i| model.segments[i].fixed);
            let fixed = fixed.chain(set.anchors.iter().map(|_| true)).collect();
            let topology = Topology::new(ends, fixed);
            (set, topology)
        })
        .collect()
}
