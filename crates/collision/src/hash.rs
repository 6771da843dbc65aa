//! All pairs of overlapping boxes by hierarchical spatial hashing, after Eitz and Gu 2007, "Hierarchical Spatial Hashing for
//! Real-time Collision Detection".
//!
//! A box belongs to the level whose cells are the smallest power of two above its largest extent, so that it lies in at
//! most two cells along each axis. It is entered into all of these, up to eight. Pairs of a level share a cell; a pair of two
//! levels is found where the smaller box is looked up among the larger cells. Only levels with boxes are looked up.
//!
//! *Each pair once.* The lower corner of what two boxes have in common lies in one cell. On each axis it is the first cell
//! of one of the boxes or of both, so a pair counts in that cell where no axis has both boxes in their second one: three
//! bits of each box, whose conjunction must be zero.
//!
//! *Cells without keys.* Different cells may share a slot of the table. Boxes that overlap have cells at most two apart, so
//! that the cells' coordinates modulo four tell whether the cells are the same.
//!
//! *Locality.* Blocks of 4 x 4 x 4 cells are hashed, and a block's cells lie side by side in the table.

mod grid;

use std::ops::Range;

use crate::shape::Aabb;
use grid::{Grid, Table};

/// A box in one of its cells. Rounded to f32 a box still overlaps all that it overlapped, as rounding keeps the order.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    /// Lower corner, then the upper one negated.
    bounds: [f32; 6],
    index: u32,
    /// Level, cell modulo four, and whether it is the box's second cell, by axis.
    tag: u32,
}

/// The hash, with memory that is kept from one use to the next: nothing is allocated for as many boxes as before.
#[derive(Clone, Debug, Default)]
pub struct SpatialHash {
    boxes: Vec<Aabb>,
    grid: Grid,
    table: Table,
    /// Where each slot's entries begin, and the end of the last one's.
    starts: Vec<u32>,
    /// By slot, within a slot by box.
    entries: Vec<Entry>,
}

impl SpatialHash {
    /// A hash without boxes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes new boxes, at most 2^29. One that is not finite, or has `min > max`, overlaps nothing.
    pub fn rebuild(&mut self, boxes: &[Aabb]) {
        self.boxes.clear();
        self.boxes.extend_from_slice(boxes);
        self.grid.rebuild(boxes);
        self.table = Table::new(boxes.len());
        self.starts.clear();
        self.starts.resize(self.table.slots() + 1, 0);
        for index in 0..boxes.len() {
            if let Some(cells) = self.grid.cells(boxes, index) {
                cells.for_each(|cell, _| self.starts[self.table.slot(&cell)] += 1);
            }
        }
        // Ends of the slots; they become their starts while these fill from the end.
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.entries.resize(end as usize, Entry::default());
        // Far from zero f32 would have no digits left for small boxes.
        let origin = self.grid.first().map_or(Default::default(), |first| boxes[first].min);
        for (index, aabb) in boxes.iter().enumerate().rev() {
            let Some(cells) = self.grid.cells(boxes, index) else { continue };
            let (min, max) = (aabb.min - origin, aabb.max - origin);
            let bounds = [min.x, min.y, min.z, -max.x, -max.y, -max.z].map(|x| x as f32);
            cells.for_each(|cell, second| {
                let start = &mut self.starts[self.table.slot(&cell)];
                *start -= 1;
                self.entries[*start as usize] = Entry { bounds, index: index as u32, tag: cell.tag() | second };
            });
        }
    }

    /// Appends all pairs `[i, j]`, i < j, of overlapping boxes which `keep(i, j)` wants, each once. Their order is a
    /// function of the boxes alone; it is that of space rather than that of i, so that what is read for one pair is likely
    /// to be needed for the next.
    pub fn pairs(&self, mut keep: impl FnMut(u32, u32) -> bool, out: &mut Vec<[u32; 2]>) {
        let mut found = |i: u32, j: u32| {
            let (i, j) = (i.min(j), i.max(j));
            if self.boxes[i as usize].overlaps(&self.boxes[j as usize]) && keep(i, j) {
                out.push([i, j]);
            }
        };
        for range in self.starts.windows(2) {
            let entries = &self.entries[range[0] as usize..range[1] as usize];
            for (k, entry) in entries.iter().enumerate() {
                let bounds = reversed(&entry.bounds);
                for other in &entries[k + 1..] {
                    if below(&other.bounds, &bounds) && same_cell(other.tag, entry.tag) {
                        found(entry.index, other.index);
                    }
                }
                if entry.tag & 7 == 0 {
                    self.larger(entry, &bounds, &mut found);
                }
            }
        }
    }

    /// Pairs of a box with those of coarser levels.
    #[inline]
    fn larger(&self, entry: &Entry, bounds: &[f32; 6], found: &mut impl FnMut(u32, u32)) {
        let levels = self.grid.coarser(grid::rank(entry.tag));
        if levels.is_empty() {
            return;
        }
        let Some(cells) = self.grid.cells(&self.boxes, entry.index as usize) else { return };
        for level in levels {
            self.grid.coarsened(&cells, level).for_each(|cell, second| {
                let tag = cell.tag() | second;
                for other in &self.entries[self.range(self.table.slot(&cell))] {
                    if below(&other.bounds, bounds) && same_cell(other.tag, tag) {
                        found(entry.index, other.index);
                    }
                }
            });
        }
    }

    #[inline]
    fn range(&self, slot: usize) -> Range<usize> {
        self.starts[slot] as usize..self.starts[slot + 1] as usize
    }
}

/// Upper corner, then the lower one negated: what another's bounds must not exceed if both overlap.
#[inline]
fn reversed(bounds: &[f32; 6]) -> [f32; 6] {
    let [a, b, c, d, e, f] = bounds.map(|x| -x);
    [d, e, f, a, b, c]
}

#[inline]
fn below(a: &[f32; 6], b: &[f32; 6]) -> bool {
    // All are compared: jumps that cannot be predicted cost more.
    (0..6).fold(true, |all, k| all & (a[k] <= b[k]))
}

/// Whether a pair counts in its common cell, if it has one.
#[inline]
fn same_cell(a: u32, b: u32) -> bool {
    a >> 3 == b >> 3 && a & b & 7 == 0
}
