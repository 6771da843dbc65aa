//! Wires that hang between two level grips: from photographed shapes to the stiffness of bending, from the twist at which a wire
//! leaves its plane to that of twist.
//!
//! A wire that hangs tells EI over its weight per length, by the length over which it bends at its grips and at its lowest place. Turned
//! at one end about its axis, it stays near its plane until it snaps out of it: Michell's instability (1889) under gravity, which
//! tells GJ / EI.

mod bending;
mod photograph;
mod twist;
mod wire;

pub use bending::{Bent, bending};
pub use photograph::{Photograph, PhotographError, read};
pub use twist::{critical_twist, twist_ratio};
pub use wire::{HangingError, Wire};
