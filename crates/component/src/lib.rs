//! One connected set of segments in motion: its state, and the stages of a step on it: prediction, evaluation of constraints and
//! residuals, update, velocities (paper, Algorithm 1), each with its transpose for derivatives.
//!
//! Bodies are the set's segments, in the model's order, followed by the anchors that its joints hold on to. Several
//! sets with the same connectivity can move side by side, one a lane.
//!
//! - [`Component`]: the state of a set. [`Formulation`]: which equations a step solves. [`variation`]: what they can be
//!   differentiated by.
//! - [`snapshot`]: what of all this the steps to come depend on.
//!
//! It knows one connected set at a time: no contact, no iteration, no step control. It is internal: programs use
//! `cosserat`.

mod adjoint;
mod adjoint_joints;
mod asymmetric_jacobian;
mod before;
mod begin;
mod breaking;
mod buckling;
mod constants;
mod derivative;
mod drag;
mod equilibrium;
mod evaluate;
mod external_impulses;
mod forces;
mod formulation;
mod half_turn;
mod hold;
mod implicit;
mod inelastic;
mod interval;
mod joint_extras;
mod joint_failure;
mod lanes;
#[cfg(test)]
mod linear_tests;
mod measure;
mod motion;
mod multistep;
mod parts;
mod pose;
mod predict;
mod released;
mod rigid;
mod sliding;
pub mod snapshot;
mod split;
mod state;
mod tangent;
mod transmitted;
mod turns;
mod update;
pub mod variation;
mod visit;

use std::sync::Arc;

use jointed::system::System;
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Sym3, Vec3};
use rod::{Model, State, StrainMeasure};

pub use adjoint::{BodyGradient, Ended};
pub use adjoint_joints::add_numbers;
pub use before::{Group, scatter};
pub use begin::{Begin, BodyBar};
pub use derivative::{move_along, movement_along, slope_of};
pub use formulation::Formulation;
pub use hold::Change;
pub use interval::Interval;
pub use jointed::members::Members;
pub use measure::OF_TRANSMITTED;
pub use motion::{LARGEST_TURN, in_kernel};
pub use parts::{copy_spatial, pick_pose, pick_spatial};
pub use pose::BodyPose;
pub use released::has_loose;
pub use sliding::Border;
pub use split::split;
pub use split::{Alike, split_alike, whole};

/// Rods that move side by side in one vector register.
pub const GROUP: usize = 8;

/// Gap of a joint in its lengths, or angle by which it is askew [rad], from which on the joint is apart.
pub const APART: f64 = 0.1;

use constants::{BodyConstants, BodyLoad, JointConstants};

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
    pub poses: Vec<BodyPose<T>>,
    /// Poses p_t at the start of the step.
    pub start: Vec<BodyPose<T>>,
    /// Predicted poses p*.
    pub predicted: Vec<BodyPose<T>>,
    /// Velocities (v, w), one a body. w is `2 Im(q' conj(q)) / dt` of the last step (line 19 of Algorithm 1), of a fixed
    /// segment and where it was given since the true rate [rad/s].
    pub velocities: Vec<Spatial<T>>,
    /// How joints measure what they are bent and twisted by.
    pub strain_measure: StrainMeasure,
    /// Multipliers lambda: stretch-shear in world axes [N s^2], bend-twist in the frame of their rows
    /// [N m^2 s^2].
    pub lambda: Vec<Spatial<T>>,
    /// The linear solve's result, like `lambda`.
    pub dlambda: Vec<Spatial<T>>,
    /// Per body: impulses, then corrections.
    scratch: Vec<Spatial<T>>,
    /// Per body: the correction (dx, dphi) that the momentum residual asks for; empty where it is not used.
    momentum: Vec<Spatial<T>>,
    /// Whether the right-hand sides of the dual system are left without what those corrections ask of joints.
    pub is_apart: bool,
    /// Per body: the force times dt^2 by which its axis is pulled, for the geometric stiffness.
    pulls: Vec<Vec3<T>>,
    /// The pulls as forces at the end of the last step [N m].
    held: Vec<Vec3<T>>,
    /// Per body: impulses times dt of contacts that the next update adds; empty where nothing can be touched.
    pub pushes: Vec<Spatial<T>>,
    /// Per body: those that all updates of this step have added, with the current arms; empty like `pushes`.
    pub pushed: Vec<Spatial<T>>,
    /// Per body: geometric stiffness of the contacts that press, times dt^2 [N m s^2]; empty like `pushes`.
    pub contact_stiffness: Vec<Sym3<T>>,
    /// Largest unit of the measure of error [m], a lane each.
    longest_unit: T,
    /// Largest way of a surface in the last update \[units of the measure\], a lane each; infinite where it is not known.
    pub correction: T,
    /// Linear solves since the start, those of steps that were taken back included.
    pub solves: u64,
    /// Evaluations since the start, likewise.
    pub evaluations: u64,
    /// Not 0 where a segment begins this step with a spin of more than half a turn a step (a right angle where loads alone turn it), or what is driven turns too far, a
    /// lane each.
    pub unsolved: T,
    /// Lanes that hold a set of their own; the others repeat the first.
    pub used: usize,
    /// Per body: >= 0 where w was given since the last step, a lane each.
    given: Vec<T>,
    /// Whether any was.
    has_given: bool,
    /// The fixed segments and anchors that move.
    moved: Vec<motion::Moved>,
    /// Eyelets through which rods of it run.
    eyelets: sliding::Eyelets,
    /// Joints that are not elastic.
    laws: inelastic::Laws,
    /// Joints that can break.
    breakable: Vec<breaking::Breakable>,
    /// Per joint: whether it has broken; empty where none has.
    broken: Vec<bool>,
    /// Joints that leave something free.
    released: Vec<released::Released>,
    /// Whether these are in the order of their joints.
    is_released_in_order: bool,
    /// Inertia of the fixed segments.
    resting: Vec<hold::Resting>,
    /// Whether the pulls are those of the multipliers, or those expected of a step that has none yet.
    pulls_hold: bool,
    bodies: Vec<BodyConstants<T>>,
    joints: Vec<JointConstants<T>>,
    /// What joints have beyond those of the paper.
    extras: joint_extras::JointExtras<T>,
    loads: Vec<BodyLoad<T>>,
    /// Loads and gravity that change over time.
    changing: Vec<forces::Varying>,
    /// Rigid bodies that move freely.
    rigid: Vec<rigid::Rigid<T>>,
    /// The air, if there is any.
    drag: Option<Box<drag::Drag<T>>>,
    /// Whether the loads' torques have yet to enter a linear system of this step.
    torques_wait: bool,
    segments: usize,
    gravity: Vec3<T>,
    damping: [T; 2],
    /// Length of the last step [s], a lane each; 0 before the first.
    last_dt: T,
    /// Lengths of the steps of implicit Euler that the step under way and the last one amount to [s], a lane each.
    effective: T,
    last_effective: T,
    /// What the steps before add, where the integrator asks for them.
    multistep: Option<Box<multistep::Multistep<T>>>,
    /// Start of the step under way and its length [s].
    time: f64,
    dt: f64,
}

impl<T: Real> Component<T> {
    /// Sets that share `topology`, one a lane; the first also fills the lanes left over.
    pub fn new(model: &Model, state: &State, topology: Arc<Topology>, sets: &[&Members]) -> Self {
        let mut system = System::new(topology);
        let extras = joint_extras::JointExtras::new(model, sets);
        extras.prepare(&mut system);
        let laws = sets.first().map(|members| inelastic::Laws::new(model, state, members)).unwrap_or_default();
        laws.prepare(&mut system);
        let (bodies, joints) = (system.bodies.len(), system.joints.len());
        let pose = BodyPose { x: Vec3::zero(), q: Quat::identity() };
        let zero = T::zero();
        let body = BodyConstants {
            inverse_mass: zero,
            transverse: T::splat(1.0),
            axial: T::splat(1.0),
            free: zero,
            length: T::splat(1.0),
            radius: T::splat(1.0),
        };
        let joint = JointConstants {
            rest: Vec3::zero(),
            darboux: Vec3::zero(),
            stretch: zero,
            shear: zero,
            bend: zero,
            twist: zero,
        };
        let mut component = Self {
            system,
            poses: vec![pose; bodies],
            start: vec![pose; bodies],
            predicted: vec![pose; bodies],
            velocities: vec![Spatial::zero(); bodies],
            strain_measure: model.strain_measure,
            lambda: vec![Spatial::zero(); joints],
            dlambda: vec![Spatial::zero(); joints],
            scratch: vec![Spatial::zero(); bodies],
            momentum: Vec::new(),
            is_apart: false,
            pulls: vec![Vec3::zero(); bodies],
            held: vec![Vec3::zero(); bodies],
            pushes: Vec::new(),
            pushed: Vec::new(),
            contact_stiffness: Vec::new(),
            given: vec![T::splat(-1.0); bodies],
            has_given: false,
            moved: Vec::new(),
            eyelets: sliding::Eyelets::default(),
            laws,
            breakable: sets.first().map(|members| breaking::Breakable::all(model, members)).unwrap_or_default(),
            broken: Vec::new(),
            released: Vec::new(),
            is_released_in_order: true,
            resting: Vec::new(),
            longest_unit: T::splat(f64::INFINITY),
            correction: T::splat(f64::INFINITY),
            solves: 0,
            evaluations: 0,
            unsolved: zero,
            used: sets.len().min(T::LANES),
            pulls_hold: false,
            bodies: vec![body; bodies],
            joints: vec![joint; joints],
            extras,
            loads: Vec::new(),
            changing: Vec::new(),
            rigid: Vec::new(),
            drag: model.air.as_ref().map(|air| Box::new(drag::Drag::new(air, model, sets))),
            torques_wait: false,
            segments: sets.first().map_or(0, |members| members.segments.len()),
            gravity: Vec3(parts::vec3(&model.gravity).map(T::splat)),
            damping: [model.damping.linear, model.damping.angular].map(T::splat),
            last_dt: zero,
            effective: zero,
            last_effective: zero,
            multistep: None,
            time: 0.0,
            dt: 0.0,
        };
        for lane in 0..T::LANES {
            if let Some(members) = sets.get(lane).or(sets.first()) {
                component.fill_lane(model, members, lane);
                component.add_rigid(model, members, lane);
                component.set_state(state, members, lane);
                for driven in model.motions.iter().filter(|driven| driven.begins_by(0.0)) {
                    if let Some(body) = members.body(driven.body) {
                        component.drive(lane, body, driven);
                    }
                }
            }
        }
        component.begin_motions();
        component.add_loads(model, sets);
        component.set_forces(0.0);
        component
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
        self.damping != [T::zero(); 2]
    }

    /// Start of the step under way, since the simulation's [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Time step of the step under way [s].
    pub fn dt(&self) -> f64 {
        self.dt
    }
}
