//! What a step shows of a run.

use cosserat::assembly::{Load, ObstacleShape};
use cosserat::simulation::{ContactForce, Formulation, Integrator, Status, StepParams};
use cosserat::state::{Body, Joint, JointForce, Model, Pose, Sliding, State};
use nalgebra::{UnitQuaternion, Vector3};

use crate::case::Method;
use crate::exclusion::Excluded;
use crate::law::{Law, Violation};

/// The largest turn of a segment in a step for which expansions to second order hold [rad].
pub(crate) const MOST_TURN: f64 = 0.5;

/// What one sees at the end of a step.
pub(crate) struct Step<'a> {
    /// Its number, from 1.
    pub(crate) number: usize,
    /// The model as it is at the end of the step.
    pub(crate) model: &'a Model,
    /// The model as the step began, with what holds since then held.
    pub(crate) model_before: &'a Model,
    /// Before the step and after it.
    pub(crate) states: [&'a State; 2],
    /// A step earlier, where that step and this one were both solved as a whole and held the same.
    pub(crate) earlier: Option<&'a State>,
    /// What joints transmit at both ends.
    pub(crate) forces: [&'a [JointForce]; 2],
    pub(crate) contacts: &'a [ContactForce],
    /// Where eyelets are and what they do, one a sliding joint of the model.
    pub(crate) sliding: &'a [Sliding],
    /// Time at its end [s] and its length [s].
    pub(crate) time: f64,
    pub(crate) dt: f64,
    pub(crate) status: Status,
    pub(crate) method: &'a Method,
    pub(crate) excluded: &'a Excluded,
}

impl Step<'_> {
    /// Whether its equations were solved.
    pub(crate) fn is_solved(&self) -> bool {
        self.status.is_solved()
    }

    /// Whether it was solved as one step, whose forces are those at its end.
    pub(crate) fn is_whole(&self) -> bool {
        self.status == Status::Converged
    }

    /// Residual of joints that counts as solved: in segment lengths and radians. A prediction that is less far off asks for less.
    pub(crate) fn tolerance(&self) -> f64 {
        let StepParams { relative_tolerance, contact_tolerance, contact, .. } = self.method.settings().step;
        let of_contacts =
            if self.model.contacts.is_empty() { 0.0 } else { contact.joint_tolerance * contact_tolerance };
        of_contacts.max(relative_tolerance)
    }

    /// How far the surface of a segment may be from where it would end in formulation `newton` [m].
    pub(crate) fn way(&self, i: usize) -> f64 {
        let (segment, touch) = (&self.model.segments[i], !self.model.contacts.is_empty());
        self.method.settings().step.allowed_motion(touch) * if touch { segment.radius } else { segment.length }
    }

    /// By what part a load that follows its segment may be another in formulation `newton`, as surfaces may still move: the rod may spin on by that way.
    pub(crate) fn followed(&self, load: &Load) -> f64 {
        if load.follows && self.is_newton() {
            self.way(load.segment) / self.model.segments[load.segment].radius
        } else {
            0.0
        }
    }

    pub(crate) fn is_euler(&self) -> bool {
        self.method.integrator == Integrator::Euler
    }

    pub(crate) fn is_newton(&self) -> bool {
        self.method.formulation == Formulation::Newton
    }

    /// Force [N] and torque [N m] of a load in the step, in world axes: `xpbd` takes one that follows as it is when the step begins.
    pub(crate) fn load(&self, load: &Load) -> [Vector3<f64>; 2] {
        let [before, after] = self.states;
        let axes = if self.is_newton() { after } else { before };
        load.in_world(&axes.orientations[load.segment])
    }

    /// Whether a segment moves freely.
    pub(crate) fn is_free(&self, i: usize) -> bool {
        !self.model.segments[i].fixed
    }

    /// Joints that transmit something, and what.
    pub(crate) fn joints(&self) -> impl Iterator<Item = (usize, &Joint, &JointForce)> {
        let joints = self.model.joints.iter().zip(self.forces[1]).enumerate();
        joints.map(|(k, (joint, force))| (k, joint, force)).filter(|(_, joint, _)| !self.model.is_open(joint))
    }

    /// Force and moment of a joint on its body a (`end` 0) or b (1) in world axes [N, N m], and the arm from the body's
    /// place to where the force acts [m]. At the end of the step.
    pub(crate) fn pull(&self, joint: &Joint, force: &JointForce, end: usize) -> [Vector3<f64>; 3] {
        let a = self.model.pose(joint.a, self.states[1]).orientation;
        let moment = a * force.moment;
        if end == 0 {
            [force.force, moment, joint.arm_a(&a)]
        } else {
            [-force.force, -moment, joint.arm_b(&self.model.pose(joint.b, self.states[1]).orientation)]
        }
    }

    /// Whether a joint's body is a segment that moves freely, and which.
    pub(crate) fn free_end(&self, body: Body) -> Option<usize> {
        match body {
            Body::Segment(i) if self.is_free(i) => Some(i),
            _ => None,
        }
    }

    /// Poses of a body before and after the step.
    pub(crate) fn poses(&self, body: Body) -> [Pose; 2] {
        [self.model_before.pose(body, self.states[0]), self.model.pose(body, self.states[1])]
    }

    /// The largest angle between where a segment is at the start of the step, at its end, and where its spin alone takes it, with
    /// which iterations begin [rad].
    pub(crate) fn turn(&self, i: usize) -> f64 {
        let [start, end] = self.states.map(|state| state.orientations[i]);
        let spun = UnitQuaternion::from_scaled_axis(self.states[0].angular_velocities[i] * self.dt) * start;
        start.angle_to(&end).max(start.angle_to(&spun)).max(spun.angle_to(&end))
    }

    /// Whether an obstacle is a plane.
    pub(crate) fn is_plane(&self, k: usize) -> bool {
        matches!(self.model.contacts.obstacles[k].shape, ObstacleShape::HalfSpace { .. })
    }

    /// Angle by which an obstacle turns in the step [rad].
    pub(crate) fn obstacle_turn(&self, k: usize) -> f64 {
        let [from, to] = [self.time - self.dt, self.time].map(|time| self.model.contacts.obstacles[k].at(time).pose);
        from.orientation.angle_to(&to.orientation)
    }

    /// Half the length of a segment and its radius, together [m].
    pub(crate) fn reach(&self, i: usize) -> f64 {
        let segment = &self.model.segments[i];
        0.5 * segment.length + segment.radius
    }

    /// Notes what was found where it is more than allowed.
    pub(crate) fn hold(
        &self,
        violations: &mut Vec<Violation>,
        law: Law,
        found: f64,
        allowed: f64,
        message: impl FnOnce() -> String,
    ) {
        if found.is_nan() || found > allowed {
            let ratio = if allowed > 0.0 { found / allowed } else { f64::INFINITY };
            violations.push(Violation { law, step: self.number, ratio, message: message() });
        }
    }
}
