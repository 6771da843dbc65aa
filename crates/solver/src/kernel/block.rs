//! The 6x6 kernels of the block elimination: factor, forward and backward substitution.

use super::lane::Real;

/// A 6x6 block, row by row.
pub type Block<T> = [[T; 6]; 6];

/// A node's share of the factor: `D = L Delta L^T` and `V = L^-1 B` for the block B that couples it to its parent.
#[derive(Clone, Copy, Debug)]
pub struct NodeFactor<T> {
    /// L below its unit diagonal, row by row.
    lower: [T; 15],
    /// Reciprocals of the pivots Delta; negative for a node that stands for a body.
    inverse_pivots: [T; 6],
    /// V: rows of the node, columns of its parent.
    coupling: Block<T>,
}

/// Place of entry (row, column) of a strictly lower triangle kept row by row.
const fn below(row: usize, column: usize) -> usize {
    row * (row - 1) / 2 + column
}

impl<T: Real> NodeFactor<T> {
    /// Zero, to be overwritten.
    pub fn zero() -> Self {
        Self { lower: [T::zero(); 15], inverse_pivots: [T::zero(); 6], coupling: [[T::zero(); 6]; 6] }
    }

    /// Factors D (its lower triangle counts) without a parent.
    #[inline(always)]
    pub fn factor_root(&mut self, mut d: Block<T>) {
        for k in 0..6 {
            let inverse = T::splat(1.0) / d[k][k];
            self.inverse_pivots[k] = inverse;
            for i in k + 1..6 {
                let l = d[i][k] * inverse;
                self.lower[below(i, k)] = l;
                for j in k + 1..=i {
                    let update = l * d[j][k];
                    d[i][j] -= update;
                }
            }
        }
    }

    /// Factors D (its lower triangle counts) with coupling B to the parent and returns what the parent's D loses,
    /// `B^T D^-1 B` (all 36 entries).
    #[inline(always)]
    pub fn factor(&mut self, d: Block<T>, b: Block<T>) -> Block<T> {
        self.factor_root(d);
        self.coupling = b;
        for i in 1..6 {
            for k in 0..i {
                let l = self.lower[below(i, k)];
                for c in 0..6 {
                    let update = l * self.coupling[k][c];
                    self.coupling[i][c] -= update;
                }
            }
        }
        let mut schur = [[T::zero(); 6]; 6];
        for k in 0..6 {
            for r in 0..6 {
                let scaled = self.coupling[k][r] * self.inverse_pivots[k];
                for c in 0..6 {
                    schur[r][c] += scaled * self.coupling[k][c];
                }
            }
        }
        schur
    }

    /// `y = L^-1 r`, in place.
    #[inline(always)]
    pub fn forward(&self, r: &mut [T; 6]) {
        for i in 1..6 {
            for k in 0..i {
                let update = self.lower[below(i, k)] * r[k];
                r[i] -= update;
            }
        }
    }

    /// What the parent's right-hand side loses, `B^T D^-1 r = V^T Delta^-1 y`.
    #[inline(always)]
    pub fn passed_on(&self, y: &[T; 6]) -> [T; 6] {
        let mut out = [T::zero(); 6];
        for k in 0..6 {
            let scaled = y[k] * self.inverse_pivots[k];
            for c in 0..6 {
                out[c] += self.coupling[k][c] * scaled;
            }
        }
        out
    }

    /// `x = L^-T Delta^-1 (y - V parent)`, in place.
    #[inline(always)]
    pub fn backward(&self, y: &mut [T; 6], parent: Option<&[T; 6]>) {
        if let Some(parent) = parent {
            for k in 0..6 {
                let mut sum = self.coupling[k][0] * parent[0];
                for c in 1..6 {
                    sum += self.coupling[k][c] * parent[c];
                }
                y[k] -= sum;
            }
        }
        for k in 0..6 {
            y[k] = y[k] * self.inverse_pivots[k];
        }
        for i in (1..6).rev() {
            for k in 0..i {
                let update = self.lower[below(i, k)] * y[i];
                y[k] -= update;
            }
        }
    }
}
