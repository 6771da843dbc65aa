//! Cables with three arms that meet at a junction, each arm's other end in a grip.
//!
//! The arms are cables as [`crate::Cable`] has them, which run from their grips to the junction. The junction is a point with a
//! frame: arms are clamped to it, at rest in the plane of its x and y at 120 degrees from each other
//! ([`query::directions`]). It has no weight.
//!
//! From the bottom up: `query`, `star` (a query without units), `sweep` (one linear solve), `start` (starts without
//! learning), `canonical` and `learned` (starts that a network proposes), `answer`, `batch` (what [`crate::batch`] needs of a star);
//! `sample` draws random queries, `file` has the columns of their tables.

pub mod answer;
pub mod batch;
pub mod canonical;
pub mod file;
pub mod learned;
pub mod query;
pub mod sample;
pub mod star;
pub mod start;
mod sweep;

pub use answer::{BranchedAnswer, BranchedEquilibrium};
pub use batch::{default_params, solve, solve_from};
pub use query::{ARMS, BranchedError, BranchedQuery};
pub use star::{Junction, Star};
