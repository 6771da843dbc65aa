//! Contacts between segments and with obstacles: what is possible in a step, and the impulses that keep bodies apart.
//!
//! A simulation whose model has nothing to touch builds none of this.

mod assemble;
mod broad_phase;
mod convert;
mod culling;
mod duplicates;
mod exclusion;
mod geometry;
mod island_contacts;
mod islands;
mod key;
mod mesh_contacts;
mod motion_bound;
mod narrow_phase;
mod obstacles;
mod overlap;
mod sets;
mod shape;
mod shared;
mod solid_contacts;
mod stiffness;
#[cfg(test)]
mod testing;
mod warm_start;

pub use overlap::{Overlap, Overlapped};

pub(crate) use duplicates::share_ends;
pub(crate) use exclusion::PairFilter;
pub(crate) use island_contacts::IslandContacts;
pub(crate) use islands::Islands;
pub(crate) use motion_bound::MotionBounds;
pub(crate) use overlap::refuse_overlaps;
pub(crate) use sets::Sets;
pub(crate) use shape::Shape;
pub(crate) use shared::Shared;

/// More contacts press at once than there is memory for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooManyContacts;
