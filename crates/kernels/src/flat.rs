//! Lanes side by side as the numbers they are.
//!
//! A loop over lanes, each of them eight numbers, is compiled to one that gathers a number of each of eight lanes; one over numbers is not.
#![allow(unsafe_code)]

use crate::lane::Lanes;

/// Numbers of a chunk.
const LANES: usize = 8;

const _: () = assert!(size_of::<Lanes<LANES>>() == LANES * size_of::<f64>());

/// The numbers of some chunks, one chunk after the other.
#[inline(always)]
pub fn flat(chunks: &[Lanes<LANES>]) -> &[f64] {
    // SAFETY: each chunk is an array of so many numbers and nothing else, as its size says (above), so that a slice of chunks is so
    // many times as many numbers side by side; they are borrowed as the slice is.
    unsafe { std::slice::from_raw_parts(chunks.as_ptr().cast(), LANES * chunks.len()) }
}

/// The same, to be changed.
#[inline(always)]
pub fn flat_mut(chunks: &mut [Lanes<LANES>]) -> &mut [f64] {
    // SAFETY: as above; any number may be in a chunk.
    unsafe { std::slice::from_raw_parts_mut(chunks.as_mut_ptr().cast(), LANES * chunks.len()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_chunks_in_turn() {
        let mut chunks = [[0.0; LANES]; 3].map(Lanes);
        for (k, number) in (0..).zip(flat_mut(&mut chunks)) {
            *number = f64::from(k);
        }
        assert_eq!(chunks[1].0, [8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0]);
        assert_eq!((flat(&chunks).len(), flat(&chunks[2..])[7], flat(&chunks[..0]).len()), (24, 23.0, 0));
    }
}
