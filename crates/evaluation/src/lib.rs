//! What is measured across solvers, guesses and scenes: comparisons at equal error, and the stability table.
//!
//! This crate runs simulations and measures them. It knows no network (guesses come as factories) and prints nothing.

pub mod ablation;
pub mod compare;
pub mod guesses;
pub mod starts;
pub mod steps;
pub mod stress;
