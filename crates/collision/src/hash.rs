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
//! Entries hold the boxes as f32; what passes is tested again as f64.
//!
//! *Locality.* Boxes are first sorted roughly by their places in space. Blocks of 4 x 4 x 4 cells are hashed, and a block's
//! cells lie side by side in the table.

mod grid;
mod order;

use crate::shape::Aabb;
use grid::{Grid, Table};
use order::{Order, sum_up};

/// A box in one of its cells. Rounded to f32 a box still overlaps all that it overlapped, as rounding keeps the order.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    /// Lower corner and tag of level and cell, then the upper corner and the tag, negated: one comparison of eight numbers
    /// tells whether boxes overlap and cells are the same.
    bounds: [f32; 8],
    /// Place of the box, and in the last three bits whether the cell is its second one, by axis.
    mark: u32,
}

/// The hash, with memory that is kept from one use to the next: nothing is allocated for as many boxes as before.
#[derive(Clone, Debug, Default)]
pub struct SpatialHash {
    order: Order,
    /// The boxes in the order of space.
    boxes: Vec<Aabb>,
    grid: Grid,
    table: Table,
    /// Where each slot's entries begin, and the end of the last one's.
    starts: Vec<u32>,
    /// By slot, within a slot by place.
    entries: Vec<Entry>,
}

impl SpatialHash {
    /// A hash without boxes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes new boxes, at most 2^28. One that is not finite, or has `min > max`, overlaps nothing.
    pub fn rebuild(&mut self, boxes: &[Aabb]) {
        self.order.rebuild(boxes);
        self.boxes.clear();
        self.boxes.extend(self.order.indices().iter().map(|&index| boxes[index as usize]));
        self.grid.rebuild(&self.boxes);
        self.table = Table::new(self.boxes.len());
        self.starts.clear();
        self.starts.resize(self.table.slots() + 1, 0);
        for place in 0..self.boxes.len() {
            let cells = self.grid.cells(&self.boxes, place);
            cells.for_each(|cell, _| self.starts[self.table.slot(&cell)] += 1);
        }
        self.entries.resize(sum_up(&mut self.starts), Entry::default());
        for (place, aabb) in self.boxes.iter().enumerate().rev() {
            let mut bounds = self.bounds(aabb);
            self.grid.cells(&self.boxes, place).for_each(|cell, second| {
                let start = &mut self.starts[self.table.slot(&cell)];
                *start -= 1;
                (bounds[3], bounds[7]) = (cell.tag(), -cell.tag());
                self.entries[*start as usize] = Entry { bounds, mark: (place as u32) << 3 | second };
            });
        }
    }

    /// Appends all pairs `[i, j]`, i < j, of overlapping boxes which `keep(i, j)` wants, each once. Their order is a
    /// function of the boxes alone; it is that of space rather than that of i, so that what is read for one pair is likely
    /// to be needed for the next.
    pub fn pairs(&self, mut keep: impl FnMut(u32, u32) -> bool, out: &mut Vec<[u32; 2]>) {
        let indices = self.order.indices();
        for (place, aabb) in self.boxes.iter().enumerate() {
            self.partners(place, aabb, |partner| {
                let (i, j) = (indices[place], indices[partner as usize]);
                let (i, j) = (i.min(j), i.max(j));
                if aabb.overlaps(&self.boxes[partner as usize]) && keep(i, j) {
                    out.push([i, j]);
                }
            });
        }
    }

    /// Visits the boxes after this one on its level, and all of those on coarser levels, that overlap it as f32.
    #[inline]
    fn partners(&self, place: usize, aabb: &Aabb, mut visit: impl FnMut(u32)) {
        let bounds = self.bounds(aabb);
        let mut limits = [4, 5, 6, 7, 0, 1, 2, 3].map(|k: usize| -bounds[k]);
        let cells = self.grid.cells(&self.boxes, place);
        let mut first = (place as u32 + 1) << 3;
        for level in self.grid.levels_from(place) {
            self.grid.coarsened(&cells, level).for_each(|cell, second| {
                (limits[3], limits[7]) = (cell.tag(), -cell.tag());
                let slot = self.table.slot(&cell);
                let entries = &self.entries[self.starts[slot] as usize..self.starts[slot + 1] as usize];
                for entry in entries.iter().rev().take_while(|entry| entry.mark >= first) {
                    // Jumps that cannot be predicted cost more than all of the comparisons.
                    let below = (0..8).fold(true, |all, k| all & (entry.bounds[k] <= limits[k]));
                    if below & (entry.mark & second == 0) {
                        visit(entry.mark >> 3);
                    }
                }
            });
            first = 0;
        }
    }

    /// An entry's bounds, without the tag.
    #[inline]
    fn bounds(&self, aabb: &Aabb) -> [f32; 8] {
        // Far from zero f32 would have no digits left for small boxes.
        let origin = self.boxes[0].min;
        let (min, max) = (aabb.min - origin, aabb.max - origin);
        [min.x, min.y, min.z, 0.0, -max.x, -max.y, -max.z, 0.0].map(|x| x as f32)
    }
}
