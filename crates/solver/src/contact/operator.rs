//! The Delassus operator `W = J P J^T` by groups of contacts, and what it does to changes of their impulses.
//!
//! All contacts that push one connected set are a group, and a group's contacts are all coupled: its part of W is a dense
//! matrix. A contact between two sets is in two groups, and W is the sum of both parts. Each group's part of `W dz` is kept
//! up to date: a change of one contact's impulse adds three rows of the matrix (W is symmetric), eight numbers to a vector
//! register; contacts whose impulses do not change cost nothing.

use crate::kernel::lane::{Lanes, Real};

pub(crate) type Row = [f64; 3];
pub(crate) type Block3 = [Row; 3];

/// Eight numbers of a row.
pub(crate) type Chunk = Lanes<8>;
const LANES: usize = Chunk::LANES;

/// A group's contacts, and where its numbers are.
#[derive(Clone, Copy, Debug, Default)]
struct Group {
    /// First of its `members`.
    first: usize,
    count: usize,
    /// Chunks of a row.
    width: usize,
    /// First chunk of its matrix, row by row.
    matrix: usize,
    /// First chunk of its part of `W dz`.
    moved: usize,
}

/// A contact's place in a group.
#[derive(Clone, Copy, Debug)]
struct Seat {
    group: u32,
    index: u32,
}

/// No group.
const NONE: u32 = u32::MAX;
const NOWHERE: Seat = Seat { group: NONE, index: 0 };

/// W.
#[derive(Default)]
pub(crate) struct Operator {
    groups: Vec<Group>,
    /// Contacts by group, ascending.
    members: Vec<u32>,
    /// Up to two a contact.
    seats: Vec<[Seat; 2]>,
    values: Vec<Chunk>,
    /// Where each group's begin, and the end.
    cuts: Vec<usize>,
    /// Chunks of `W dz`.
    moved: usize,
    diagonal: Vec<Block3>,
}

/// A group's part of W, while it is put together.
pub(crate) struct Part<'a> {
    width: usize,
    values: &'a mut [Chunk],
}

impl<'a> Part<'a> {
    /// Of so many contacts, in memory that is zero.
    pub(crate) fn new(contacts: usize, values: &'a mut [Chunk]) -> Self {
        Self { width: width(contacts), values }
    }

    /// Adds to the block of two of the group's contacts, by their indices in it, and its transpose to the block on the other side
    /// of the diagonal; where the two are one, `twice` says whether it adds both.
    #[inline(always)]
    pub(crate) fn add(&mut self, (row, column): (usize, usize), block: &Block3, twice: bool) {
        let Self { width, values } = self;
        for r in 0..3 {
            for c in 0..3 {
                let place = 3 * column + c;
                values[(3 * row + r) * *width + place / LANES].0[place % LANES] += block[r][c];
                if row != column || twice {
                    let place = 3 * row + r;
                    values[(3 * column + c) * *width + place / LANES].0[place % LANES] += block[r][c];
                }
            }
        }
    }
}

/// Chunks of a row of so many contacts.
fn width(contacts: usize) -> usize {
    (3 * contacts).div_ceil(LANES)
}

/// W times the changes of impulses: a run of groups.
pub(crate) struct Moved<'a> {
    pub(crate) chunks: &'a mut [Chunk],
    /// The first one's place among all.
    pub(crate) first: usize,
}

#[inline(always)]
fn at(chunks: &[Chunk], place: usize) -> f64 {
    chunks[place / LANES].0[place % LANES]
}

#[inline(always)]
fn three(chunks: &[Chunk], index: usize) -> Row {
    [at(chunks, 3 * index), at(chunks, 3 * index + 1), at(chunks, 3 * index + 2)]
}

impl Operator {
    /// Prepares a matrix of zeros for `contacts` contacts, of which those of each group, ascending in `members` between two
    /// numbers of `start`, are coupled.
    pub(crate) fn reset(&mut self, contacts: usize, start: &[usize], members: &[u32]) {
        self.groups.clear();
        self.members.clear();
        self.members.extend_from_slice(members);
        self.seats.clear();
        self.seats.resize(contacts, [NOWHERE; 2]);
        self.cuts.clear();
        let (mut matrix, mut moved) = (0, 0);
        for (group, ends) in start.windows(2).enumerate() {
            let count = ends[1] - ends[0];
            let width = width(count);
            self.cuts.push(matrix);
            self.groups.push(Group { first: ends[0], count, width, matrix, moved });
            matrix += 3 * count * width;
            moved += width;
            for (index, &contact) in members[ends[0]..ends[1]].iter().enumerate() {
                let seats = &mut self.seats[contact as usize];
                let free = usize::from(seats[0].group != NONE);
                seats[free] = Seat { group: group as u32, index: index as u32 };
            }
        }
        self.cuts.push(matrix);
        self.values.clear();
        self.values.resize(matrix, Chunk::zero());
        self.moved = moved;
        self.diagonal.clear();
        self.diagonal.resize(contacts, [[0.0; 3]; 3]);
    }

    /// Memory of the groups' parts, which are to be put together, and where each begins, and the end.
    pub(crate) fn values(&mut self) -> (&mut [Chunk], &[usize]) {
        (&mut self.values, &self.cuts)
    }

    /// Chunks of `W dz`, of all groups.
    pub(crate) fn moved_len(&self) -> usize {
        self.moved
    }

    /// The first chunk of `W dz` of a group, or of those after it.
    pub(crate) fn moved_from(&self, group: usize) -> usize {
        self.groups.get(group).map_or(self.moved, |group| group.moved)
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
            self.diagonal[contact] = sum;
        }
    }

    /// The block of a contact's own impulse.
    #[inline(always)]
    pub(crate) fn diagonal(&self, contact: usize) -> &Block3 {
        &self.diagonal[contact]
    }

    /// `W dz` of a contact, from that of its groups, of which the first chunk's place among all is `first`.
    #[inline(always)]
    pub(crate) fn moved(&self, contact: usize, chunks: &[Chunk], first: usize) -> Row {
        let mut sum = [0.0; 3];
        for &Seat { group, index } in &self.seats[contact] {
            if group != NONE {
                let Group { width, moved, .. } = self.groups[group as usize];
                let own = three(&chunks[moved - first..moved - first + width], index as usize);
                sum = [sum[0] + own[0], sum[1] + own[1], sum[2] + own[2]];
            }
        }
        sum
    }

    /// Takes a change of a contact's impulse into `W dz` of its groups.
    #[inline(always)]
    pub(crate) fn change(&self, moved: &mut Moved<'_>, contact: usize, by: Row) {
        for seat in self.seats[contact] {
            if seat.group == NONE {
                continue;
            }
            let Group { width, matrix, moved: own, .. } = self.groups[seat.group as usize];
            let first = matrix + 3 * seat.index as usize * width;
            let rows = &self.values[first..first + 3 * width];
            let (a, rest) = rows.split_at(width);
            let (b, c) = rest.split_at(width);
            let [x, y, z] = by.map(Chunk::splat);
            let out = &mut moved.chunks[own - moved.first..own - moved.first + width];
            for (((out, a), b), c) in out.iter_mut().zip(a).zip(b).zip(c) {
                *out += *a * x + *b * y + *c * z;
            }
        }
    }

    #[inline(always)]
    fn block_of(&self, group: usize, row: usize, column: usize) -> Block3 {
        let Group { width, matrix, .. } = self.groups[group];
        let rows = &self.values[matrix + 3 * row * width..][..3 * width];
        [three(&rows[..width], column), three(&rows[width..2 * width], column), three(&rows[2 * width..], column)]
    }

    /// The blocks of a contact's block row with their columns, group by group: a column that is in both groups comes twice, and
    /// its block is the sum.
    #[inline(always)]
    pub(crate) fn each_block(&self, contact: usize, mut take: impl FnMut(usize, &Block3)) {
        for &Seat { group, index } in self.seats[contact].iter().filter(|seat| seat.group != NONE) {
            let Group { first, count, .. } = self.groups[group as usize];
            for (column, &other) in self.members[first..first + count].iter().enumerate() {
                take(other as usize, &self.block_of(group as usize, index as usize, column));
            }
        }
    }

    /// The contacts coupled to one, ascending from the contact `from` on, with their places in its groups.
    pub(crate) fn coupled(&self, contact: usize, from: usize) -> Coupled<'_> {
        let list = |Seat { group, .. }: Seat| match group {
            NONE => (&[][..], 0),
            group => {
                let Group { first, count, .. } = self.groups[group as usize];
                let members = &self.members[first..first + count];
                (members, members.partition_point(|&other| (other as usize) < from))
            }
        };
        Coupled { lists: self.seats[contact].map(list) }
    }

    /// The block of a contact and one that [`Operator::coupled`] names.
    #[inline]
    pub(crate) fn block(&self, contact: usize, places: [Option<usize>; 2]) -> Block3 {
        let mut sum = [[0.0; 3]; 3];
        for (seat, place) in self.seats[contact].iter().zip(places) {
            if let Some(place) = place {
                let block = self.block_of(seat.group as usize, seat.index as usize, place);
                for (sum, x) in sum.iter_mut().flatten().zip(block.iter().flatten()) {
                    *sum += x;
                }
            }
        }
        sum
    }

    /// The response of the two along both normals.
    pub(crate) fn normals(&self, contact: usize, places: [Option<usize>; 2]) -> f64 {
        let mut sum = 0.0;
        for (seat, place) in self.seats[contact].iter().zip(places) {
            if let Some(place) = place {
                let Group { width, matrix, .. } = self.groups[seat.group as usize];
                sum += at(&self.values[matrix + 3 * seat.index as usize * width..], 3 * place);
            }
        }
        sum
    }
}

/// Contacts coupled to one: their numbers and their places in its two groups.
pub(crate) struct Coupled<'a> {
    lists: [(&'a [u32], usize); 2],
}

impl Iterator for Coupled<'_> {
    type Item = (usize, [Option<usize>; 2]);

    fn next(&mut self) -> Option<Self::Item> {
        let heads = self.lists.map(|(members, place)| members.get(place).copied());
        let next = match heads {
            [Some(a), Some(b)] => a.min(b),
            [Some(a), None] | [None, Some(a)] => a,
            [None, None] => return None,
        };
        let mut places = [None; 2];
        for ((place, head), (_, at)) in places.iter_mut().zip(heads).zip(&mut self.lists) {
            if head == Some(next) {
                *place = Some(*at);
                *at += 1;
            }
        }
        Some((next as usize, places))
    }
}
