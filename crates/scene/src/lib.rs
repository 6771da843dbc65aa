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
//! It is internal: programs use `cosserat`.

mod assemble;
mod bodies;
mod branch;
mod builder;
mod builtin;
mod checked;
mod columns;
mod contact;
mod copies;
mod curve;
pub mod defaults;
mod entries;
mod error;
mod eyelet;
mod format;
mod foundation;
mod given;
mod grips;
mod heap;
mod hung;
mod law;
mod load;
mod measures;
mod mesh;
mod motion;
mod motor;
mod net;
mod origin;
mod parse;
mod probe;
mod properties;
mod pulley;
mod random;
mod refine;
mod rest;
mod rods;
pub mod sampling;
mod section;
mod set;
mod shape;
mod sheath;
mod strain;
mod strands;
mod strength;
mod table;
mod text;
mod tree;
mod usd;

pub use builtin::{Builtin, builtin, builtin_refined, builtin_set, builtins, is_builtin};
pub use checked::{MAX_SEGMENTS, RodInfo, RunDefaults, Scene};
pub use entries::line_of;
pub use error::{SceneError, nearest};
pub use load::{load, load_set};
pub use origin::Origin;
pub use parse::{parse, parse_refined};
pub use random::Random;
pub use set::parse_set;
pub use text::SceneText;
