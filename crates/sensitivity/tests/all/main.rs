//! All tests of the crate's public side as one program.

mod allocation;
mod common;
mod derivative;
mod recording;
