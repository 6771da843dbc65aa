//! What is measured across solvers, guesses and scenes: comparisons at equal error, error against run time, the
//! stability table, and the figures of the paper.
//!
//! This crate runs simulations and measures them. It knows no network (guesses come as factories) and prints nothing.

pub mod ablation;
pub mod benchmark;
pub mod branched;
pub mod cables;
pub mod clock;
pub mod compare;
pub mod equilibria;
pub mod gradients;
pub mod guesses;
pub mod knot;
pub mod needs;
pub mod newton;
pub mod paper;
pub mod passing;
pub mod precision;
pub mod stages;
pub mod stress;
pub mod time_step;
