//! All tests of the crate's public side as one program.

mod examples;
mod features;
mod mistakes;
