//! Boxes in the order of space, so that near ones are near in memory whatever order they come in.

use crate::shape::Aabb;

/// Most bits of a coordinate: 2^18 buckets, which a processor's cache holds.
const BITS: u32 = 6;

/// A permutation of boxes.
#[derive(Clone, Debug, Default)]
pub(super) struct Order {
    /// Index of each box by its place. Boxes that overlap nothing have none.
    indices: Vec<u32>,
    /// Bucket of each box, `NONE` if it overlaps nothing.
    codes: Vec<u32>,
    ends: Vec<u32>,
}

/// Code of a box that overlaps nothing.
const NONE: u32 = u32::MAX;

impl Order {
    /// Sorts boxes by the Morton code (Morton 1966, "A Computer Oriented Geodetic Data Base") of their lower corners in a
    /// cube around all of them: by one counting sort, which leaves boxes of equal codes in their order.
    pub(super) fn rebuild(&mut self, boxes: &[Aabb]) {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for aabb in boxes.iter().filter(|aabb| is_valid(aabb)) {
            for k in 0..3 {
                low[k] = low[k].min(aabb.min[k]);
                high[k] = high[k].max(aabb.min[k]);
            }
        }
        let bits = (boxes.len().max(1).ilog2() / 3).min(BITS);
        let width = (0..3).fold(f64::MIN_POSITIVE, |width, k| width.max(high[k] - low[k]));
        let (scale, last) = (f64::from(1 << bits) / width, (1 << bits) - 1);
        self.ends.clear();
        self.ends.resize(1 << (3 * bits), 0);
        self.codes.clear();
        for aabb in boxes {
            if is_valid(aabb) {
                // Too wide a world to subtract makes these numbers infinite or none at all, which the casts allow.
                let code = (0..3).fold(0, |code, k| {
                    let step = (((aabb.min[k] - low[k]) * scale) as u32).min(last);
                    code | spread(step) << k
                });
                self.ends[code as usize] += 1;
                self.codes.push(code);
            } else {
                self.codes.push(NONE);
            }
        }
        self.indices.resize(sum_up(&mut self.ends), 0);
        for (index, &code) in self.codes.iter().enumerate().rev() {
            if code != NONE {
                let end = &mut self.ends[code as usize];
                *end -= 1;
                self.indices[*end as usize] = index as u32;
            }
        }
    }

    /// Index of each box by its place.
    pub(super) fn indices(&self) -> &[u32] {
        &self.indices
    }
}

/// Turns numbers into ends, the sums up to each of them, and returns the last one.
pub(super) fn sum_up(numbers: &mut [u32]) -> usize {
    let mut sum = 0;
    for number in numbers {
        sum += *number;
        *number = sum;
    }
    sum as usize
}

/// Whether a box is finite and has `min <= max`.
#[inline]
fn is_valid(aabb: &Aabb) -> bool {
    (0..3).all(|k| aabb.min[k] <= aabb.max[k] && aabb.min[k].is_finite() && aabb.max[k].is_finite())
}

/// Puts two zeros between the bits of a number below 2^6.
#[inline]
fn spread(x: u32) -> u32 {
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}
