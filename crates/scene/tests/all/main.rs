//! All tests of the crate's public side as one program, which builds faster than one program a file.

mod bodies;
mod builtin;
mod docs;
mod driven;
mod errors;
mod eyelets;
mod grips;
mod laws;
mod mangled;
mod meaning;
mod meshes;
mod motions;
mod moving_obstacles;
mod overlaps;
mod probes;
mod pulleys;
mod refined;
mod set;
mod shapes;
mod sheaths;
mod text;
mod usd;
mod weave;
