//! Sums with decay along the way outwards and back.

use pulp::{Simd, WithSimd};

use super::memory::{Aligned, LINE, Line, RowsMut, registers, registers_mut};

/// Decays a of every channel on the way outwards, then inwards; 0 for channels of the other way.
#[derive(Debug)]
pub(super) struct Decays([Aligned; 2]);

impl Decays {
    /// Of `scans` channels outwards, then as many inwards.
    pub(super) fn new(decays: &[f32]) -> Self {
        let (outwards, inwards) = decays.split_at(decays.len() / 2);
        let zeros = vec![0.0; outwards.len()];
        Self([Aligned::new(&[outwards, &zeros].concat()), Aligned::new(&[&zeros, inwards].concat())])
    }
}

/// Runs scans over rows that hold (1 - a) u at first.
pub(super) struct Scan<'a> {
    /// The decays.
    pub(super) decays: &'a Decays,
    /// Scans outwards, and inwards.
    pub(super) scans: usize,
    /// Node and parent of every visit, parents first.
    pub(super) visits: &'a [[u32; 2]],
    /// (1 - a) u, then h. `[n, 2 scans]`
    pub(super) rows: RowsMut<'a>,
}

impl WithSimd for Scan<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { decays: Decays([outwards, inwards]), scans, visits, mut rows } = self;
        let on = visits.iter().map(|&[node, parent]| [parent, node]);
        let back = visits.iter().rev().copied();
        for line in 0..scans.div_ceil(LINE) {
            pass(simd, &outwards.lines()[line], line, on.clone(), &mut rows);
        }
        for line in scans / LINE..rows.stride {
            pass(simd, &inwards.lines()[line], line, back.clone(), &mut rows);
        }
    }
}

/// Adds the decayed first row of every step to the second one, in one line of the rows.
#[inline(always)]
fn pass<S: Simd>(
    simd: S,
    decays: &Line,
    line: usize,
    steps: impl Iterator<Item = [u32; 2]> + Clone,
    rows: &mut RowsMut,
) {
    let stride = rows.stride;
    let place = |row: u32| row as usize * stride + line;
    for (register, &decay) in registers::<S>(decays).iter().enumerate() {
        // Most steps go on from the row that the step before came to: its sum is still at hand.
        let (mut last, mut sum) = (u32::MAX, decay);
        for [from, to] in steps.clone() {
            if from != last {
                sum = registers::<S>(&rows.lines[place(from)])[register];
            }
            let to_register = &mut registers_mut::<S>(&mut rows.lines[place(to)])[register];
            sum = simd.mul_add_e_f32s(decay, sum, *to_register);
            *to_register = sum;
            last = to;
        }
    }
}
