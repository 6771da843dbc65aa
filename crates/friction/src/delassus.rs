//! The Delassus operator `W = J P J^T` by groups of contacts, and what it does to changes of their impulses.
//!
//! All contacts that push one connected set are a group, and a group's contacts are all coupled: its part of W is a dense
//! matrix. A contact between two sets is in two groups, and W is the sum of both parts. Each group's part of `W dz` is kept
//! up to date: a change of one contact's impulse adds three rows of the matrix (W is symmetric), eight numbers to a vector
//! register; contacts whose impulses do not change cost nothing.
//!
//! Where many contacts push a set whose bodies form chains, blocks of neighbours along it are a group each, and what groups do to
//! each other goes through the bodies between them (`delassus/linked.rs`, `delassus/others.rs`).

mod group;
mod linked;
mod others;

use kernels::flat::{flat, flat_mut};
use kernels::lane::Real;

use self::group::{Group, LANES, NONE, NOWHERE, Seat, product, row, three, width};
use self::linked::{Linked, Links};

pub use self::group::{Block3, Chunk, Moved, Row};

/// W.
#[derive(Default)]
pub struct Delassus {
    groups: Vec<Group>,
    /// Contacts by group, ascending.
    members: Vec<u32>,
    /// Up to two a contact.
    seats: Vec<[Seat; 2]>,
    values: Vec<Chunk>,
    /// First group of each set, and the end; where each set's `values` begin, and the end.
    sets: Vec<usize>,
    cuts: Vec<usize>,
    /// Chunks of `W dz`.
    moved: usize,
    diagonal: Vec<Block3>,
}

/// A group's part of W, while it is put together.
pub struct Part<'a> {
    width: usize,
    values: &'a mut [Chunk],
    /// What it does to other groups of its set, if there are any.
    links: Links<'a>,
}

impl<'a> Part<'a> {
    /// Of so many contacts, in the first of these chunks, which are zero; and the rest of them.
    pub fn new(contacts: usize, is_linked: bool, values: &'a mut [Chunk]) -> (Self, &'a mut [Chunk]) {
        let width = width(contacts);
        let (values, rest) = values.split_at_mut(3 * contacts * width);
        let (links, rest) = rest.split_at_mut(if is_linked { Linked::len(contacts) } else { 0 });
        (Self { width, values, links: Links(links) }, rest)
    }

    /// What it does to other groups of its set.
    pub fn links(&mut self) -> &mut Links<'a> {
        &mut self.links
    }

    /// Adds to the block of two of the group's contacts, by their indices in it, and its transpose to the block on the other side
    /// of the diagonal; where the two are one, `twice` says whether it adds both.
    #[inline(always)]
    pub fn add(&mut self, (row, column): (usize, usize), block: &Block3, twice: bool) {
        let (width, values) = (LANES * self.width, flat_mut(self.values));
        for (r, entries) in block.iter().enumerate() {
            let first = (3 * row + r) * width + 3 * column;
            for (value, entry) in values[first..first + 3].iter_mut().zip(entries) {
                *value += entry;
            }
        }
        if row != column || twice {
            for c in 0..3 {
                let first = (3 * column + c) * width + 3 * row;
                for (value, entries) in values[first..first + 3].iter_mut().zip(block) {
                    *value += entries[c];
                }
            }
        }
    }
}

impl Delassus {
    /// Prepares a matrix for `contacts` contacts, of which those of each group, ascending in `members` between two
    /// numbers of `start`, are coupled, and those of all groups of a set: from one number of `sets` on to the next. A contact is
    /// in two groups at most.
    pub fn reset(&mut self, contacts: usize, start: &[usize], members: &[u32], sets: &[usize]) {
        self.groups.clear();
        self.members.clear();
        self.members.extend_from_slice(members);
        self.seats.clear();
        self.seats.resize(contacts, [NOWHERE; 2]);
        self.sets.clear();
        self.sets.extend_from_slice(sets);
        self.cuts.clear();
        let (mut matrix, mut moved) = (0, 0);
        for set in sets.windows(2) {
            self.cuts.push(matrix);
            for group in set[0]..set[1] {
                let (first, count) = (start[group], start[group + 1] - start[group]);
                let width = width(count);
                let own = Group { first, count, width, matrix, moved, chain: [set[0] as u32, set[1] as u32] };
                matrix += 3 * count * width + if own.is_linked() { Linked::len(count) } else { 0 };
                moved += width + if own.is_linked() { Linked::STATE } else { 0 };
                self.groups.push(own);
                for (index, &contact) in members[first..first + count].iter().enumerate() {
                    let seats = &mut self.seats[contact as usize];
                    let free = usize::from(seats[0].group != NONE);
                    seats[free] = Seat { group: group as u32, index: index as u32 };
                }
            }
        }
        self.cuts.push(matrix);
        self.values.resize(matrix, Chunk::zero());
        self.moved = moved;
        self.diagonal.clear();
        self.diagonal.resize(contacts, [[0.0; 3]; 3]);
    }

    /// Memory of the sets' parts, group by group, which are to be put together from zeros, and where each set's begins, and the end.
    pub fn values(&mut self) -> (&mut [Chunk], &[usize]) {
        (&mut self.values, &self.cuts)
    }

    /// Chunks of `W dz`, of all groups.
    pub fn moved_len(&self) -> usize {
        self.moved
    }

    /// The first chunk of `W dz` of a set, or of those after it.
    pub(crate) fn moved_from(&self, set: usize) -> usize {
        self.sets.get(set).and_then(|&group| self.groups.get(group)).map_or(self.moved, |group| group.moved)
    }

    /// Sums the blocks of contacts' own impulses, after all entries are there.
    pub(crate) fn close(&mut self) {
        for contact in 0..self.seats.len() {
            let mut sum = [[0.0; 3]; 3];
            for &Seat { group, index } in self.seats[contact].iter().filter(|seat| seat.group != NONE) {
                let block = self.block_of(group as usize, index as usize, index as usize);
                for (sum, x) in sum.iter_mut().flatten().zip(block.iter().flatten()) {
                    *sum += x;
                }
            }
            let [one, other] = self.seats[contact];
            if let Some(block) = self.far_block(one, other) {
                for (r, c) in (0..9).map(|k| (k / 3, k % 3)) {
                    sum[r][c] += block[r][c] + block[c][r];
                }
            }
            self.diagonal[contact] = sum;
        }
    }

    /// The block of a contact's own impulse.
    #[inline(always)]
    pub fn diagonal(&self, contact: usize) -> &Block3 {
        &self.diagonal[contact]
    }

    /// `W dz` of a contact, from that of its groups, of which the first chunk's place among all is `first`.
    #[inline(always)]
    pub fn moved(&self, contact: usize, chunks: &[Chunk], first: usize) -> Row {
        let mut sum = [0.0; 3];
        for &Seat { group, index } in &self.seats[contact] {
            if group != NONE {
                let own = &self.groups[group as usize];
                let Group { width, moved, .. } = *own;
                let from = three(&chunks[moved - first..moved - first + width], index as usize);
                sum = [sum[0] + from[0], sum[1] + from[1], sum[2] + from[2]];
                if own.is_linked() {
                    let far = self.linked(group as usize).moved(index as usize, chunks, first);
                    sum = [sum[0] + far[0], sum[1] + far[1], sum[2] + far[2]];
                }
            }
        }
        sum
    }

    /// Takes a change of a contact's impulse into `W dz` of its groups.
    #[inline(always)]
    pub fn change(&self, moved: &mut Moved<'_>, contact: usize, by: Row) {
        for seat in self.seats[contact] {
            if seat.group == NONE {
                continue;
            }
            let group = &self.groups[seat.group as usize];
            let Group { width, matrix, moved: own, .. } = *group;
            let first = matrix + 3 * seat.index as usize * width;
            let rows = flat(&self.values[first..first + 3 * width]);
            let (a, rest) = rows.split_at(LANES * width);
            let (b, c) = rest.split_at(LANES * width);
            let out = flat_mut(&mut moved.chunks[own - moved.first..own - moved.first + width]);
            for (((out, a), b), c) in out.iter_mut().zip(a).zip(b).zip(c) {
                *out += a * by[0] + b * by[1] + c * by[2];
            }
            if group.is_linked() {
                self.change_far(moved, seat, by.map(Chunk::splat));
            }
        }
    }

    #[inline(always)]
    fn block_of(&self, group: usize, row: usize, column: usize) -> Block3 {
        let Group { width, matrix, .. } = self.groups[group];
        let rows = &self.values[matrix + 3 * row * width..][..3 * width];
        [three(&rows[..width], column), three(&rows[width..2 * width], column), three(&rows[2 * width..], column)]
    }

    /// `by` times the blocks of a contact's block row, with their columns, group by group: a column that is in both groups comes
    /// twice, and its block is the sum. `memory` holds the products of a group.
    #[inline(always)]
    pub fn each_product(
        &self,
        contact: usize,
        by: &Block3,
        memory: &mut Vec<f64>,
        mut take: impl FnMut(usize, Block3),
    ) {
        for &Seat { group, index } in self.seats[contact].iter().filter(|seat| seat.group != NONE) {
            let Group { first, count, width, matrix, .. } = self.groups[group as usize];
            let rows = flat(&self.values[matrix + 3 * index as usize * width..][..3 * width]);
            let ([a, b, c], length) = ([0, 1, 2].map(|r| &rows[r * LANES * width..][..3 * count]), 3 * count);
            memory.resize(3 * length, 0.0);
            for (out, by) in memory.chunks_exact_mut(length).zip(by) {
                for (((out, a), b), c) in out.iter_mut().zip(a).zip(b).zip(c) {
                    *out = a * by[0] + b * by[1] + c * by[2];
                }
            }
            for (column, &other) in self.members[first..first + count].iter().enumerate() {
                take(other as usize, [0, 1, 2].map(|r| row(&memory[r * length..], column)));
            }
            if self.groups[group as usize].is_linked() {
                self.each_far_block(Seat { group, index }, &mut |other, block| take(other, product(by, block)));
            }
        }
    }

    /// The block of two contacts.
    pub fn block(&self, contact: usize, other: usize) -> Block3 {
        let mut sum = [[0.0; 3]; 3];
        let mut add = |block: &Block3| {
            for (sum, x) in sum.iter_mut().flatten().zip(block.iter().flatten()) {
                *sum += x;
            }
        };
        self.each_pair(contact, other, |one, other| match other.group == one.group {
            true => add(&self.block_of(one.group as usize, one.index as usize, other.index as usize)),
            false => _ = self.far_block(one, other).map(|block| add(&block)),
        });
        sum
    }

    /// The contacts after one in its groups, ascending, with the response of the two along both normals.
    pub fn normals(&self, contact: usize) -> impl Iterator<Item = (usize, f64)> {
        let after = |Seat { group, index }: Seat| match group {
            NONE => (&[][..], &[][..]),
            group => {
                let Group { first, count, width, matrix, .. } = self.groups[group as usize];
                let (index, next) = (index as usize, index as usize + 1);
                let row = flat(&self.values[matrix + 3 * index * width..][..width]);
                (&self.members[first + next..first + count], &row[3 * next..])
            }
        };
        let mut lists = self.seats[contact].map(after);
        let is_linked = |seat: &Seat| seat.group != NONE && self.groups[seat.group as usize].is_linked();
        let is_linked = self.seats[contact].iter().any(is_linked);
        std::iter::from_fn(move || {
            let next = lists.iter().filter_map(|(members, _)| members.first()).min().copied()?;
            let mut sum = 0.0;
            for (members, row) in lists.iter_mut().filter(|(members, _)| members.first() == Some(&next)) {
                sum += row[0];
                (*members, *row) = (&members[1..], &row[3..]);
            }
            if is_linked {
                self.each_pair(contact, next as usize, |one, other| {
                    sum += self.far_block(one, other).map_or(0.0, |block| block[0][0]);
                });
            }
            Some((next as usize, sum))
        })
    }

    /// Pairs of seats of two contacts.
    #[inline(always)]
    fn each_pair(&self, contact: usize, other: usize, mut take: impl FnMut(Seat, Seat)) {
        for &one in self.seats[contact].iter().filter(|seat| seat.group != NONE) {
            for &other in self.seats[other].iter().filter(|seat| seat.group != NONE) {
                take(one, other);
            }
        }
    }
}
