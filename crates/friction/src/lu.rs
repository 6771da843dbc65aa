//! Dense linear systems by LU factors with partial pivoting: by faer with the cargo feature `faer`, else by nalgebra.

#[cfg(feature = "faer")]
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
#[cfg(feature = "faer")]
use faer::linalg::lu::partial_pivoting::{factor, solve};
#[cfg(feature = "faer")]
use faer::{MatMut, Par};

/// Memory for the factors, which grows to the largest system. nalgebra has its own.
#[cfg_attr(not(feature = "faer"), derive(Default))]
pub(super) struct Factor {
    /// The pivots' order and its inverse.
    #[cfg(feature = "faer")]
    orders: [Vec<u32>; 2],
    #[cfg(feature = "faer")]
    scratch: MemBuffer,
}

#[cfg(feature = "faer")]
impl Default for Factor {
    fn default() -> Self {
        Self { orders: Default::default(), scratch: MemBuffer::new(StackReq::empty()) }
    }
}

impl Factor {
    /// Solves with a matrix, given row by row, in the place of the right-hand side. The matrix is lost; where it is singular, the
    /// result is not finite.
    #[cfg(feature = "faer")]
    pub(super) fn solve(&mut self, matrix: &mut [f64], rhs: &mut [f64]) {
        let size = rhs.len();
        let Self { orders: [order, inverse], scratch } = self;
        order.resize(size, 0);
        inverse.resize(size, 0);
        let need = StackReq::or(
            factor::lu_in_place_scratch::<u32, f64>(size, size, Par::Seq, Default::default()),
            solve::solve_transpose_in_place_scratch::<u32, f64>(size, 1, Par::Seq),
        );
        if scratch.len() < need.unaligned_bytes_required() {
            *scratch = MemBuffer::new(need);
        }
        // The rows are the columns of its transpose.
        let mut matrix = MatMut::from_column_major_slice_mut(matrix, size, size);
        let stack = MemStack::new(scratch);
        let (_, order) = factor::lu_in_place(matrix.as_mut(), order, inverse, Par::Seq, stack, Default::default());
        let rhs = MatMut::from_column_major_slice_mut(rhs, size, 1);
        solve::solve_transpose_in_place(matrix.as_ref(), matrix.as_ref(), order, rhs, Par::Seq, MemStack::new(scratch));
    }

    /// Solves with a matrix, given row by row, in the place of the right-hand side; where it is singular, the result is not
    /// finite.
    #[cfg(not(feature = "faer"))]
    pub(super) fn solve(&mut self, matrix: &mut [f64], rhs: &mut [f64]) {
        by_nalgebra(matrix, rhs);
    }
}

/// [`Factor::solve`] by nalgebra.
#[cfg(any(test, not(feature = "faer")))]
fn by_nalgebra(matrix: &[f64], rhs: &mut [f64]) {
    let size = rhs.len();
    let factor = nalgebra::DMatrix::from_row_slice(size, size, matrix).lu();
    if !factor.solve_mut(&mut nalgebra::DVectorViewMut::from_slice(rhs, size)) {
        rhs.fill(f64::NAN);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Both solve systems that need pivots.
    #[test]
    fn factors_solve() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut factor = Factor::default();
        for size in [1, 2, 7, 40] {
            let mut matrix: Vec<f64> = (0..size * size).map(|_| random.random_range(-1.0..1.0)).collect();
            matrix[0] = if size > 1 { 0.0 } else { 2.0 };
            let x: Vec<f64> = (0..size).map(|_| random.random_range(-1.0..1.0)).collect();
            let rhs: Vec<f64> = matrix.chunks(size).map(|row| row.iter().zip(&x).map(|(a, x)| a * x).sum()).collect();
            let mut other = rhs.clone();
            by_nalgebra(&matrix, &mut other);
            let mut own = rhs;
            factor.solve(&mut matrix, &mut own);
            for (x, found) in x.iter().zip(&own).chain(x.iter().zip(&other)) {
                assert!((x - found).abs() < 1e-9, "{size}: {x} {found}");
            }
        }
        let mut singular = [f64::NAN];
        by_nalgebra(&[0.0], &mut singular);
        assert!(singular[0].is_nan());
    }
}
