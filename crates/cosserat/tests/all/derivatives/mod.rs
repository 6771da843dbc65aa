//! Derivatives of runs and of equilibria against central differences.

mod common;
mod equilibrium;
mod forces;
mod obstacles;
mod runs;
mod touching;
