//! Sizes that decide how sets are stepped.

/// Below this many segments in all, threads cost more than they bring.
pub(crate) const PARALLEL_SEGMENTS: usize = 256;
/// The same for a piece of an outer iteration, of a microsecond a segment or so: threads fall asleep between two such pieces,
/// and take a tenth of a millisecond to wake.
const PARALLEL_PIECE: usize = 4096;

/// Whether threads share a piece of an outer iteration of so many sets with so many segments in all.
pub(crate) fn shares_piece(sets: usize, segments: usize) -> bool {
    sets > 1 && segments >= PARALLEL_PIECE && rayon::current_num_threads() > 1
}
