//! All tests of the crate's public side as one program.

mod validation;
