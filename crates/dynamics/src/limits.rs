//! Sizes that decide how sets are stepped.

/// Below this many segments in all, threads cost more than they bring.
pub(crate) const PARALLEL_SEGMENTS: usize = 256;
/// The same for a piece of an outer iteration, of a microsecond a segment or so: threads fall asleep between two such pieces,
/// and take a tenth of a millisecond to wake.
const PARALLEL_PIECE: usize = 4096;

/// The grain with which threads share a piece of an outer iteration over sets with so many segments in all, if they do
/// ([`kernels::parallel::each`]).
pub(crate) fn segments_grain(segments: usize) -> Option<usize> {
    (segments >= PARALLEL_PIECE).then_some(1)
}
