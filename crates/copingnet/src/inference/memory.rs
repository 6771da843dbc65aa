//! Numbers in whole cache lines.

use pulp::Simd;

/// Floats of a cache line, and of the widest vector register.
pub(super) const LINE: usize = 16;

/// Floats of one cache line.
pub(super) type Line = [f32; LINE];

/// Zeros at first, beginning at a cache line.
#[derive(Debug)]
pub(super) struct Aligned {
    values: Vec<f32>,
    begin: usize,
}

impl Aligned {
    /// `lines` lines of zeros.
    pub(super) fn zeros(lines: usize) -> Self {
        let values = vec![0.0; (lines + 1) * LINE];
        let begin = values.as_ptr().align_offset(size_of::<Line>()).min(LINE);
        Self { values, begin }
    }

    /// `values`, and zeros up to the end of a line.
    pub(super) fn new(values: &[f32]) -> Self {
        let mut new = Self::zeros(values.len().div_ceil(LINE));
        new.lines_mut().as_flattened_mut()[..values.len()].copy_from_slice(values);
        new
    }

    /// All lines.
    #[inline(always)]
    pub(super) fn lines(&self) -> &[Line] {
        self.values[self.begin..].as_chunks().0
    }

    /// All lines, to be changed.
    #[inline(always)]
    pub(super) fn lines_mut(&mut self) -> &mut [Line] {
        self.values[self.begin..].as_chunks_mut().0
    }
}

/// Rows of whole lines.
#[derive(Debug)]
pub(super) struct Table {
    values: Aligned,
    lines: usize,
}

impl Table {
    /// `rows` rows of `columns` zeros, and zeros up to the end of a line.
    pub(super) fn zeros(rows: usize, columns: usize) -> Self {
        let lines = columns.div_ceil(LINE);
        Self { values: Aligned::zeros(rows * lines), lines }
    }

    /// All rows.
    #[inline(always)]
    pub(super) fn rows(&self) -> Rows<'_> {
        Rows { lines: self.values.lines(), stride: self.lines }
    }

    /// All rows, to be changed.
    #[inline(always)]
    pub(super) fn rows_mut(&mut self) -> RowsMut<'_> {
        RowsMut { lines: self.values.lines_mut(), stride: self.lines }
    }
}

/// Rows one after the other.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    /// Lines of all rows.
    pub(super) lines: &'a [Line],
    /// Lines from one row to the next; 0 where all are the same.
    pub(super) stride: usize,
}

/// Rows one after the other, to be changed.
pub(super) struct RowsMut<'a> {
    /// Lines of all rows.
    pub(super) lines: &'a mut [Line],
    /// Lines from one row to the next.
    pub(super) stride: usize,
}

/// The registers of a line.
#[inline(always)]
pub(super) fn registers<S: Simd>(line: &Line) -> &[S::f32s] {
    S::as_simd_f32s(line).0
}

/// The registers of a line, to be changed.
#[inline(always)]
pub(super) fn registers_mut<S: Simd>(line: &mut Line) -> &mut [S::f32s] {
    S::as_mut_simd_f32s(line).0
}
