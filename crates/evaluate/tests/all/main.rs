//! All tests of the crate's public side as one program, which builds faster than one program a file.

mod commands;
mod random;
mod report;
