//! Random scenes, and the laws of mechanics that every run of them must keep: a fuzzer with oracles.
//!
//! [`draw()`] makes a valid scene file of documented features at random, [`check()`] runs it and holds each step against the
//! [`Law`]s, and [`shrink()`] cuts a case that breaks one down to a small case that still does. [`campaign()`] does all three
//! for many scenes on several threads. What a law allows follows from the order of the time step and from documented
//! tolerances. Of the solver the laws take states, forces and statuses; all else they compute themselves.

mod campaign;
mod case;
mod check;
mod draw;
mod exclusion;
mod law;
mod laws;
mod random;
mod shrink;
mod step;

pub use campaign::{Failure, Found, campaign};
pub use case::{Case, CaseError, Method};
pub use check::{Checked, Report, check};
pub use draw::draw;
pub use law::{Law, Violation};
pub use shrink::shrink;
