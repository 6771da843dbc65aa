//! Factors `L D L^T` of symmetric 6 x 6 matrices.

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use super::stiffness::Stiffness;
use kernels::Spatial;
use kernels::lane::Real;

/// A factor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cholesky<T> {
    /// L below its unit diagonal.
    lower: [[T; 6]; 6],
    /// D.
    pivots: [T; 6],
}

impl<T: Real> Cholesky<T> {
    /// Factors a matrix; returns the factor, and a number that is not negative where there is one: where the matrix is
    /// positive, or where it is to be left as it is and has a factor.
    pub(super) fn new(matrix: &Stiffness<T>, is_left: bool) -> (Self, T) {
        let mut exists = T::splat(1.0);
        let mut a = [[T::zero(); 6]; 6];
        let (translation, turning) = (matrix.translation.full(), matrix.turning.full());
        for r in 0..3 {
            for c in 0..3 {
                a[r][c] = translation[r][c];
                a[3 + r][c] = matrix.mixed[c][r];
                a[3 + r][3 + c] = turning[r][c];
            }
        }
        let (mut lower, mut pivots) = ([[T::zero(); 6]; 6], [T::zero(); 6]);
        for k in 0..6 {
            let pivot = a[k][k];
            for lane in 0..T::LANES {
                let pivot = pivot.lane(lane);
                if !((pivot > 0.0 || (is_left && pivot < 0.0)) && pivot.is_finite()) {
                    exists.set_lane(lane, -1.0);
                }
            }
            pivots[k] = pivot;
            for i in k + 1..6 {
                lower[i][k] = a[i][k] / pivot;
                for j in k + 1..=i {
                    let share = lower[i][k] * a[j][k];
                    a[i][j] -= share;
                }
            }
        }
        (Self { lower, pivots }, exists)
    }

    /// The inverse, column by column.
    pub(super) fn inverse(&self) -> [Spatial<T>; 6] {
        let mut identity = [[T::zero(); 6]; 6];
        (0..6).for_each(|k| identity[k][k] = T::splat(1.0));
        let inverse = self.backward(self.forward(&identity).0);
        // It is symmetric.
        inverse.map(Spatial::from_array)
    }

    /// `L^-1 B`, and the pivots.
    pub(super) fn forward<const M: usize>(&self, b: &[[T; M]; 6]) -> ([[T; M]; 6], [T; 6]) {
        let mut x = *b;
        for k in 0..6 {
            for i in k + 1..6 {
                for c in 0..M {
                    let share = self.lower[i][k] * x[k][c];
                    x[i][c] -= share;
                }
            }
        }
        (x, self.pivots)
    }

    /// `A^-1 B`, given `L^-1 B`.
    pub(super) fn backward<const M: usize>(&self, mut x: [[T; M]; 6]) -> [[T; M]; 6] {
        for k in (0..6).rev() {
            for c in 0..M {
                x[k][c] = x[k][c] / self.pivots[k];
                for i in k + 1..6 {
                    let share = self.lower[i][k] * x[i][c];
                    x[k][c] -= share;
                }
            }
        }
        x
    }
}
