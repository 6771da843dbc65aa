//! Random scenes, and the laws of mechanics that every run of them must keep.
//!
//! [`draw()`] makes a valid scene file of documented features at random, [`check()`] runs it and holds each step against the
//! [`Law`]s, and [`shrink()`] cuts a case that breaks one down to a small case that still does. [`campaign()`] does all three
//! for many scenes on several threads. What a law allows follows from the order of the time step and the tolerances that are
//! documented; what the solver says of itself is not asked but for forces and statuses.

mod campaign;
mod case;
mod check;
mod draw;
mod features;
mod known;
mod laws;
mod random;
mod shrink;

pub use campaign::{Campaign, Failure, Feature, Found, Share, campaign};
pub use case::{Case, CaseError, Way};
pub use check::{Checked, Report, check};
pub use draw::draw;
pub use features::features;
pub use known::{KNOWN, Known};
pub use laws::{Broken, Law};
pub use shrink::shrink;
