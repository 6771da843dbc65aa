//! Equilibria of cables between two grips, or in one, many at once and without a history.
//!
//! [`batch::solve`] answers queries ([`query::Query`]): it finds stable equilibria ([`answer::Equilibrium`]) of the same discrete
//! energy as that of [`solver::statics`], by Newton's method with eight queries side by side. This crate knows no networks
//! and no evidence.
//!
//! From the bottom up: `query`, `scaled` (a query without units), `joint` (its energy with derivatives), `sweep` (one linear solve), `descent` (Newton's method),
//! `start`, `level` (from a coarse cut to a finer one), `answer`, `batch`, `derivative`; `sample` draws random queries, `file` reads
//! queries and writes answers.

pub mod answer;
pub mod batch;
pub mod derivative;
mod descent;
pub mod file;
mod joint;
mod level;
pub mod query;
pub mod sample;
mod scaled;
pub mod start;
mod sweep;

pub use answer::{Answer, Equilibrium, Wrench};
pub use batch::{Params, ParamsError, solve, solve_from};
pub use query::{Cable, Grip, Query, QueryError};
pub use scaled::{Cut, Scaled};
