//! Contacts between segments, rigid bodies and obstacles over a step: which are possible, and the gap, the slip and the geometric
//! stiffness of each.
//!
//! - [`narrow_phase`]: what can touch, from the pairs of a spatial hash ([`broad_phase`]); continuous, so that nothing passes through
//!   anything within a step. [`exclusion`]: pairs that cannot touch. [`duplicates`]: contacts at joints of which one holds for both.
//! - [`geometry`]: a contact, evaluated where the bodies are: [`shape`], [`obstacles`], meshes ([`mesh_contacts`], `solid_contacts`).
//!   [`sheath`]: rods inside other rods. [`motion_bound`]: how far a segment moves at most.
//! - [`warm_start`]: what contacts leave to those between the same places. [`overlap`]: overlaps at the start.
//!
//! It knows poses only: not how impulses are found, and no step control. It is internal: programs use
//! `cosserat`.

pub mod broad_phase;
mod convert;
pub mod duplicates;
pub mod exclusion;
pub mod geometry;
pub mod key;
pub mod mesh_contacts;
pub mod motion_bound;
pub mod narrow_phase;
pub mod obstacles;
pub mod overlap;
mod params;
pub mod shape;
pub mod sheath;
mod sheath_contacts;
mod solid_contacts;
mod stiffness;
#[cfg(test)]
mod testing;
pub mod warm_start;

pub use convert::to_nalgebra;
pub use params::NarrowPhaseParams;

/// Below this many contacts of an island, threads cost more than they bring in what is done once an outer iteration.
const PARALLEL_CONTACTS: usize = 256;

/// The grain with which threads share what is done once an outer iteration for so many contacts, if they do
/// ([`kernels::parallel::each`]).
pub fn contacts_grain(contacts: usize) -> Option<usize> {
    (contacts >= PARALLEL_CONTACTS).then_some(PARALLEL_CONTACTS / 4)
}
