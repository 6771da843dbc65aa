//! Contacts between segments and with obstacles: what is possible in a step, and the impulses that keep bodies apart.
//!
//! A simulation whose model has nothing to touch builds none of this.

mod anderson;
mod buckets;
mod cone;
mod convert;
mod coupling;
mod detect;
mod exclusion;
mod force;
mod geometry;
mod halves;
mod impulses;
mod islands;
mod key;
mod memory;
mod newton;
mod obstacles;
mod operator;
mod overlap;
mod parts;
mod problem;
mod reach;
mod rounds;
mod search;
mod sets;
mod shared;
mod shared_ends;
mod solids;
mod stage;
mod stiffness;
#[cfg(test)]
mod testing;
mod twins;

pub use force::{ContactForce, Touched, contact_wrenches};
pub use overlap::{Overlap, Overlapped};

pub(crate) use exclusion::PairFilter;
pub(crate) use geometry::Shape;
pub(crate) use islands::Islands;
pub(crate) use overlap::refuse_overlaps;
pub(crate) use reach::Ways;
pub(crate) use sets::Sets;
pub(crate) use shared::Shared;
pub(crate) use shared_ends::share_ends;
pub(crate) use stage::{Stage, Touching};

/// More contacts press at once than there is memory for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooManyContacts;
