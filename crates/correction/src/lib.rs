//! What a network adds to the prediction of a real cable: a correction of the simulated markers, learned from recordings.
//!
//! A [`Film`](film::Film) is a recording beside a guess of its markers, which is the simulation or, as a rival without physics,
//! the first shape carried along with the grips. [`Inputs`](inputs::Inputs) are what a network reads of it in each frame, the
//! same in every place and heading. A [`Reader`](network::Reader) is one of the networks that read frames. A [`Correction`](correction::Correction) says what to add; [`train`](training::train)
//! makes it. [`noodle`] makes films of noodles. [`inside`] corrects the simulation itself: curvatures at rest that differ along the cable, moments of its joints.

pub mod applicability;
pub mod correction;
pub mod film;
pub mod inputs;
pub mod inside;
pub mod moments;
pub mod network;
pub mod noodle;
mod recurrent;
pub mod training;
