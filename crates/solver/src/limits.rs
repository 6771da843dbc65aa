//! Sizes that decide how sets are stepped.

/// Rods that move side by side in one vector register.
pub(crate) const GROUP: usize = 8;
/// Below this many segments in all, threads cost more than they bring.
pub(crate) const PARALLEL_SEGMENTS: usize = 256;
