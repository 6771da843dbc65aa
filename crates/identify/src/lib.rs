//! Identifies real cables: from recordings of markers between two grips to the numbers of a rod that moves as they do.
//!
//! A [`Recording`](recording::Recording) is read from a file. A [`Specimen`](specimen::Specimen) is what a prediction may know of it:
//! of a [`Cable`](cable::Cable) its first two frames and its grips; there are cables with branches ([`branched`]), too, and rods with
//! one clamp whose full pose is recorded ([`noodle`]). [`predict`](predict::predict) simulates specimens with some numbers, as
//! [`Parameters`](parameter::Parameters). [`fit`](fit::fit) finds them, and [`known`](confidence::known) says how well recordings
//! determine them. A [`Kind`](kind::Kind) is all of that for one of the three. What is written is [`CableFile`](result::CableFile), a
//! [`scene`], a [`page`], and a [`playback`]. [`simulated`] makes recordings of a cable whose numbers are known. [`hanging`] finds the
//! stiffness of wires from photographs of how they hang, and [`video`] makes recordings from pictures of one or two cameras.
//! [`motions`] says which recordings are of one kind of motion.

pub mod branched;
pub mod cable;
pub mod confidence;
pub mod conformal;
pub mod fit;
pub mod hanging;
pub mod kind;
pub mod metric;
pub mod motions;
pub mod noodle;
pub mod page;
pub mod parameter;
pub mod playback;
pub mod predict;
pub mod quantity;
pub mod recording;
pub mod result;
pub mod scene;
pub mod simulated;
pub mod specimen;
pub mod spline;
pub mod table;
pub mod video;
