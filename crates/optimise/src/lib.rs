//! Two searches for the least of a function whose derivatives the caller has: least squares of few parameters
//! ([`LeastSquares`], Levenberg and Marquardt), and any smooth function of many ([`lbfgs`]).
//!
//! A function may have no value in places, as where a cable has no equilibrium: it then gives what is not finite, and the step
//! that led there is taken back. Errors of the caller's end a search and are handed on. This crate is internal: programs use
//! `cosserat`.

mod lbfgs;
mod least_squares;

pub use lbfgs::{LbfgsParams, Minimum, lbfgs};
pub use least_squares::{Fit, LeastSquares, Normal, Residuals, Step};
