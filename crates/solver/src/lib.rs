//! Position-based dynamics of stiff Cosserat rods: Algorithm 1 of the COPINGNet paper (Shao et al., ICLR 2021) on the
//! model of Kugelstadt, Deul and Bender (2018), with its linear solvers and its initial guesses.
//!
//! [`simulation::Simulation`] is the entry point: it splits a model into connected sets of segments and steps them.
//! [`auto::choose`] says which linear solver and which start a model is best off with.
//! [`statics::equilibrium`] relaxes a state instead. [`linear::LinearSolver`], [`guess::InitialGuess`] and [`projection::Projection`] are
//! the seams.
//! This crate knows no file format and no network.

pub mod auto;
pub mod component;
mod contact;
pub mod counters;
pub mod formulation;
pub mod guess;
pub mod kernel;
pub mod linear;
pub mod projection;
pub mod simulation;
pub mod statics;
pub mod step;
pub mod system;
pub mod topology;
mod touching;
mod unit;
