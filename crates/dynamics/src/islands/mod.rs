//! The contacts of islands: their Delassus operator from how rods respond, their problem once an iteration, what they keep from step to
//! step.
//!
//! A simulation whose model has nothing to touch builds none of this.

mod assemble;
mod bounce;
mod culling;
mod grouping;
mod island_contacts;
mod sets;
mod shared;
#[cfg(test)]
mod testing;

pub(crate) use grouping::Islands;
pub(crate) use island_contacts::IslandContacts;
pub(crate) use sets::Sets;
pub(crate) use shared::Shared;

/// More contacts press at once than there is memory for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooManyContacts;
