//! All tests of the crate's public side as one program, which builds faster than one program a file.

mod agreement;
mod branched;
mod derivative;
mod learned;
mod program;
mod queries;
