//! All tests of the crate's public side as one program, which builds faster than one program a file.

mod at_rest;
mod bits;
mod common;
mod docs;
mod driven;
mod english;
mod exports;
mod files;
mod folders;
mod from;
#[cfg(feature = "gn")]
mod gn;
mod going_on;
mod kept;
mod killed;
mod learned;
mod learned_start;
#[cfg(unix)]
mod live_view;
mod mistakes;
mod mjcf;
mod pictures;
mod recipes;
mod runs;
#[cfg(feature = "gn")]
mod steps;
