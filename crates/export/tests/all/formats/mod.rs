//! Exports read back by readers of others: every number, every frame.

mod bodies;
mod errors;
mod glb;
mod lines;
mod obstacles;
mod runs;
mod tables;
mod usda;
mod vtp;
