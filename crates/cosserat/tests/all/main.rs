//! All tests of the crate's public side as one program, which builds faster than one program a file.

mod derivatives;
mod heaps;
mod impacts;
mod readme;
mod rest_shape;
mod resting;
