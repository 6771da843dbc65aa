//! Cables with branches: a parent between two grips, and branches with free ends that hang on it.
//!
//! A [`Tree`] says which markers lie on which rod, found from how far they are from each other. A [`BranchedCable`] is what a prediction may
//! know of a recording: its first two frames and its grips. [`predict`] simulates it with some [`Numbers`], [`fit`] finds them, and
//! [`Errors`] says how far predictions are off.

mod fit;
mod metric;
mod model;
mod number;
mod tree;

pub use fit::{Found, ITERATIONS, fit};
pub use metric::Errors;
pub use model::{BranchedCable, predict};
pub use number::{Number, Numbers};
pub use tree::{Branch, Tree};
