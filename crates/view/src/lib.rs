//! Motions of rods to look at: recorded, packed small, and played by a page that is one HTML file and needs no network.
//!
//! A [`Recorder`] takes one [`Frame`] after the other and packs each at once; what it makes of them is a [`Run`], which
//! [`write_run`] stores as JSON and [`read_run`] reads back. [`write_page`] puts runs into a page that draws them with
//! WebGL 2, alone or to be compared.
//!
//! What is kept is meant for the eye: positions to [`Run::position_precision`], orientations to
//! [`ORIENTATION_PRECISION`], what colours show to 8 bits. Exact numbers are in the trajectory (crate `export`).

mod body;
mod channel;
mod chapter;
mod coarse;
mod curve;
mod decoded;
mod deflate;
mod error;
mod mark;
mod obstacle;
mod page;
mod quaternion;
mod recorder;
mod run;
mod store;
mod track;

pub use channel::{Channel, Range, Scale, channel_values};
pub use curve::{Curve, Line};
pub use decoded::Decoded;
pub use error::{DecodeError, ViewError};
pub use mark::Pressing;
pub use page::{live_page, write_page};
pub use quaternion::ORIENTATION_PRECISION;
pub use recorder::{Frame, Recorder};
pub use run::Run;
pub use store::{read_run, write_run};
