//! Sizes that decide how sets are stepped.

/// Rods that move side by side in one vector register.
pub(crate) const GROUP: usize = 8;
/// Below this many segments in all, threads cost more than they bring.
pub(crate) const PARALLEL_SEGMENTS: usize = 256;

/// Gap of a joint in its lengths, or angle by which it is askew [rad], from which on the joint is apart.
pub(crate) const APART: f64 = 0.1;
