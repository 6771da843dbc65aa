//! Symmetric indefinite factors `P A P^T = L D L^T` of small matrices, with their inertia (Bunch and Parlett 1971).

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use nalgebra::SMatrix;

/// Factor of a symmetric N x N matrix; D has blocks of one and of two rows.
#[derive(Clone, Copy, Debug)]
pub struct Ldl<const N: usize> {
    /// L below its diagonal, D on it and beside it.
    factors: SMatrix<f64, N, N>,
    /// Row of the matrix that each row of the factor is.
    order: [usize; N],
    /// Whether a block of two rows begins at a row of the factor.
    pairs: [bool; N],
    /// Number of negative eigenvalues.
    pub negative: usize,
}

/// Growth is least for this share of the largest entry as the least diagonal pivot: `(1 + sqrt 17) / 8`.
const SHARE: f64 = 0.640_388_203_202_208;

impl<const N: usize> Ldl<N> {
    /// Factors a symmetric matrix; `None` where it is singular or not finite.
    pub fn new(mut a: SMatrix<f64, N, N>) -> Option<Self> {
        let mut order: [usize; N] = std::array::from_fn(|k| k);
        let (mut pairs, mut negative) = ([false; N], 0);
        let mut k = 0;
        while k < N {
            let (mut diagonal, mut beside) = ((0.0, k), (0.0, k, k));
            for c in k..N {
                if a[(c, c)].abs() > diagonal.0 {
                    diagonal = (a[(c, c)].abs(), c);
                }
                for r in c + 1..N {
                    if a[(r, c)].abs() > beside.0 {
                        beside = (a[(r, c)].abs(), r, c);
                    }
                }
            }
            let mut exchange = |a: &mut SMatrix<f64, N, N>, i: usize, j: usize| {
                a.swap_rows(i, j);
                a.swap_columns(i, j);
                order.swap(i, j);
            };
            if diagonal.0 >= SHARE * beside.0 {
                exchange(&mut a, k, diagonal.1);
                let pivot = a[(k, k)];
                if !pivot.is_finite() || pivot == 0.0 {
                    return None;
                }
                negative += usize::from(pivot < 0.0);
                for c in k + 1..N {
                    let share = a[(c, k)] / pivot;
                    for r in c..N {
                        let change = a[(r, k)] * share;
                        a[(r, c)] -= change;
                        a[(c, r)] = a[(r, c)];
                    }
                }
                for r in k + 1..N {
                    a[(r, k)] /= pivot;
                }
                k += 1;
                continue;
            }
            // The largest entry and its mirror image: one eigenvalue of each sign.
            exchange(&mut a, k, beside.2);
            exchange(&mut a, k + 1, beside.1);
            let (p, q, r) = (a[(k, k)], a[(k + 1, k)], a[(k + 1, k + 1)]);
            let determinant = p * r - q * q;
            if !determinant.is_finite() || determinant == 0.0 {
                return None;
            }
            pairs[k] = true;
            negative += 1;
            let solved = |x: f64, y: f64| [(r * x - q * y) / determinant, (p * y - q * x) / determinant];
            for c in k + 2..N {
                let [x, y] = solved(a[(c, k)], a[(c, k + 1)]);
                for row in c..N {
                    let change = a[(row, k)] * x + a[(row, k + 1)] * y;
                    a[(row, c)] -= change;
                    a[(c, row)] = a[(row, c)];
                }
            }
            for row in k + 2..N {
                let [x, y] = solved(a[(row, k)], a[(row, k + 1)]);
                (a[(row, k)], a[(row, k + 1)]) = (x, y);
            }
            k += 2;
        }
        Some(Self { factors: a, order, pairs, negative })
    }

    /// `A^-1 B`.
    pub fn solve<const M: usize>(&self, b: &SMatrix<f64, N, M>) -> SMatrix<f64, N, M> {
        let mut x: [[f64; M]; N] = std::array::from_fn(|k| std::array::from_fn(|column| b[(self.order[k], column)]));
        self.solve_in_place(&mut x);
        let mut out = SMatrix::zeros();
        for (k, row) in x.into_iter().enumerate() {
            for (column, x) in row.into_iter().enumerate() {
                out[(self.order[k], column)] = x;
            }
        }
        out
    }

    /// All columns side by side.
    fn solve_in_place<const M: usize>(&self, x: &mut [[f64; M]; N]) {
        fn subtract<const M: usize>(from: &mut [f64; M], factor: f64, row: [f64; M]) {
            for (own, x) in from.iter_mut().zip(row) {
                *own -= factor * x;
            }
        }
        let a = &self.factors;
        let mut k = 0;
        while k < N {
            let width = 1 + usize::from(self.pairs[k]);
            for c in k..k + width {
                let done = x[c];
                for row in k + width..N {
                    subtract(&mut x[row], a[(row, c)], done);
                }
            }
            if width == 1 {
                let inverse = 1.0 / a[(k, k)];
                x[k] = x[k].map(|x| x * inverse);
            } else {
                let (p, q, r) = (a[(k, k)], a[(k + 1, k)], a[(k + 1, k + 1)]);
                let inverse = 1.0 / (p * r - q * q);
                for column in 0..M {
                    let (first, second) = (x[k][column] * inverse, x[k + 1][column] * inverse);
                    (x[k][column], x[k + 1][column]) = (r * first - q * second, p * second - q * first);
                }
            }
            k += width;
        }
        // L^T: a block's rows do not depend on each other.
        for k in (0..N).rev() {
            let first = k + 1 + usize::from(self.pairs[k]);
            for row in first..N {
                let done = x[row];
                subtract(&mut x[k], a[(row, k)], done);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{SVector, SymmetricEigen};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    type Matrix = SMatrix<f64, 7, 7>;

    #[test]
    fn random_matrices_are_solved_and_their_negative_eigenvalues_counted() {
        let rng = &mut ChaCha8Rng::seed_from_u64(4);
        let mut counts = [0; 8];
        for k in 0..200 {
            let half = Matrix::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let mut a = half + half.transpose() + Matrix::identity() * rng.random_range(-4.0..4.0);
            if k % 2 == 0 {
                // Nothing on the diagonal to begin with, as of constraints.
                a.fill_diagonal(0.0);
            }
            let b = SVector::<f64, 7>::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let values = SymmetricEigen::new(a).eigenvalues;
            let smallest = values.abs().min();
            let factor = Ldl::new(a).unwrap();
            let error = (a * factor.solve(&b) - b).norm();
            assert!(error < 1e-13 * values.abs().max() / smallest, "{error:e}");
            let negative = values.iter().filter(|&&value| value < 0.0).count();
            assert_eq!(factor.negative, negative);
            counts[negative] += 1;
        }
        assert!(counts.iter().filter(|&&count| count > 5).count() > 5, "{counts:?}");
    }

    #[test]
    fn what_is_singular_or_not_finite_has_no_factor() {
        assert!(Ldl::new(Matrix::zeros()).is_none());
        assert!(Ldl::new(Matrix::from_element(f64::NAN)).is_none());
        let ones = Matrix::from_element(1.0);
        assert!(Ldl::new(ones).is_none());
    }
}
