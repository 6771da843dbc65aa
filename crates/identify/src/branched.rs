//! Cables with branches: a parent between two grips, and branches with free ends that hang on it.
//!
//! A [`Tree`] says which markers lie on which rod, found from how far they are from each other. A [`BranchedCable`] is what a prediction may
//! know of a recording: its first two frames and its grips. It has some [`Numbers`].

mod beside;
mod model;
mod number;
pub mod scene;
mod specimen;
mod tree;
mod twig;

pub use model::BranchedCable;
pub use number::{Number, Numbers};
pub use tree::{Branch, Tree};
