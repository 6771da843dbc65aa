//! Groups of contacts and their seats in them; blocks and rows of numbers.

use kernels::flat::flat;
use kernels::lane::{Lanes, Real};

/// Three numbers of a contact: along its normal and along two tangents.
pub type Row = [f64; 3];
/// A 3 x 3 block of two contacts, by rows.
pub type Block3 = [Row; 3];

/// Eight numbers of a row.
pub type Chunk = Lanes<8>;
pub(super) const LANES: usize = Chunk::LANES;

/// A group's contacts, and where its numbers are.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Group {
    /// First of its `members`.
    pub(super) first: usize,
    pub(super) count: usize,
    /// Chunks of a row.
    pub(super) width: usize,
    /// First chunk of its matrix, row by row.
    pub(super) matrix: usize,
    /// First chunk of its part of `W dz`.
    pub(super) moved: usize,
    /// The groups of the same set: the first, and the one after the last.
    pub(super) chain: [u32; 2],
}

impl Group {
    /// Whether the set has other groups.
    #[inline(always)]
    pub(super) fn is_linked(&self) -> bool {
        self.chain[1] - self.chain[0] > 1
    }
}

/// A contact's place in a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    pub(super) group: u32,
    pub(super) index: u32,
}

/// No group.
pub(super) const NONE: u32 = u32::MAX;
pub(super) const NOWHERE: Seat = Seat { group: NONE, index: 0 };

/// Chunks of a row of so many contacts.
pub(super) fn width(contacts: usize) -> usize {
    (3 * contacts).div_ceil(LANES)
}

/// W times the changes of impulses: a run of groups.
pub struct Moved<'a> {
    /// The run.
    pub chunks: &'a mut [Chunk],
    /// The first one's place among all.
    pub first: usize,
}

/// Three of the numbers of some chunks.
#[inline(always)]
pub(super) fn three(chunks: &[Chunk], index: usize) -> Row {
    row(flat(chunks), index)
}

/// Three of some numbers.
#[inline(always)]
pub(super) fn row(numbers: &[f64], index: usize) -> Row {
    let numbers = &numbers[3 * index..3 * index + 3];
    [numbers[0], numbers[1], numbers[2]]
}

/// The product of two blocks.
pub(super) fn product(a: &Block3, b: &Block3) -> Block3 {
    a.map(|row| [0, 1, 2].map(|c| row[0] * b[0][c] + row[1] * b[1][c] + row[2] * b[2][c]))
}
