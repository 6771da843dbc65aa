//! All tests of the crate's public side as one program, which builds faster than one program a file.

mod body_frame;
mod common;
mod paper;
mod planar;
mod semi;
mod steps;
