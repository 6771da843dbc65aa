//! Every guess by its name, ready for use: those without learning, nearest neighbours and COPINGNet's networks.
//!
//! A [`GuessName`] is what a user writes. [`Training`] says what a learned one learned from, [`Guess::load`] gets what it
//! needs (a data set, a network), and [`Guess::factory`] makes one for each connected set of segments. Networks come in
//! with the cargo feature `gn`; those of the folder `checkpoints` are part of the program then.

mod fitting;
mod guess;
mod name;
#[cfg(feature = "gn")]
mod network;
mod origin;
mod training;
mod warnings;

pub use fitting::{fitting, learned_start};
pub use guess::{Guess, Projections, Row, load, plane, rows};
pub use name::{GuessName, Recipe};
#[cfg(feature = "gn")]
pub use network::{Network, built_in};
pub use origin::Origin;
pub use training::{Sources, Training};
