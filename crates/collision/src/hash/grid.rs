//! Levels, cells, and their slots in the table.

use crate::shape::Aabb;

/// Finest level: a cell of 2^-1000.
const FINEST: i32 = -1000;
/// Cells are at least this power of two of a box's distance from the origin: coordinates stay below 2^41. Only boxes whose
/// extents are next to the rounding of their coordinates, or zero, are met by it.
const RESOLUTION: i32 = 40;
/// Number of levels: a finite box is at most 2^1025 long.
const LEVELS: usize = (1026 - FINEST) as usize;
/// Rank of a level without boxes.
const NONE: u16 = u16::MAX;

/// A cell of a level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    coordinates: [i64; 3],
    rank: u16,
}

/// The cells of a box: one or two along each axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    low: [i64; 3],
    high: [i64; 3],
    rank: u16,
}

/// The levels that have boxes.
#[derive(Clone, Debug, Default)]
pub(super) struct Grid {
    /// Level of each box above the finest.
    levels: Vec<u16>,
    /// Rank of each level among those with boxes, from the finest.
    ranks: Vec<u16>,
    /// Level of each rank.
    present: Vec<u16>,
}

impl Grid {
    /// Takes boxes that are finite and have `min <= max`.
    pub(super) fn rebuild(&mut self, boxes: &[Aabb]) {
        self.ranks.clear();
        self.ranks.resize(LEVELS, NONE);
        self.levels.clear();
        self.present.clear();
        for aabb in boxes {
            let level = level(aabb);
            self.levels.push(level);
            if self.ranks[level as usize] == NONE {
                self.ranks[level as usize] = 0;
                self.present.push(level);
            }
        }
        self.present.sort_unstable();
        for (rank, &level) in self.present.iter().enumerate() {
            self.ranks[level as usize] = rank as u16;
        }
    }

    /// The cells of a box.
    #[inline]
    pub(super) fn cells(&self, boxes: &[Aabb], index: usize) -> Cells {
        let level = self.levels[index];
        let per_metre = power_of_two(-(i32::from(level) + FINEST));
        let Aabb { min, max } = &boxes[index];
        Cells {
            low: [min.x, min.y, min.z].map(|x| floor(x, per_metre)),
            high: [max.x, max.y, max.z].map(|x| floor(x, per_metre)),
            rank: self.ranks[level as usize],
        }
    }

    /// The ranks of a box's level and of all coarser ones.
    #[inline]
    pub(super) fn levels_from(&self, index: usize) -> std::ops::Range<u16> {
        self.ranks[self.levels[index] as usize]..self.present.len() as u16
    }

    /// The cells, on the same or a coarser level, in which these lie.
    #[inline]
    pub(super) fn coarsened(&self, cells: &Cells, rank: u16) -> Cells {
        let shift = (self.present[rank as usize] - self.present[cells.rank as usize]).min(63);
        Cells { low: cells.low.map(|x| x >> shift), high: cells.high.map(|x| x >> shift), rank }
    }
}

impl Cells {
    /// Visits all cells, with the bits of the axes on which each is the second one.
    #[inline]
    pub(super) fn for_each(&self, mut visit: impl FnMut(Cell, u32)) {
        let across = (0..3).fold(0, |bits, k| bits | u32::from(self.high[k] != self.low[k]) << k);
        let mut second = 0;
        loop {
            let coordinates = [0, 1, 2].map(|k| self.low[k] + i64::from(second >> k & 1));
            visit(Cell { coordinates, rank: self.rank }, second);
            // The next subset of `across`.
            second = second.wrapping_sub(across) & across;
            if second == 0 {
                break;
            }
        }
    }
}

impl Cell {
    /// Number of the cell in its block of 4 x 4 x 4.
    #[inline]
    fn local(&self) -> usize {
        let [x, y, z] = self.coordinates.map(|x| (x & 3) as usize);
        x | y << 2 | z << 4
    }

    /// Rank of the level and coordinates modulo four; an f32 holds it without rounding.
    #[inline]
    pub(super) fn tag(&self) -> f32 {
        (usize::from(self.rank) << 6 | self.local()) as f32
    }
}

/// Slots for cells.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Table {
    /// Number of blocks less one, all bits ones.
    mask: usize,
}

impl Table {
    /// A table of about two slots a box.
    pub(super) fn new(boxes: usize) -> Self {
        Self { mask: (boxes / 32).next_power_of_two() - 1 }
    }

    pub(super) fn slots(&self) -> usize {
        (self.mask + 1) * 64
    }

    #[inline]
    pub(super) fn slot(&self, cell: &Cell) -> usize {
        let [x, y, z] = cell.coordinates.map(|x| (x >> 2) as u64);
        let mut hash = x.wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ y.wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
            ^ z.wrapping_mul(0x1656_67b1_9e37_79f9)
            ^ u64::from(cell.rank).wrapping_mul(0x27d4_eb2f_1656_67c5);
        hash = (hash ^ hash >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93);
        let block = (hash >> 32) as usize & self.mask;
        // Rods along an axis or in a plane meet few of a block's cells, which must not be the same ones in every block.
        let turn = (hash >> 24) as usize & 0b1111;
        block << 6 | cell.local() ^ turn << 2
    }
}

/// The level of a box above the finest.
#[inline]
fn level(aabb: &Aabb) -> u16 {
    let (mut half, mut far) = (0.0_f64, 0.0_f64);
    for k in 0..3 {
        let (min, max) = (aabb.min[k], aabb.max[k]);
        half = half.max(0.5 * max - 0.5 * min);
        far = far.max(max.max(-min));
    }
    // A power of two that is equal to the rounded extent may be below the exact one.
    let level = (exponent(half) + 2).max(exponent(far) - RESOLUTION).max(FINEST);
    (level - FINEST) as u16
}

/// Exponent of the power of two not above the size of a number; -1023 for tiny ones.
#[inline]
fn exponent(x: f64) -> i32 {
    (x.to_bits() >> 52 & 0x7ff) as i32 - 1023
}

/// 2^exponent for -1025 <= exponent <= 1000.
#[inline]
fn power_of_two(exponent: i32) -> f64 {
    if exponent >= -1022 {
        f64::from_bits(((exponent + 1023) as u64) << 52)
    } else {
        f64::from_bits(1 << (exponent + 1074))
    }
}

/// Floor of `x * scale`, of the exact product also where it vanishes; not the library's, which is a call on processors
/// without SSE 4.1.
#[inline]
fn floor(x: f64, scale: f64) -> i64 {
    let scaled = x * scale;
    let truncated = scaled as i64;
    truncated - i64::from((truncated as f64 > scaled) | ((truncated == 0) & (x < 0.0)))
}
