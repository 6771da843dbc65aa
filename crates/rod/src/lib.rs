//! Elastic rods and trees of rods, as data: what a solver needs to know and nothing of how it solves.
//!
//! A [`Model`] holds [`Segment`]s (rigid cylinders, or a [`RigidBody`] each), [`Joint`]s between them (a stretch-shear and a bend-twist constraint
//! each, with compliance), ground anchors, loads, gravity, damping, air, and
//! [`Motion`]s that drive what is held and obstacles. A [`State`] holds what moves. An [`Assembly`]
//! builds both from rods with a centreline, branches and clamps; [`Model::joints_of`] says which joints a rod has.
//!
//! Formulas follow Kugelstadt, Deul and Bender, "Direct Position-Based Solver for Stiff Rods" (2018), which the
//! COPINGNet paper (Shao et al., "Accurately Solving Physical Systems with Graph Learning", ICLR 2021) builds on.
//! Units are SI throughout.
//! This crate knows no solver, no file format and no network. It is internal: programs use `cosserat`.

mod air;
mod append;
mod assembly;
mod body;
mod chain;
mod contact;
mod contact_force;
pub mod darboux;
mod drag;
mod driven;
mod error;
mod freedom;
mod inelastic;
mod integrator;
mod joint;
mod joint_force;
mod material;
pub mod measure;
mod mesh;
mod mode;
mod model;
mod motion;
mod part;
mod pose;
mod probe;
mod pulley;
mod reaction;
mod rigid;
mod section;
pub mod shape;
mod sheath;
mod sliding_joint;
mod solid;
mod state;
mod strength;
mod supports;
mod time;
mod track;
mod validate;
mod wind;

pub use air::Air;
pub use assembly::{Assembly, RestShape, RodSpec};
pub use body::Body;
pub use chain::{Successor, end_of, successors};
pub use contact::{CYLINDER_SIDES, Contacts, Friction, Obstacle, ObstacleShape, Sheath, Surface};
pub use contact_force::{ContactForce, Touched, contact_wrenches};
pub use darboux::StrainMeasure;
pub use driven::{Carried, Driven};
pub use error::{DriveError, ModelError};
pub use freedom::{Freedom, Springs};
pub use inelastic::{
    Answer, InelasticJoint, InternalVariables, JointLaw, MaxwellBranch, MomentTable, Plasticity, StrandFriction,
    Unloading,
};
pub use integrator::Integrator;
pub use joint_force::{JointForce, curvature};
pub use material::{Foundation, InnerDamping, Material, Stretch};
pub use mesh::{Mesh, MeshError};
pub use mode::{Mode, Restoring};
pub use model::{Damping, Joint, Lift, Load, Model, Segment};
pub use motion::{Interpolation, Keyframe, KeyframeError, Motion, MovingPose};
pub use part::Part;
pub use pose::Pose;
pub use probe::{Probe, Quantity, Reading};
pub use pulley::{OnPulley, Pulley, Wheel};
pub use reaction::{Reaction, ReactionParts, Wrench};
pub use rigid::{BodyShape, Mount, RigidBody};
pub use section::{LineInertia, Section, Stiffness};
pub use sliding_joint::{Centreline, Feed, Share, Sliding, SlidingJoint};
pub use solid::{SolidError, SolidMesh};
pub use state::State;
pub use strength::{Break, BreakableJoint, Strength};
pub use track::{Change, Changing, Track};
pub use wind::{Gusts, Wind, WindNow};
