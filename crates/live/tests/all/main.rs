//! All tests of the live view without a browser as one program.

mod ropes;
mod served;
mod sessions;
