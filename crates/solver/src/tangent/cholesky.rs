//! Factors `L D L^T` of symmetric 6 x 6 matrices.

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use super::stiffness::Stiffness;

/// A factor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cholesky {
    /// L below its unit diagonal.
    lower: [[f64; 6]; 6],
    /// D.
    pivots: [f64; 6],
}

impl Cholesky {
    /// Factors a matrix; `None` where it is not positive, or where it is to be left as it is and has no factor.
    pub(super) fn new(matrix: &Stiffness<f64>, is_left: bool) -> Option<Self> {
        let mut a = [[0.0; 6]; 6];
        let (translation, turning) = (matrix.translation.full(), matrix.turning.full());
        for r in 0..3 {
            for c in 0..3 {
                a[r][c] = translation[r][c];
                a[3 + r][c] = matrix.mixed[c][r];
                a[3 + r][3 + c] = turning[r][c];
            }
        }
        let (mut lower, mut pivots) = ([[0.0; 6]; 6], [0.0; 6]);
        for k in 0..6 {
            let pivot = a[k][k];
            if !((pivot > 0.0 || (is_left && pivot < 0.0)) && pivot.is_finite()) {
                return None;
            }
            pivots[k] = pivot;
            for i in k + 1..6 {
                lower[i][k] = a[i][k] / pivot;
                for j in k + 1..=i {
                    a[i][j] -= lower[i][k] * a[j][k];
                }
            }
        }
        Some(Self { lower, pivots })
    }

    /// `L^-1 B`, and the pivots.
    pub(super) fn forward<const M: usize>(&self, b: &[[f64; M]; 6]) -> ([[f64; M]; 6], [f64; 6]) {
        let mut x = *b;
        for k in 0..6 {
            for i in k + 1..6 {
                for c in 0..M {
                    x[i][c] -= self.lower[i][k] * x[k][c];
                }
            }
        }
        (x, self.pivots)
    }

    /// `A^-1 B`, given `L^-1 B`.
    pub(super) fn backward<const M: usize>(&self, mut x: [[f64; M]; 6]) -> [[f64; M]; 6] {
        for k in (0..6).rev() {
            for c in 0..M {
                x[k][c] /= self.pivots[k];
                for i in k + 1..6 {
                    x[k][c] -= self.lower[i][k] * x[i][c];
                }
            }
        }
        x
    }
}
