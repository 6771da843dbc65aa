//! A perceptron over all rows, a few at a time: what goes in, what is done, where it goes.

use pulp::{Simd, WithSimd};

use super::connections::Lists;
use super::layer::Layer;
use super::memory::{Aligned, LINE, Line, Rows, RowsMut, registers, registers_mut};
use crate::config::Output;

/// The most rows at a time.
const ROWS: usize = 10;

/// One part of a row's inputs.
#[derive(Clone, Copy)]
pub(super) enum Source<'a> {
    /// Numbers without gaps. `[rows, columns]`
    Plain(&'a [f32], usize),
    /// The row itself.
    Own(Rows<'a>),
    /// The row that an index tells.
    At(Rows<'a>, &'a [u32]),
    /// The sum of listed rows; there is a row of zeros after the last one.
    Sum(Rows<'a>, &'a Lists),
}

/// Where outputs go.
pub(super) enum Sink<'a> {
    /// Into a table.
    Store(RowsMut<'a>),
    /// `new = old + outputs`; the outputs themselves into `change`, too.
    Add { old: Rows<'a>, new: RowsMut<'a>, change: Option<RowsMut<'a>> },
    /// Through a function into numbers without gaps. `[rows, columns]`
    Output(&'a mut [f32], usize, Output),
}

/// Memory for a few rows of inputs and of outputs of any layer.
#[derive(Debug)]
pub(super) struct Scratch([Aligned; 2]);

impl Scratch {
    /// For rows of up to so many lines.
    pub(super) fn new(lines: usize) -> Self {
        Self([(); 2].map(|()| Aligned::zeros(lines * ROWS)))
    }
}

/// A perceptron over all rows.
pub(super) struct Sweep<'a> {
    /// Number of rows.
    pub(super) rows: usize,
    /// The parts of the inputs.
    pub(super) sources: &'a [Source<'a>],
    /// What the first layer's sums begin with.
    pub(super) start: Rows<'a>,
    /// The layers, at least one.
    pub(super) layers: &'a [Layer],
    /// Where the outputs go.
    pub(super) sink: Sink<'a>,
    /// Memory.
    pub(super) scratch: &'a mut Scratch,
}

impl WithSimd for Sweep<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        // Two registers of sums for each row, two of weights and one input are to fit into the register file.
        let mut first = 0;
        while first < self.rows {
            first += match (S::REGISTER_COUNT >= 32, self.rows - first) {
                (true, 9..) => self.block::<S, 10>(simd, first),
                (true, 5..) => self.block::<S, 8>(simd, first),
                (false, 5..) => self.block::<S, 6>(simd, first),
                _ => self.block::<S, 4>(simd, first),
            };
        }
    }
}

impl Sweep<'_> {
    /// The layers on `R` rows from `first` on, the last row again where there are no more. Returns `R`.
    #[inline(always)]
    fn block<S: Simd, const R: usize>(&mut self, simd: S, first: usize) -> usize {
        let mut rows = [0; R];
        for (r, row) in rows.iter_mut().enumerate() {
            *row = (first + r).min(self.rows - 1);
        }
        let [from, to] = &mut self.scratch.0;
        let mut from = from.lines_mut().as_chunks_mut::<R>().0;
        let mut to = to.lines_mut().as_chunks_mut::<R>().0;
        let mut line = 0;
        for source in self.sources {
            line += source.load::<S, R>(simd, rows, &mut from[line..]);
        }
        for (k, layer) in self.layers.iter().enumerate() {
            let start = if k == 0 { self.start } else { layer.bias() };
            layer.apply(simd, start, rows, from, k + 1 < self.layers.len(), to);
            std::mem::swap(&mut from, &mut to);
        }
        let present = R.min(self.rows - first);
        self.sink.store(simd, first, present, from);
        R
    }
}

impl Rows<'_> {
    /// Copies the rows that `row` tells for 0 to R and returns how many lines each takes.
    #[inline(always)]
    fn gather<const R: usize>(self, row: impl Fn(usize) -> usize, to: &mut [[Line; R]]) -> usize {
        let mut starts = [0; R];
        for (r, start) in starts.iter_mut().enumerate() {
            *start = row(r) * self.stride;
        }
        for (k, to) in to.iter_mut().take(self.stride).enumerate() {
            for (to, &start) in to.iter_mut().zip(&starts) {
                *to = self.lines[start + k];
            }
        }
        self.stride
    }
}

impl RowsMut<'_> {
    /// Writes `present` rows from `first` on.
    #[inline(always)]
    fn scatter<const R: usize>(&mut self, first: usize, present: usize, from: &[[Line; R]]) {
        let stride = self.stride;
        let lines = &mut self.lines[first * stride..][..present * stride];
        for (k, from) in from.iter().take(stride).enumerate() {
            for (r, from) in from.iter().take(present).enumerate() {
                lines[r * stride + k] = *from;
            }
        }
    }
}

impl<'a> Source<'a> {
    /// Numbers without gaps. `[rows, columns]`
    pub(super) fn plain(values: &'a [f32], rows: usize, columns: usize) -> Self {
        assert_eq!(values.len(), rows * columns, "{rows} rows of {columns} columns");
        Source::Plain(values, columns)
    }

    /// Loads `R` rows and returns how many lines each takes.
    #[inline(always)]
    fn load<S: Simd, const R: usize>(&self, simd: S, rows: [usize; R], to: &mut [[Line; R]]) -> usize {
        match *self {
            Source::Plain(values, columns) => {
                for (r, &row) in rows.iter().enumerate() {
                    let values = &values[row * columns..][..columns];
                    for (to, values) in to.iter_mut().zip(values.chunks(LINE)) {
                        for (to, part) in registers_mut::<S>(&mut to[r]).iter_mut().zip(values.chunks(S::F32_LANES)) {
                            *to = simd.partial_load_f32s(part);
                        }
                    }
                }
                columns.div_ceil(LINE)
            }
            Source::Own(table) => table.gather(|r| rows[r], to),
            Source::At(table, index) => table.gather(|r| index[rows[r]] as usize, to),
            Source::Sum(table, lists) => {
                let lines = table.gather(|r| lists.first[rows[r]] as usize, to);
                for (r, &row) in rows.iter().enumerate() {
                    for &edge in lists.others(row) {
                        for (to, line) in to.iter_mut().zip(&table.lines[edge as usize * lines..][..lines]) {
                            add::<S>(simd, &mut to[r], line);
                        }
                    }
                }
                lines
            }
        }
    }
}

impl Sink<'_> {
    /// Takes the outputs of `present` rows from `first` on.
    #[inline(always)]
    fn store<S: Simd, const R: usize>(&mut self, simd: S, first: usize, present: usize, from: &[[Line; R]]) {
        match self {
            Sink::Store(table) => table.scatter(first, present, from),
            Sink::Add { old, new, change } => {
                let stride = new.stride;
                let old = &old.lines[first * stride..][..present * stride];
                let new = &mut new.lines[first * stride..][..present * stride];
                for (k, from) in from.iter().take(stride).enumerate() {
                    for (r, from) in from.iter().take(present).enumerate() {
                        let (old, new) = (&old[r * stride + k], &mut new[r * stride + k]);
                        let sums = registers_mut::<S>(new).iter_mut().zip(registers::<S>(old));
                        for ((new, &old), &from) in sums.zip(registers::<S>(from)) {
                            *new = simd.add_f32s(old, from);
                        }
                    }
                }
                if let Some(change) = change {
                    change.scatter(first, present, from);
                }
            }
            Sink::Output(values, columns, output) => {
                for r in 0..present {
                    let row = &mut values[(first + r) * *columns..][..*columns];
                    for (to, from) in row.chunks_mut(LINE).zip(from) {
                        for (to, &from) in to.chunks_mut(S::F32_LANES).zip(registers::<S>(&from[r])) {
                            let value = if *output == Output::Tanh { tanh(simd, from) } else { from };
                            simd.partial_store_f32s(to, value);
                        }
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn add<S: Simd>(simd: S, to: &mut Line, from: &Line) {
    for (to, &from) in registers_mut::<S>(to).iter_mut().zip(registers::<S>(from)) {
        *to = simd.add_f32s(*to, from);
    }
}

/// tanh to a few units in the last place: a quotient of polynomials within the range where it is not yet 1.
#[inline(always)]
fn tanh<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    const ODD: [f32; 7] =
        [-2.760_768_5e-16, 2.000_188e-13, -8.604_672e-11, 5.122_297e-8, 1.485_722_4e-5, 6.372_619e-4, 4.893_524_6e-3];
    const EVEN: [f32; 4] = [1.198_258_4e-6, 1.185_347_1e-4, 2.268_434_6e-3, 4.893_525e-3];
    let splat = |value| simd.splat_f32s(value);
    // Of the operands of minimum and maximum, the second one is kept where one is not a number (x86).
    let x = simd.max_f32s(splat(-7.905_311), simd.min_f32s(splat(7.905_311), x));
    let square = simd.mul_f32s(x, x);
    let polynomial = |terms: &[f32]| {
        terms[1..].iter().fold(splat(terms[0]), |sum, &term| simd.mul_add_e_f32s(sum, square, splat(term)))
    };
    let quotient = simd.div_f32s(simd.mul_f32s(x, polynomial(&ODD)), polynomial(&EVEN));
    simd.max_f32s(splat(-1.0), simd.min_f32s(splat(1.0), quotient))
}
