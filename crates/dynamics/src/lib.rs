//! Steps of Cosserat rods: Algorithm 1 of the COPINGNet paper (Shao et al., ICLR 2021) on the model of Kugelstadt, Deul and
//! Bender (2018), with the integrator's equations in full or the paper's, contacts included.
//!
//! [`simulation::Simulation`] is the entry point: it splits a model into connected sets of segments and steps them.
//! [`auto::choose`] says which linear solver and which initial guess suit a model best. [`guess::InitialGuess`] and
//! [`projection::Projection`] are what other crates may implement.
//!
//! From the bottom up:
//!
//! - `step`: what a step is asked for and how it ends. `guess`, `start`: where a step and its solves begin.
//! - `attempt`: one attempt at a step of a connected set. `step_control`: whether it is halved. `substep`: what derivatives need of
//!   an accepted one.
//! - `islands`: the contact problem of an island, from how rods respond. `contact_world`: islands, step by step.
//! - `connected_set`: a set with its solver, its guess and its counters. `lane_batch`: alike sets in lanes. `piece`: either of them, or
//!   all sets that can touch, as `simulation` steps it. `batch`: many simulations as one.
//!
//! It knows no file format, no network, no static analysis and no derivative. It is internal: programs
//! use `cosserat`.

pub mod attempt;
pub mod auto;
pub mod batch;
mod connected_set;
mod contact_params;
mod contact_world;
pub mod counters;
pub mod formulation;
pub mod guess;
mod islands;
mod lane_batch;
mod limits;
mod piece;
pub mod projection;
pub mod simulation;
pub mod start;
pub mod step;
mod step_control;
pub mod substep;

pub use component::snapshot;
