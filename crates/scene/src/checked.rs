//! A scene as it is once it has been read and checked.

use std::ops::Range;

use rod::{Integrator, Model, Probe, State};

use crate::origin::Origin;
use crate::text::SceneText;

/// Most segments that a scene may have in all.
pub const MAX_SEGMENTS: usize = 10_000_000;

/// What is to be simulated, and for how long.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Name: the file's, without folder and extension.
    pub name: String,
    /// What it shows, in a sentence or two; may be empty.
    pub description: String,
    /// What stays the same over time; passes [`Model::validate`] with `state`.
    pub model: Model,
    /// First state.
    pub state: State,
    /// How it is run unless the user says otherwise.
    pub run: RunDefaults,
    /// The bodies and the rods, in the order of their segments; [`rod::Segment::rod`] points here.
    pub rods: Vec<RodInfo>,
    /// Names of the obstacles, in the model's order: the file's, or `obstacle-K` for the nameless `obstacles[K]`.
    pub obstacles: Vec<String>,
    /// Names of the eyelets, in the order of [`Model::sliding_joints`].
    pub eyelets: Vec<String>,
    /// Names of the pulleys, in the order of [`Model::pulleys`].
    pub pulleys: Vec<String>,
    /// Names of the sheaths, in the order of [`rod::Contacts::sheaths`].
    pub sheaths: Vec<String>,
    /// Where quantities are read.
    pub probes: Vec<Probe>,
    /// The frame of another run with which it begins, if not with `state`; reading it is up to who runs the scene.
    pub from: Option<Origin>,
    /// Whether it begins in an equilibrium, to which `state` is the way; finding it is up to who runs the scene.
    pub begins_at_rest: bool,
    /// The text that it was read from, with the files that this names; `None` where segments were cut into parts.
    pub text: Option<SceneText>,
}

/// Time step, number of steps, and which of them are kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunDefaults {
    /// Time step [s].
    pub dt: f64,
    /// Number of steps.
    pub steps: usize,
    /// Every so many steps a frame is kept, and the last one.
    pub every: usize,
    /// The rule that integrates the motion, where the scene names one.
    pub integrator: Option<Integrator>,
}

/// Where one rod of a scene is found in its model; or one rigid body, which is a rod of one segment there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RodInfo {
    /// Name: the file's, `rod-K` for the nameless `rods[K]`, or `NAME/K` for the K-th branch grown on a tree's trunk or
    /// the K-th strand. A net's ropes are `NAME/x-K` and `NAME/y-K`, and the nameless `nets[K]` is `net-K`; the nameless
    /// `bodies[K]` is `body-K`.
    pub name: String,
    /// Its segments in the model.
    pub segments: Range<usize>,
    /// Whether its last segment is joined to its first.
    pub closed: bool,
}
