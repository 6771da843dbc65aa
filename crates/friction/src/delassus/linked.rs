//! What the groups of a set whose bodies form chains do to each other: by E, R and M of `linear/articulated/blocks.rs`.
//!
//! Beside its part of `W dz` each group keeps a state of two times six numbers: how the last body of the group before moves by what
//! pushes all groups before, and what is passed back to its own last body from all groups after. A change of an impulse goes on from group
//! to group, 36 products each, and a contact reads its gap and slip off its group's state.

use kernels::lane::{Lanes, Real};

use super::group::{Block3, Chunk, Row};

/// Chunks of a contact: three columns of E, three rows of R; then, to read off, for each of the six numbers of a state what R
/// and E make of it, in the lower and the upper half of a chunk.
const CONTACT: usize = 12;
/// Chunks of M: its columns, then its rows.
const PASSAGE: usize = 12;

/// A group's E, R and M.
pub(super) struct Linked<'a> {
    pub(super) chunks: &'a [Chunk],
    /// Where its state is in `W dz`.
    pub(super) state: usize,
}

/// A group's E, R and M, while they are put together.
pub struct Links<'a>(pub(super) &'a mut [Chunk]);

impl Links<'_> {
    /// Adds the columns of E and the rows of R of a side of one of its contacts.
    pub fn add_side(&mut self, index: usize, to_last: [Chunk; 3], from_before: [Chunk; 3]) {
        let own = &mut self.0[CONTACT * index..CONTACT * (index + 1)];
        for (own, &side) in own.iter_mut().zip(to_last.iter().chain(&from_before)) {
            *own += side;
        }
        for (k, read) in own[6..].iter_mut().enumerate() {
            let [a, b, c] = from_before.map(|row| row.0[k]);
            let [d, e, f] = to_last.map(|column| column.0[k]);
            *read += Lanes([a, b, c, 0.0, d, e, f, 0.0]);
        }
    }

    /// Sets M by its rows.
    pub fn set_passage(&mut self, rows: &[Chunk; 6]) {
        let first = self.0.len() - PASSAGE;
        let own = &mut self.0[first..];
        own[6..].copy_from_slice(rows);
        for (k, column) in own[..6].iter_mut().enumerate() {
            for (out, row) in column.0.iter_mut().zip(rows) {
                *out = row.0[k];
            }
        }
    }
}

impl Linked<'_> {
    /// Chunks of a group's state.
    pub(super) const STATE: usize = 2;

    /// Chunks of a group of so many contacts.
    pub(super) fn len(contacts: usize) -> usize {
        CONTACT * contacts + PASSAGE
    }

    #[inline(always)]
    fn of(&self, index: usize) -> &[Chunk] {
        &self.chunks[CONTACT * index..CONTACT * (index + 1)]
    }

    /// What changes of a contact's impulse do to the last body of the group.
    #[inline(always)]
    pub(super) fn to_last(&self, index: usize, [x, y, z]: [Chunk; 3]) -> Chunk {
        let own = self.of(index);
        own[0] * x + own[1] * y + own[2] * z
    }

    /// What of them the last body of the group before feels.
    #[inline(always)]
    pub(super) fn to_before(&self, index: usize, [x, y, z]: [Chunk; 3]) -> Chunk {
        let own = self.of(index);
        own[3] * x + own[4] * y + own[5] * z
    }

    /// How the group's last body follows the one of the group before: M times a column.
    #[inline(always)]
    pub(super) fn follow(&self, column: Chunk) -> Chunk {
        combine(&self.chunks[self.chunks.len() - PASSAGE..][..6], column)
    }

    /// What the last body of the group before feels of what its own feels: a row times M.
    #[inline(always)]
    pub(super) fn pass(&self, row: Chunk) -> Chunk {
        combine(&self.chunks[self.chunks.len() - PASSAGE..][6..], row)
    }

    /// What other groups' impulses do to gap and slip of a contact, by the states in `chunks`, whose first one's place among all is `first`.
    #[inline(always)]
    pub(super) fn moved(&self, index: usize, chunks: &[Chunk], first: usize) -> Row {
        let (read, state) = (&self.of(index)[6..], &chunks[self.state - first..][..Self::STATE]);
        let mut sum = Chunk::zero();
        for (k, read) in read.iter().enumerate() {
            let (a, b) = (state[0].0[k], state[1].0[k]);
            sum += *read * Lanes([a, a, a, a, b, b, b, b]);
        }
        let [a, b, c, _, d, e, f, _] = sum.0;
        [a + d, b + e, c + f]
    }

    /// What unit impulses of a contact do to the last body of the group, a column each.
    pub(super) fn columns_to_last(&self, index: usize) -> [Chunk; 3] {
        let own = self.of(index);
        [own[0], own[1], own[2]]
    }

    /// What of them the last body of the group before feels, a row each.
    pub(super) fn columns_to_before(&self, index: usize) -> [Chunk; 3] {
        let own = self.of(index);
        [own[3], own[4], own[5]]
    }

    /// The block of a contact of an earlier group, which moves the last body of the group before by these columns, and one of this group.
    pub(super) fn block_from_before(&self, index: usize, columns: &[Chunk; 3]) -> Block3 {
        let own = self.of(index);
        columns.map(|column| [3, 4, 5].map(|k| sum(own[k] * column)))
    }

    /// The block of a contact of a later group, of which the group's last body feels these rows, and one of this group.
    pub(super) fn block_to_last(&self, index: usize, rows: &[Chunk; 3]) -> Block3 {
        let own = self.of(index);
        rows.map(|row| [0, 1, 2].map(|k| sum(own[k] * row)))
    }
}

/// The sum of six columns, each times a number of `by`.
#[inline(always)]
fn combine(columns: &[Chunk], by: Chunk) -> Chunk {
    let mut sum = Chunk::zero();
    for (&column, &by) in columns.iter().zip(&by.0) {
        sum += column * Chunk::splat(by);
    }
    sum
}

/// The sum of a chunk's numbers, in pairs.
#[inline(always)]
fn sum(chunk: Chunk) -> f64 {
    let [a, b, c, d, e, f, ..] = chunk.0;
    ((a + b) + (c + d)) + (e + f)
}
