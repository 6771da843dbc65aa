//! One linear layer over a few rows: the kernel that all time goes to.

use pulp::{Arch, Simd, WithSimd};

use super::memory::{Aligned, LINE, Line, Rows, registers, registers_mut};

/// Registers side by side in a panel of weights.
const PANEL: usize = 2;

/// Weights and bias of a linear layer.
///
/// Weights lie in panels of two registers of outputs, the last one of one where their number is odd; a panel holds its
/// columns of all inputs, one input after the other.
#[derive(Debug)]
pub(super) struct Layer {
    /// Number of inputs in each line of the input; a line holds inputs of one part only.
    depths: Vec<usize>,
    inputs: usize,
    outputs: usize,
    registers: usize,
    weights: Aligned,
    bias: Aligned,
}

impl Layer {
    /// A layer whose inputs come in parts of so many columns: weights `[sum of parts, outputs]`, bias `[outputs]`.
    pub(super) fn new(arch: Arch, parts: &[usize], weights: &[f32], bias: &[f32]) -> Self {
        let (lanes, outputs, inputs) = (lanes(arch), bias.len(), parts.iter().sum());
        let depths = parts.iter().flat_map(|&part| (0..part).step_by(LINE).map(move |k| LINE.min(part - k))).collect();
        let registers = outputs.div_ceil(lanes);
        let mut panels = Vec::with_capacity(inputs * registers * lanes);
        for first in (0..registers).step_by(PANEL) {
            let columns = first * lanes..registers.min(first + PANEL) * lanes;
            for k in 0..inputs {
                let row = &weights[k * outputs..][..outputs];
                panels.extend(columns.clone().map(|column| row.get(column).copied().unwrap_or(0.0)));
            }
        }
        Self { depths, inputs, outputs, registers, weights: Aligned::new(&panels), bias: Aligned::new(bias) }
    }

    /// Lines of a row of inputs or of outputs, whichever has more.
    pub(super) fn lines(&self) -> usize {
        self.depths.len().max(self.outputs.div_ceil(LINE))
    }

    /// The bias for every row.
    #[inline(always)]
    pub(super) fn bias(&self) -> Rows<'_> {
        Rows { lines: self.bias.lines(), stride: 0 }
    }

    /// Outputs of `R` rows, rectified where `relu`. Row r's sums begin with row `rows[r]` of `start`.
    #[inline(always)]
    pub(super) fn apply<S: Simd, const R: usize>(
        &self,
        simd: S,
        start: Rows,
        rows: [usize; R],
        inputs: &[[Line; R]],
        relu: bool,
        outputs: &mut [[Line; R]],
    ) {
        let mut starts = rows;
        starts.iter_mut().for_each(|row| *row *= start.stride);
        let strip = Strip { layer: self, start: start.lines, starts, relu };
        let pairs = self.registers / PANEL;
        for pair in 0..pairs {
            strip.run::<S, PANEL>(simd, pair * PANEL, inputs, outputs);
        }
        if self.registers % PANEL == 1 {
            strip.run::<S, 1>(simd, pairs * PANEL, inputs, outputs);
        }
    }
}

/// A layer on `R` rows, without inputs and outputs.
struct Strip<'a, const R: usize> {
    layer: &'a Layer,
    start: &'a [Line],
    /// First line of every row in `start`.
    starts: [usize; R],
    relu: bool,
}

impl<const R: usize> Strip<'_, R> {
    /// The outputs of `N` registers from register `first` on.
    #[inline(always)]
    fn run<S: Simd, const N: usize>(&self, simd: S, first: usize, inputs: &[[Line; R]], outputs: &mut [[Line; R]]) {
        let layer = self.layer;
        let per_line = LINE / S::F32_LANES;
        let place = |c: usize| ((first + c) / per_line, (first + c) % per_line);
        let mut sums = [[simd.splat_f32s(0.0); N]; R];
        for (sums, &start) in sums.iter_mut().zip(&self.starts) {
            for (c, sum) in sums.iter_mut().enumerate() {
                let (line, register) = place(c);
                *sum = registers::<S>(&self.start[start + line])[register];
            }
        }
        let panel = S::as_simd_f32s(layer.weights.lines().as_flattened()).0;
        let panel = &panel[first * layer.inputs..][..N * layer.inputs];
        let mut weights = panel.as_chunks::<N>().0;
        for (rows, &depth) in inputs.iter().zip(&layer.depths) {
            let (own, others) = weights.split_at(depth);
            weights = others;
            for (k, weights) in own.iter().enumerate() {
                for (sums, row) in sums.iter_mut().zip(rows) {
                    let x = simd.splat_f32s(row[k % LINE]);
                    for (sum, &weight) in sums.iter_mut().zip(weights) {
                        *sum = simd.mul_add_e_f32s(x, weight, *sum);
                    }
                }
            }
        }
        let zero = simd.splat_f32s(0.0);
        for c in 0..N {
            let (line, register) = place(c);
            for (sums, row) in sums.iter().zip(&mut outputs[line]) {
                let sum = if self.relu { simd.max_f32s(zero, sums[c]) } else { sums[c] };
                registers_mut::<S>(row)[register] = sum;
            }
        }
    }
}

/// Floats of a vector register.
fn lanes(arch: Arch) -> usize {
    struct Lanes;
    impl WithSimd for Lanes {
        type Output = usize;
        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> usize {
            S::F32_LANES
        }
    }
    arch.dispatch(Lanes)
}
