//! The products and blocks of W between different groups of one set, over the bodies between them.

use super::Delassus;
use super::group::{Block3, Chunk, Group, Moved, NONE, Seat};
use super::linked::Linked;

impl Delassus {
    /// What a group of a set that has several does to the others.
    #[inline(always)]
    pub(super) fn linked(&self, group: usize) -> Linked<'_> {
        let Group { count, width, matrix, moved, .. } = self.groups[group];
        let first = matrix + 3 * count * width;
        Linked { chunks: &self.values[first..first + Linked::len(count)], state: moved + width }
    }

    /// Takes a change into what the other groups of its set see of it.
    #[inline(always)]
    pub(super) fn change_far(&self, moved: &mut Moved<'_>, Seat { group, index }: Seat, by: [Chunk; 3]) {
        let [first, end] = self.groups[group as usize].chain.map(|group| group as usize);
        let (own, index) = (group as usize, index as usize);
        let linked = self.linked(own);
        let mut goes_on = linked.to_last(index, by);
        for group in own + 1..end {
            let other = self.linked(group);
            moved.chunks[other.state - moved.first] += goes_on;
            if group + 1 < end {
                goes_on = other.follow(goes_on);
            }
        }
        let mut goes_back = linked.to_before(index, by);
        for group in (first..own).rev() {
            let other = self.linked(group);
            moved.chunks[other.state + 1 - moved.first] += goes_back;
            if group > first {
                goes_back = other.pass(goes_back);
            }
        }
    }

    /// The blocks of a contact and those of other groups of its set.
    pub(super) fn each_far_block(&self, Seat { group, index }: Seat, take: &mut impl FnMut(usize, &Block3)) {
        let [first, end] = self.groups[group as usize].chain.map(|group| group as usize);
        let own = group as usize;
        let mut each = |group: usize, of: &dyn Fn(&Linked<'_>, usize) -> Block3| {
            let Group { first, count, .. } = self.groups[group];
            for (index, &other) in self.members[first..first + count].iter().enumerate() {
                take(other as usize, &of(&self.linked(group), index));
            }
        };
        let mut columns = self.linked(own).columns_to_last(index as usize);
        for group in own + 1..end {
            each(group, &|linked, index| linked.block_from_before(index, &columns));
            columns = columns.map(|column| self.linked(group).follow(column));
        }
        let mut columns = self.linked(own).columns_to_before(index as usize);
        for group in (first..own).rev() {
            each(group, &|linked, index| linked.block_to_last(index, &columns));
            columns = columns.map(|column| self.linked(group).pass(column));
        }
    }

    /// The block of two seats in different groups of one set.
    pub(super) fn far_block(&self, one: Seat, other: Seat) -> Option<Block3> {
        if one.group == NONE || other.group == NONE || one.group == other.group {
            return None;
        }
        let [first, end] = self.groups[one.group as usize].chain;
        if !(first..end).contains(&other.group) {
            return None;
        }
        let (early, late) = if one.group < other.group { (one, other) } else { (other, one) };
        let mut columns = self.linked(early.group as usize).columns_to_last(early.index as usize);
        for group in early.group + 1..late.group {
            columns = columns.map(|column| self.linked(group as usize).follow(column));
        }
        let block = self.linked(late.group as usize).block_from_before(late.index as usize, &columns);
        Some(if one.group < other.group { block } else { transposed(&block) })
    }
}

fn transposed(block: &Block3) -> Block3 {
    [0, 1, 2].map(|r| [0, 1, 2].map(|c| block[c][r]))
}
