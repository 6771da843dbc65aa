//! Equilibria of cables between two grips, or in one, many at once and without a history.
//!
//! [`batch::solve`] answers queries ([`query::Query`]): it finds stable equilibria ([`answer::Equilibrium`]) of the same discrete
//! energy as that of `statics`, by Newton's method with eight queries side by side. This crate trains no
//! network and knows no evidence.
//!
//! ```
//! use equilibria::{Cable, Grip, Params, Query, solve};
//! use nalgebra::{UnitQuaternion, Vector3};
//!
//! // A cable of 1 m between two level grips that are 0.6 m apart, both pointing along x.
//! let along_x = UnitQuaternion::rotation_between(&Vector3::z(), &Vector3::x()).unwrap();
//! let grip = |x: f64| Grip { position: Vector3::x() * x, orientation: along_x };
//! let query = Query { cable: Cable::new(1.0, 0.02, 0.015, 2.0), start: grip(0.0), end: Some(grip(0.6)) };
//! let answers = solve(&[query], &Params::default()).unwrap();
//! let lowest = &answers[0].as_ref().unwrap().equilibria[0];
//! assert!(lowest.positions[24].z < -0.3);
//! // Each grip bears half of the weight.
//! assert!((lowest.grips[0].force.z - 1.0).abs() < 1e-6);
//! ```
//!
//! From the bottom up: `query`, `scaled` (a query without units), `joint` (its energy with derivatives), `sweep` (one linear solve),
//! `descent` (Newton's method), `start`, `known` (starts at answers), `canonical`, `network` and `learned` (starts that a network
//! proposes), `level` (from a coarse cut to a finer one), `model` (a model as a query), `answer`, `params`, `problem` (what is solved: a cable,
//! or three), `cable` (the first of these), `batch`, `derivative`; `sample` draws random queries, `file` reads queries and writes
//! answers. `branched` has cables with three arms.

pub mod answer;
pub mod batch;
pub mod branched;
mod cable;
pub mod canonical;
pub mod derivative;
mod descent;
pub mod file;
mod joint;
pub mod known;
pub mod learned;
mod level;
pub mod model;
pub mod network;
mod params;
pub mod problem;
pub mod query;
pub mod sample;
mod scaled;
pub mod start;
mod sweep;

pub use answer::{Answer, Equilibrium, Searches, Wrench};
pub use batch::{Params, ParamsError, solve, solve_from};
pub use model::CableOfModel;
pub use problem::{Answers, Problem};
pub use query::{Cable, Carried, Grip, Query, QueryError};
pub use scaled::{Cut, Scaled};
