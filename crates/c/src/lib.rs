//! Elastic rods from C, and from all that calls C: engines, MATLAB, Julia, robots' middleware.
//!
//! `include/cosserat.h` is the documentation: a simulation is loaded from a scene file, stepped, its grips moved, its poses and
//! forces read, and freed. [`handle`] does that in safe Rust. [`interface`] is what C calls: it reads pointers, turns errors into
//! codes and texts, and lets no panic cross the boundary.
//!
//! This crate must not know how anything is solved, and adds no physics.

pub mod handle;
#[allow(unsafe_code)]
pub mod interface;
