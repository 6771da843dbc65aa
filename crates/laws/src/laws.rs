//! The laws, and what a step shows of a run.

mod contact;
mod energy;
mod finite;
mod momentum;
mod passing;
mod solved;

use nalgebra::Vector3;
use names::names;
use rod::{Body, Joint, JointForce, Model, Pose, State};
use solver::formulation::Formulation;
use solver::integrator::Integrator;
use solver::simulation::ContactForce;
use solver::step::{Status, StepParams};

use crate::case::Way;

pub(crate) use energy::Ledger;
pub(crate) use passing::Excluded;

#[cfg(test)]
mod tests;

/// What must hold in every run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Law {
    /// Nothing panics.
    Panic,
    /// All numbers are finite.
    Finite,
    /// Linear momentum changes by the impulses of gravity, loads, grips and contacts.
    LinearMomentum,
    /// Angular momentum changes likewise.
    AngularMomentum,
    /// Energy grows by no more than the work that is done.
    Energy,
    /// Contacts push, and friction stays in its cone.
    Cone,
    /// Friction takes energy.
    Friction,
    /// No axis passes through another one, or into an obstacle.
    Passing,
    /// Where the status says that a step is solved, nothing is deeper in another than its tolerance.
    Depth,
    /// Where the status says that a step is solved, joints are as far from their constraints as its tolerance says.
    Residual,
    /// Joints that gape show in the status.
    Open,
    /// A run that goes on from a snapshot has the same bits.
    Snapshot,
    /// One and two threads give the same bits.
    Threads,
}

names!(Law {
    Panic = "panic",
    Finite = "finite",
    LinearMomentum = "linear-momentum",
    AngularMomentum = "angular-momentum",
    Energy = "energy",
    Cone = "cone",
    Friction = "friction",
    Passing = "passing",
    Depth = "depth",
    Residual = "residual",
    Open = "open",
    Snapshot = "snapshot",
    Threads = "threads",
});

/// A law that does not hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Broken {
    /// Which.
    pub law: Law,
    /// In which step, from 1; 0 where it is none.
    pub step: usize,
    /// What was found over what is allowed; infinite where nothing is.
    pub size: f64,
    /// What was found, with numbers and units.
    pub words: String,
}

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
    /// Time at its end [s] and its length [s].
    pub(crate) time: f64,
    pub(crate) dt: f64,
    pub(crate) status: Status,
    pub(crate) way: &'a Way,
    pub(crate) excluded: &'a Excluded,
}

impl Step<'_> {
    /// Whether it was solved.
    pub(crate) fn is_solved(&self) -> bool {
        matches!(self.status, Status::Converged | Status::ConvergedInSubsteps)
    }

    /// Whether it was solved as one step, whose forces are those at its end.
    pub(crate) fn is_whole(&self) -> bool {
        self.status == Status::Converged
    }

    /// Residual of joints that counts as solved: in segment lengths and radians. A prediction that is less far off asks for less.
    pub(crate) fn tolerance(&self) -> f64 {
        let StepParams { relative_tolerance, contact_tolerance, contact, .. } = StepParams::DEFAULT;
        let of_contacts = if self.model.contacts.is_empty() { 0.0 } else { contact.rods_share * contact_tolerance };
        of_contacts.max(relative_tolerance)
    }

    pub(crate) fn is_euler(&self) -> bool {
        self.way.integrator == Integrator::Euler
    }

    pub(crate) fn is_newton(&self) -> bool {
        self.way.formulation == Formulation::Newton
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

    /// Angle by which a segment turns in the step, in both senses of its velocities [rad].
    pub(crate) fn turn(&self, i: usize) -> f64 {
        let angle = self.states[0].orientations[i].angle_to(&self.states[1].orientations[i]);
        let given = self.states[0].angular_velocities[i].norm() * self.dt;
        angle.max(given.min(1.0))
    }

    /// Half the length of a segment and its radius, together [m].
    pub(crate) fn reach(&self, i: usize) -> f64 {
        let segment = &self.model.segments[i];
        0.5 * segment.length + segment.radius
    }

    /// All laws of a step but energy's.
    pub(crate) fn laws(&self, broken: &mut Vec<Broken>) {
        if !finite::finite(self, broken) {
            return;
        }
        momentum::linear(self, broken);
        momentum::angular(self, broken);
        contact::forces(self, broken);
        contact::depth(self, broken);
        passing::passing(self, broken);
        solved::residual(self, broken);
        solved::open(self, broken);
    }

    /// Notes what was found where it is more than allowed.
    pub(crate) fn hold(
        &self,
        broken: &mut Vec<Broken>,
        law: Law,
        found: f64,
        allowed: f64,
        words: impl FnOnce() -> String,
    ) {
        if found.is_nan() || found > allowed {
            let size = if allowed > 0.0 { found / allowed } else { f64::INFINITY };
            broken.push(Broken { law, step: self.number, size, words: words() });
        }
    }
}
