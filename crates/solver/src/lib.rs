//! Position-based dynamics of stiff Cosserat rods: Algorithm 1 of the COPINGNet paper (Shao et al., ICLR 2021) on the
//! model of Kugelstadt, Deul and Bender (2018), with its linear solvers and its initial guesses.
//!
//! [`simulation::Simulation`] is the entry point: it splits a model into connected sets of segments and steps them.
//! [`auto::choose`] says which linear solver and which start a model is best off with. [`statics::equilibrium`] relaxes a
//! state instead. [`linear::LinearSolver`], [`guess::InitialGuess`] and [`projection::Projection`] are the seams. This crate
//! knows no file format and no network.
//!
//! From the bottom up:
//!
//! - `kernel`: blocks of a joint, on the arithmetic of [`kernels`]. `topology`, `system`: who is joined to whom, and the linear
//!   system of an outer iteration. `linear`: its solvers.
//! - `component`: the state of a connected set of segments (or of alike ones, one a lane), and each stage of Algorithm 1 on
//!   it. `guess`, `start`: where a step and its solves begin.
//! - `tangent`: the exact matrix of Newton's method, and its elimination.
//! - `step`: what a step is asked for and how it ends. `attempt`: one attempt at a step. `step_control`: what becomes of attempts.
//! - `derivative`: derivatives of whole runs.
//! - `snapshot`: what of all this the steps to come depend on.
//! - `connected_set`: a component with its solver, its guess and its counters. `lane_batch`: alike sets in lanes. `contact`,
//!   `contact_world`: contacts, and the sets that can touch. `piece`: any of the three, as `simulation` steps it. `batch`: many simulations
//!   as one.

pub mod attempt;
pub mod auto;
pub mod batch;
pub mod component;
mod connected_set;
mod contact;
mod contact_params;
mod contact_world;
pub mod counters;
pub mod derivative;
pub mod formulation;
pub mod guess;
pub mod integrator {
    //! How a motion goes on from step to step.

    pub use rod::Integrator;
}
mod lane_batch;
mod limits;
pub mod modes;
mod piece;
pub mod projection;
pub mod simulation;
pub mod snapshot;
pub mod start;
pub mod statics;
pub mod step;
mod step_control;

pub use jointed::{linear, system, tangent, topology};
use kernels as kernel;
