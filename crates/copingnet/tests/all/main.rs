//! All tests of the crate's public side as one program, which builds faster than one program a file.

#[cfg(feature = "training")]
mod batch;
mod cg_loss;
mod checkpoint;
mod common;
mod encoding;
mod files;
mod forward;
mod guess;
mod moving;
#[cfg(feature = "training")]
mod network;
mod state;
mod step_guess;
