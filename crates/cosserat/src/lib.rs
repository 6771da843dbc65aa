//! Accurate, stable and fast simulation of elastic rods: cables, ropes, sutures, springs, hair, trees.
//!
//! This crate is what Rust programs use. Everything in it is defined in a crate behind it and gathered here by topic;
//! [`prelude`] has what most programs need. The crates behind it are internal: programs do not name them.
//!
//! ```
//! use cosserat::prelude::*;
//!
//! // A rubber band of 1 m, held at its first segment, falls.
//! let rubber = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 1100.0 };
//! let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 20);
//! let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
//! let band = assembly.rod(&RodSpec::new(nodes, 0.005, rubber));
//! assembly.fix(band.start);
//! let (model, mut state) = assembly.finish();
//!
//! let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
//! for _ in 0..50 {
//!     let report = simulation.step(0.01)?;
//!     assert_eq!(report.status, Status::Converged);
//! }
//! simulation.store(&mut state);
//! assert!(state.positions[band.end - 1].z < -0.5);
//! # Ok::<(), SimulationError>(())
//! ```
//!
//! # In four steps
//!
//! 1. **A model and its first state.** [`Assembly`](assembly::Assembly) builds them from rods, clamps, loads and obstacles;
//!    [`scene`] reads them from a scene file or takes a builtin scene. A [`Model`](state::Model) holds what stays the same, a
//!    [`State`](state::State) what moves. Both are plain data.
//! 2. **A motion or an equilibrium.** [`Simulation::step`](simulation::Simulation::step) advances by a time step;
//!    [`statics::equilibrium`] finds an equilibrium instead, [`statics::branches`] several, [`statics::path`] those along what
//!    is driven, [`statics::modes`] how a model vibrates about one.
//! 3. **What came of it.** [`Simulation::store`](simulation::Simulation::store) copies positions, orientations and
//!    velocities into a state, [`Simulation::store_joint_forces`](simulation::Simulation::store_joint_forces) what each
//!    joint transmits. [`measure`](state::measure) has energies, momenta and lengths.
//!    [`statics::rest_shape`] finds the rest shape with which a hanging tree stays as it is drawn; [`derivative`] says what
//!    motions and equilibria change by with all that they depend on, and [`optimise`] searches with that.
//! 4. **Which joint is which.** [`Model::joints_of`](state::Model::joints_of) gives a rod's joints in order along it.
//!
//! # Rigid bodies
//!
//! [`Assembly::body`](assembly::Assembly::body) adds a [`RigidBody`](assembly::RigidBody) of any inertia: a weight, a hook, a
//! hand. [`Assembly::join_body`](assembly::Assembly::join_body) joins a segment to it at any place. A body is a segment of the
//! model and the state like those of rods, so that it can be fixed, driven, loaded and measured as they are.
//!
//! # Grips that move
//!
//! A fixed segment or a clamped face follows a [`Motion`](motion::Motion): keyframes or velocities, in the model from the
//! start ([`Model::motions`](state::Model::motions)) or given on the way by
//! [`Simulation::drive`](simulation::Simulation::drive). At every step it is exactly where the motion says.
//! [`Reaction`](motion::Reaction) is what holds it there. Without a motion a fixed segment keeps its velocity, which
//! [`Simulation::set_velocities`](simulation::Simulation::set_velocities) may set before each step (example `moved_grip`).
//!
//! # Planning: forces of one's own, snapshots, many at once
//!
//! [`Simulation::set_load`](simulation::Simulation::set_load) and
//! [`Simulation::set_gravity`](simulation::Simulation::set_gravity) change between two steps what acts from the next on; the
//! model says where a load acts, with a force that may be zero at first. [`Simulation::set_rest`](simulation::Simulation::set_rest)
//! changes the rest of a joint: muscles.
//! [`Simulation::snapshot`](simulation::Simulation::snapshot) takes all that the steps to come depend on, at a small part of
//! the cost of a step, and [`Simulation::restore`](simulation::Simulation::restore) goes back there, to the last bit. A
//! [`Batch`](simulation::Batch) steps many copies of a model together, alike rods in the lanes of vector registers, each with
//! its own materials, state, motions, loads and grips (example `plan_a_move`).
//! [`Simulation::store_contact_forces`](simulation::Simulation::store_contact_forces) says what presses on what.
//!
//! # Grips that attach and release
//!
//! Between two steps [`Simulation::attach`](simulation::Simulation::attach) takes hold of a segment where it is, or closes an
//! open grip ([`Model::open`](state::Model::open)) on its end face, and
//! [`Simulation::release`](simulation::Simulation::release) lets it go. A [`Driven`](motion::Driven) with times does both by
//! itself. [`Simulation::store_model`](simulation::Simulation::store_model) tells the model what is held now, which energies
//! and reactions ask for. [`Model::pin`](state::Model::pin), [`Model::hinge`](state::Model::hinge) and
//! [`Model::soften`](state::Model::soften) make pinned ends, hinges and springs.
//!
//! # Examples
//!
//! `cargo run -p cosserat --example NAME`: `hang_a_cable` (assembly from code, equilibrium, tension at the grips),
//! `drop_a_helix` (a builtin scene, energies), `tree_in_wind` (a scene file's text in the code), `moved_grip` (a grip whose
//! velocity is set before each step), `two_arms` (both ends driven, and what they hold), `pick_and_place` (a gripper takes a cable
//! along and lets it go), `plan_a_move`
//! (64 motions of a grip at once), `sag_into_a_design` (the rest shape of a hanging tree), `lay_a_cable` (the motion of two
//! grips that lays a cable along a curve), `snapshot_times` (what snapshots cost), `numerical_damping` (how much energy a swing
//! loses to the time step).
//!
//! # Features
//!
//! `derivatives` (default): derivatives of motions and equilibria, and searches. `parallel` (default): threads of rayon's current
//! pool share the work, with the same bits on any number; without it the calling thread does all of it. `scenes` (default): scene
//! files and builtin scenes. `sparse` (default): rods that form loops; without it they are refused
//! ([`SimulationError::Solver`](simulation::SimulationError::Solver)). `learned`: guesses of trained networks. `live`: a running
//! simulation in a browser.
//!
//! Units are SI throughout: metres, kilograms, seconds, newtons, radians.

pub use nalgebra;

/// Building a model and its first state: rods, rigid bodies, clamps, loads, air, contacts.
pub mod assembly {
    pub use rod::{
        Air, Assembly, BodyShape, Contacts, Damping, Foundation, Friction, Gusts, InnerDamping, JointLaw, LineInertia,
        Load, Material, MaxwellBranch, Mesh, MeshError, MomentTable, Mount, Obstacle, ObstacleShape, Plasticity,
        RestShape, RigidBody, RodSpec, Section, Sheath, SolidError, SolidMesh, Stiffness, StrandFriction, Strength,
        Stretch, Surface, Unloading, Wind, shape,
    };
}

/// Scenes: files, texts, and those that come with this crate, as a model and its first state: with the cargo feature `scenes`,
/// which is on unless it is turned off.
///
/// `docs/scenes.md` of the repository documents the format.
#[cfg(feature = "scenes")]
pub mod scene {
    pub use ::scene::{
        Builtin, Origin, Random, RodInfo, RunDefaults, Scene, SceneError, SceneText, builtin, builtin_refined,
        builtin_set, builtins, defaults, is_builtin, line_of, load, load_set, nearest, parse, parse_refined, parse_set,
        sampling,
    };
}

/// What stays the same, what moves, and what one reads off it: forces of joints, energies, lengths, first modes; parts of it.
pub mod state {
    pub use rod::{
        Body, Break, BreakableJoint, Centreline, DriveError, Freedom, InelasticJoint, InternalVariables, Joint,
        JointForce, Mode, Model, ModelError, OnPulley, Part, Pose, Probe, Pulley, Quantity, Reading, Restoring,
        Segment, Share, Sliding, SlidingJoint, Springs, State, StrainMeasure, Wheel, curvature, darboux, measure,
    };
}

/// What moves by itself: motions of what is held and of obstacles, loads and gravity over time; and what it takes to hold them.
pub mod motion {
    pub use rod::{
        Carried, Change, Changing, Driven, Interpolation, Keyframe, KeyframeError, Motion, MovingPose, Reaction,
        ReactionParts, Track, Wrench,
    };
}

/// Stepping a model in time.
pub mod simulation {
    pub use dynamics::batch::Batch;
    pub use dynamics::counters::{Counters, StageTimes};
    pub use dynamics::formulation::{ContactProjection, Formulation, Tangent};
    pub use dynamics::simulation::{
        ContactForce, ContactParams, ContactParamsError, Overlap, Overlapped, Settings, Simulation, SimulationError,
        StepReport, Taken, TimedGrip, Touched, contact_wrenches,
    };
    pub use dynamics::snapshot::Snapshot;
    pub use dynamics::step::{Status, StepParams};
    pub use jointed::linear::cg::CgParams;
    pub use jointed::linear::precondition::PreconditionerKind;
    pub use jointed::linear::solvers::SolverKind;
    pub use rod::Integrator;
}

/// The equilibrium that a state relaxes to, several of them, and those along what is driven.
pub mod statics {
    pub use ::statics::branches::{Branch, BranchParams, Branches, branches};
    pub use ::statics::inverse_shape::{RestShapeError, rest_shape};
    pub use ::statics::modes::{Mode, Modes, modes, modes_telling};
    pub use ::statics::path::{PathEnd, PathEvent, PathEventKind, PathParams, PathPoint, PathReport, path};
    pub use ::statics::{StaticError, StaticMethod, StaticParams, StaticReport, equilibrium};
}

/// Derivatives of whole runs in formulation `newton` and of equilibria, forward along a few directions and backward for one
/// number: with the cargo feature `derivatives`, which is on unless it is turned off.
///
/// `docs/derivatives.md` of the repository says what they are worth, what they cost and how to use them.
#[cfg(feature = "derivatives")]
pub mod derivative {
    pub use sensitivity::{
        AirVariation, DerivativeError, Equilibrium, Forward, HeldVariation, JointVariation, ObstacleVariation,
        Parameter, Recording, Rods, SegmentVariation, StateVariation, Variation, Wanted,
    };
}

/// Searches for the parameters with which a motion or an equilibrium is what one wants, from its derivatives: with the cargo
/// feature `derivatives`.
#[cfg(feature = "derivatives")]
pub mod optimise {
    pub use ::optimise::{Fit, LbfgsParams, LeastSquares, Minimum, Normal, Residuals, Step, lbfgs};
}

/// Where solves and steps begin. A better start saves time, never accuracy, and most programs need none.
///
/// ```
/// use cosserat::guess;
/// use cosserat::prelude::*;
///
/// // Formulation `newton` is faster from a start that follows the last steps.
/// let step = StepParams { formulation: Formulation::Newton, ..StepParams::default() };
/// let Scene { model, state, .. } = scene::builtin("slack-rod")?;
/// let choice = guess::choose(&model, &step, None);
/// let settings = Settings { step, solver: choice.solver };
/// let start: guess::GuessFactory = &|model, members, topology| choice.build_guess(model, members, topology);
/// let mut simulation = Simulation::new(&model, &state, &settings, Some(start))?;
/// simulation.step(0.02)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub mod guess {
    pub use dynamics::auto::{Choice, choose};
    pub use dynamics::guess::{GuessKind, InitialGuess};
    pub use dynamics::simulation::GuessFactory;
    pub use jointed::members::Members;
    pub use jointed::topology::Topology;
}

/// COPINGNet's guesses, from checkpoints that `cargo run -p train` writes: with the cargo feature `learned`.
///
/// A guess changes where a solve or a step begins, never what it ends at. `checkpoints/` of the repository has trained networks;
/// burn trains them and is not needed here.
///
/// ```
/// use std::path::Path;
///
/// use cosserat::guess::GuessFactory;
/// use cosserat::learned::{Checkpoint, GnStepGuess, Graph, Trained};
/// use cosserat::prelude::*;
///
/// let Checkpoint { weights, encoding, .. } = Checkpoint::load(Path::new("../../checkpoints/helix-step.toml"))?;
/// let network = Trained::new(&weights, encoding);
/// let start: GuessFactory = &|model, members, topology| {
///     Some(Box::new(GnStepGuess::new(&network, Graph::new(model, members, topology), None)))
/// };
/// let Scene { model, state, .. } = scene::builtin("helix")?;
/// let step = StepParams { formulation: Formulation::Newton, ..StepParams::default() };
/// let settings = Settings { step, ..Settings::default() };
/// let mut simulation = Simulation::new(&model, &state, &settings, Some(start))?;
/// assert_eq!(simulation.step(0.02)?.status, Status::Converged);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[cfg(feature = "learned")]
pub mod learned {
    pub use copingnet::{Card, Checkpoint, CheckpointError, GnGuess, GnStepGuess, Trained};
    pub use graph::{Graph, Normal, planar_normal};
}

/// A running simulation in a browser, watched and handled: with the cargo feature `live`.
///
/// `docs/live.md` of the repository has the buttons and keys, and what travels between the simulation and the page.
#[cfg(feature = "live")]
pub mod live {
    pub use ::live::{
        Input, Knob, Knobs, Live, LiveError, Options, Rebuild, Recording, Replay, Save, Session, serve, with_hands,
    };
}

/// The crates of the numerics as they are, for this project's evidence and learning: stages of a step, its matrices, its linear
/// solvers, arithmetic in lanes. No promise of stability between versions; programs need none of it.
pub mod internals {
    pub use {collision, component, dynamics, jointed, kernels};
}

/// What most programs need.
pub mod prelude {
    pub use nalgebra::{UnitQuaternion, Vector3};

    pub use crate::assembly::{
        Air, Assembly, BodyShape, Contacts, Damping, Friction, Gusts, InnerDamping, Load, Material, Obstacle,
        ObstacleShape, RestShape, RigidBody, RodSpec, Section, Stretch, Surface, Wind, shape,
    };
    pub use crate::motion::{Carried, Driven, Interpolation, Keyframe, Motion, Reaction};
    #[cfg(feature = "scenes")]
    pub use crate::scene::{self, Scene, SceneError};
    pub use crate::simulation::{
        Batch, ContactForce, Formulation, Integrator, Settings, Simulation, SimulationError, Snapshot, Status,
        StepParams, StepReport, Touched,
    };
    pub use crate::state::{Body, Joint, JointForce, Model, ModelError, Pose, Segment, State, measure};
    pub use crate::statics::{self, StaticParams};
}

/// The library examples of the repository's pages, compiled and run.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../../../README.md")]
    struct Readme;
    #[cfg(feature = "derivatives")]
    #[doc = include_str!("../../../docs/derivatives.md")]
    struct Derivatives;
}
