//! Identifies real cables: from recordings of markers between two grips to the numbers of a rod that moves as they do.
//!
//! A [`Recording`](recording::Recording) is read from a file. A [`Cable`](cable::Cable) is what a prediction may know of it: its
//! first two frames and its grips. [`predict`](predict::predict) simulates cables with some [`Parameters`](parameter::Parameters).
//! [`fit`](fit::fit) finds them, and [`known`](confidence::known) says how well recordings determine them. What is written is
//! [`CableFile`](result::CableFile), a [`scene`], a [`page`], and a [`playback`]. [`simulated`]
//! makes recordings of a cable whose numbers are known. [`hanging`] finds the stiffness of wires from photographs of how they hang.
//! [`noodle`] identifies a rod with one clamp whose full pose is recorded, [`branched`] a cable with branches.
//! [`motions`] says which recordings are of one kind of motion.

pub mod branched;
pub mod cable;
pub mod confidence;
pub mod fit;
pub mod hanging;
pub mod metric;
pub mod motions;
pub mod noodle;
pub mod page;
pub mod parameter;
pub mod playback;
pub mod predict;
pub mod recording;
pub mod result;
pub mod scene;
pub mod simulated;
pub mod spline;
