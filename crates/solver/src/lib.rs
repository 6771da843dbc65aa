//! Position-based dynamics of stiff Cosserat rods.
pub mod component;
pub mod counters;
pub mod direct;
pub mod formulation;
pub mod guess;
pub mod kernel;
pub mod linear;
pub mod looped;
pub mod simulation;
pub mod solvers;
pub mod sparse;
pub mod statics;
pub mod step;
pub mod system;
pub mod topology;
mod unit;
