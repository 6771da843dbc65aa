//! All tests of the crate's public side as one program, which builds faster than one program a file.

mod branched;
mod hanging;
mod noodle;
mod recordings;
mod synthetic;
mod video;
