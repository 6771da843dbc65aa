//! Preconditioners that know one joint at a time: none, the diagonal, the 6x6 blocks.

use super::approximate_inverse::Precondition;
use crate::block::Block;
use crate::linear::operator::Operator;
use crate::system::System;
use kernels::Spatial;

/// M = I.
#[derive(Clone, Debug)]
pub(super) struct Raw;

impl Precondition for Raw {
    #[inline(always)]
    fn prepare(&mut self, _: &Operator, _: &System<f64>) {}

    #[inline(always)]
    fn apply(&mut self, _: &System<f64>, r: &[Spatial<f64>], z: &mut [Spatial<f64>]) -> f64 {
        let mut product = 0.0;
        for (r, z) in r.iter().zip(z) {
            *z = *r;
            product += r.dot(*r);
        }
        product
    }
}

/// M = the diagonal of A.
#[derive(Clone, Debug)]
pub(super) struct Jacobi {
    inverse: Vec<[f64; 6]>,
}

impl Jacobi {
    pub(super) fn new(joints: usize) -> Self {
        Self { inverse: vec![[0.0; 6]; joints] }
    }
}

impl Precondition for Jacobi {
    #[inline(always)]
    fn prepare(&mut self, operator: &Operator, system: &System<f64>) {
        for (joint, inverse) in self.inverse.iter_mut().enumerate() {
            *inverse = operator.diagonal(system, joint).to_array().map(|d| 1.0 / d);
        }
    }

    #[inline(always)]
    fn apply(&mut self, _: &System<f64>, r: &[Spatial<f64>], z: &mut [Spatial<f64>]) -> f64 {
        let mut product = 0.0;
        for ((r, z), inverse) in r.iter().zip(z).zip(&self.inverse) {
            let mut out = r.to_array();
            for (x, k) in out.iter_mut().zip(inverse) {
                *x *= k;
            }
            *z = Spatial::from_array(out);
            product += r.dot(*z);
        }
        product
    }
}

/// M = the 6x6 blocks on the diagonal of A.
#[derive(Clone, Debug)]
pub(super) struct BlockJacobi {
    inverse: Vec<Block<f64>>,
}

impl BlockJacobi {
    pub(super) fn new(joints: usize) -> Self {
        Self { inverse: vec![[[0.0; 6]; 6]; joints] }
    }
}

impl Precondition for BlockJacobi {
    #[inline(always)]
    fn prepare(&mut self, operator: &Operator, system: &System<f64>) {
        for (joint, inverse) in self.inverse.iter_mut().enumerate() {
            *inverse = inverted(operator.diagonal_block(system, joint));
        }
    }

    #[inline(always)]
    fn apply(&mut self, _: &System<f64>, r: &[Spatial<f64>], z: &mut [Spatial<f64>]) -> f64 {
        let mut product = 0.0;
        for ((r, z), inverse) in r.iter().zip(z).zip(&self.inverse) {
            let x = r.to_array();
            // Column by column (the inverse is symmetric), so that the six sums stay side by side.
            let mut out = [0.0; 6];
            for k in 0..6 {
                for row in 0..6 {
                    out[row] += inverse[k][row] * x[k];
                }
            }
            *z = Spatial::from_array(out);
            product += r.dot(*z);
        }
        product
    }
}

/// Inverse of a symmetric positive definite block: `D = L L^T`, then `L^-T L^-1`, symmetric to the last bit.
#[inline(always)]
#[expect(clippy::needless_range_loop, reason = "indices as in the formulas")]
fn inverted(mut d: Block<f64>) -> Block<f64> {
    for k in 0..6 {
        let pivot = d[k][k].sqrt();
        d[k][k] = pivot;
        for i in k + 1..6 {
            d[i][k] /= pivot;
        }
        for i in k + 1..6 {
            for j in k + 1..=i {
                d[i][j] -= d[i][k] * d[j][k];
            }
        }
    }
    // L^-1 in place, column by column.
    let mut lower = [[0.0; 6]; 6];
    for c in 0..6 {
        lower[c][c] = 1.0 / d[c][c];
        for i in c + 1..6 {
            let mut sum = 0.0;
            for k in c..i {
                sum -= d[i][k] * lower[k][c];
            }
            lower[i][c] = sum / d[i][i];
        }
    }
    let mut out = [[0.0; 6]; 6];
    for i in 0..6 {
        for j in 0..=i {
            let mut sum = 0.0;
            for k in i..6 {
                sum += lower[k][i] * lower[k][j];
            }
            out[i][j] = sum;
            out[j][i] = sum;
        }
    }
    out
}
