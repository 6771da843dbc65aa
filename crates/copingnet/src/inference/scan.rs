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
        for line in 0..scans.div_ceil(LINE) {
            pass(simd, &outwards.lines()[line], line, visits.iter().map(|&[node, parent]| [node, parent]), &mut rows);
        }
        for line in scans / LINE..rows.stride {
            pass(
                simd,
                &inwards.lines()[line],
                line,
                visits.iter().rev().map(|&[node, parent]| [parent, node]),
                &mut rows,
            );
        }
    }
}

/// Adds to each `to` the decayed `from` of the steps `[to, from]`, in one line of the rows.
#[inline(always)]
fn pass<S: Simd>(simd: S, decays: &Line, line: usize, steps: impl Iterator<Item = [u32; 2]>, rows: &mut RowsMut) {
    for [to, from] in steps {
        let from = rows.lines[from as usize * rows.stride + line];
        let to = registers_mut::<S>(&mut rows.lines[to as usize * rows.stride + line]);
        for ((to, &from), &decay) in to.iter_mut().zip(registers::<S>(&from)).zip(registers::<S>(decays)) {
            *to = simd.mul_add_e_f32s(decay, from, *to);
        }
    }
}
