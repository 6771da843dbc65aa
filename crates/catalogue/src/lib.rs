//! Every guess by its name, ready for use: those without learning, nearest neighbours and COPINGNet's networks.
//!
//! A [`GuessName`] is what a user writes. [`Training`] says what a learned one learned from, [`Guess::load`] gets what it
//! needs (a data set, a network), and [`Guess::factory`] makes one for each connected set of segments. Networks come in
//! with the cargo feature `gn`; those of the folder `checkpoints` are part of the program then.

mod guess;
mod name;
#[cfg(feature = "gn")]
mod network;
mod rows;
mod sources;
mod start;
mod training;

pub use guess::{Guess, Learned, Origin, plane};
pub use name::{GuessName, LearnedName, Recipe};
#[cfg(feature = "gn")]
pub use network::{Network, built_in};
pub use rows::{NetworkOf, Row, load, networks, rows};
pub use sources::Sources;
pub use start::learned_start;
pub use training::{Training, fitting};
