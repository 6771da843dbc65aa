//! Scenes: TOML files, the builtin ones, and the paper's random ones, as a checked [`rod::Model`] and its first state.
//!
//! ```
//! let scene = scene::builtin("bending-rod")?;
//! assert_eq!(scene.model.segments.len(), 30);
//! # Ok::<(), scene::SceneError>(())
//! ```
//!
//! A file is read in two stages: serde reads names and types (`format`), then every value is checked and the model is
//! built (`assemble` calls `rods` and `net`, which add rods to a `builder`; each topic has a file). Whatever is wrong, the first mistake gives one error with file, line, key,
//! value and what is allowed; no text makes it panic. `docs/scenes.md` documents the format. This crate knows no solver.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::Path;

use rod::{Model, Probe, State};

mod assemble;
mod bodies;
mod branch;
mod builder;
mod builtin;
mod columns;
mod contact;
mod copies;
mod curve;
pub mod defaults;
mod entries;
mod error;
mod format;
mod given;
mod grips;
mod heap;
mod hung;
mod mesh;
mod motion;
mod net;
mod origin;
mod probe;
mod properties;
mod random;
mod refine;
mod rods;
pub mod sampling;
mod section;
mod set;
mod shape;
mod strain;
mod strands;
mod table;
mod text;
mod tree;
mod usd;

pub use builtin::{Builtin, builtin, builtin_refined, builtin_set, builtins};
pub use entries::line_of;
pub use error::{SceneError, nearest};
pub use origin::Origin;
pub use set::parse_set;
pub use text::SceneText;

use refine::Refinement;

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

/// Reads the scene file at `path`.
///
/// # Errors
/// The file cannot be read, or what [`parse`] finds wrong.
pub fn load(path: impl AsRef<Path>) -> Result<Scene, SceneError> {
    load_set(path, &[])
}

/// The scene file at `path` after each of the `settings` has put its value in: see [`parse_set`].
///
/// # Errors
/// The file cannot be read, or as [`parse_set`].
pub fn load_set(path: impl AsRef<Path>, settings: &[String]) -> Result<Scene, SceneError> {
    let file = path.as_ref().display().to_string();
    match std::fs::read_to_string(&path) {
        Ok(text) => parse_set(&text, &file, settings),
        Err(source) => Err(SceneError::Read { file, source }),
    }
}

/// Reads a scene from the `text` of a file; `file_name` gives the scene its name and stands in errors.
///
/// # Errors
/// The first mistake found, with its line, key and value, and what is allowed.
pub fn parse(text: &str, file_name: &str) -> Result<Scene, SceneError> {
    parse_refined(text, file_name, NonZeroUsize::MIN)
}

/// The scene of [`parse`] with every segment cut into `factor` equal parts: segment i becomes the segments
/// `factor * i .. factor * (i + 1)`.
///
/// Everything keeps its place in the material: a fixed segment stays fixed over its whole length, branches, joints and loads
/// stay where they are, and the parts of a segment share its mass and begin to move as one rigid body. New nodes of curved
/// shapes lie on the curve. So with growing `factor` the scene converges to smooth rods, which are rigid where the file's
/// segments are fixed and where rods are joined. The error is of order 1 / `factor`, because a joint beside a fixed segment
/// bends over half of that segment, too; it is of order 1 / `factor`^2 where faces are clamped and nothing branches. A
/// `stretch` compliance is that of a whole segment. The time steps stay the file's.
///
/// # Errors
/// As [`parse`]; too many segments among them.
pub fn parse_refined(text: &str, file_name: &str, factor: NonZeroUsize) -> Result<Scene, SceneError> {
    let source = error::Source { file: file_name, text, notes: text::Notes::default() };
    let file: format::File = toml::from_str(text).map_err(|e| source.reader_error(&e))?;
    let scene = assemble::scene(&source, &file, Refinement(factor.get()))?;
    let text = (factor == NonZeroUsize::MIN).then(|| source.notes.text(text));
    Ok(Scene { text, ..scene })
}
