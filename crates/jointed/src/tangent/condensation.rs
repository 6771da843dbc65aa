//! Three rows of a joint in series with what is beyond it: the elimination of what they yield.
//!
//! With the compliance `alpha = L delta L^T` (L unit lower triangular) and the stiffness K of what is beyond, what the rows
//! yield is L xi, where
//!
//! ```text
//! (1/delta + L^T K L) xi = L^T (b + G u)
//! ```
//!
//! for a movement u of what comes later and forces b. Row by row the pivots are `(1 + delta_k p_k) / delta_k`, of which
//! `1 + delta_k p_k` is regular however small delta_k is. All are positive where the energy beyond the joint is at a minimum
//! with u held.

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use super::stiffness::Stiffness;
use kernels::lane::{Both, Real};
use kernels::math::{Sym3, Vec3};

/// A compliance below this share of the row's entry is rounding error.
const NEGLIGIBLE: f64 = 1e-14;

/// A symmetric positive semidefinite 3 x 3 matrix `L delta L^T`.
#[derive(Clone, Copy, Debug)]
pub struct Root<T> {
    /// delta.
    pub(super) diagonal: [T; 3],
    /// Entries (1, 0), (2, 0), (2, 1) of L.
    pub(super) lower: [T; 3],
}

impl<T: Real> Root<T> {
    /// Zero, to be overwritten.
    pub(super) fn zero() -> Self {
        Self { diagonal: [T::zero(); 3], lower: [T::zero(); 3] }
    }

    /// The root of a compliance, which is positive or zero.
    #[inline(always)]
    pub fn new(Sym3([xx, yy, zz, xy, xz, yz]): Sym3<T>) -> Self {
        // The pivot and its reciprocal, both zero where it is negligible.
        let pivot = |d: T, of: T| {
            let zero = T::zero();
            let excess = d - (of * T::splat(NEGLIGIBLE)).max(T::splat(f64::MIN_POSITIVE));
            (excess.select(d, zero), excess.select(T::splat(1.0) / d, zero))
        };
        let (d0, inverse) = pivot(xx, xx);
        let (l10, l20) = (xy * inverse, xz * inverse);
        let (d1, inverse) = pivot(yy - l10 * xy, yy);
        let rest = yz - l20 * xy;
        let l21 = rest * inverse;
        let (d2, _) = pivot(zz - l20 * xz - l21 * rest, zz);
        Self { diagonal: [d0, d1, d2], lower: [l10, l20, l21] }
    }

    /// That of the sum of `c_i v_i v_i^T`, however much larger one of the c is than others: pivots are quotients of leading minors,
    /// which are sums of squares (the formula of Binet and Cauchy), so that nothing cancels.
    pub fn of_columns(c: [T; 3], v: [Vec3<T>; 3]) -> Self {
        let (zero, least) = (T::zero(), T::splat(f64::MIN_POSITIVE));
        // The quotient, zero where there is no pivot.
        let over = |x: T, d: T| (d - least).select(x / d, zero);
        let sum = |of: &dyn Fn(usize) -> T| of(0) + of(1) + of(2);
        let first = sum(&|i| c[i] * v[i].0[0] * v[i].0[0]);
        let lower = [1, 2].map(|row| over(sum(&|i| c[i] * v[i].0[row] * v[i].0[0]), first));
        // Of two columns each, the minors of rows 0 and 1, and of rows 0 and 2.
        let pair = |i: usize| ((i + 1) % 3, (i + 2) % 3);
        let minor = |i: usize, row: usize| {
            let (j, k) = pair(i);
            v[j].0[0] * v[k].0[row] - v[j].0[row] * v[k].0[0]
        };
        let weight = |i: usize| c[pair(i).0] * c[pair(i).1];
        let second = sum(&|i| weight(i) * minor(i, 1) * minor(i, 1));
        let last = over(sum(&|i| weight(i) * minor(i, 1) * minor(i, 2)), second);
        let volume = v[0].cross(v[1]).dot(v[2]);
        // In this order, as the product of all three may be too large.
        let third = over(weight(2), second) * c[2] * volume * volume;
        Self { diagonal: [first, over(second, first), third], lower: [lower[0], lower[1], last] }
    }

    /// `other` in the lanes where `which` is not negative.
    pub fn select(&self, which: T, other: &Self) -> Self {
        let choose = |own: [T; 3], other: [T; 3]| std::array::from_fn(|k| which.select(other[k], own[k]));
        Self { diagonal: choose(self.diagonal, other.diagonal), lower: choose(self.lower, other.lower) }
    }

    /// Two side by side.
    #[inline(always)]
    pub(super) fn both(a: &Self, b: &Self) -> Root<Both<T>> {
        Root { diagonal: Both::zip(a.diagonal, b.diagonal), lower: Both::zip(a.lower, b.lower) }
    }

    /// The inverse, with entries of delta of `least` at least, and a number that is not negative where there is one: they may
    /// vanish all the same.
    pub(super) fn inverse(&self, least: T) -> (Sym3<T>, T) {
        let (one, zero) = (T::splat(1.0), T::zero());
        let [l10, l20, l21] = self.lower;
        let rows = [[one, zero, zero], [-l10, one, zero], [l10 * l21 - l20, -l21, one]];
        let (mut sum, mut exists) = (Sym3::zero(), one);
        for (row, delta) in rows.into_iter().zip(self.diagonal) {
            let delta = delta.max(least);
            for lane in 0..T::LANES {
                if !(delta.lane(lane) > 0.0 && delta.lane(lane).is_finite()) {
                    exists.set_lane(lane, -1.0);
                }
            }
            sum += Sym3::outer(Vec3(row), one / delta);
        }
        (sum, exists)
    }

    /// `L^T x` of three rows.
    #[inline(always)]
    fn gather<const N: usize>(&self, mut rows: [[T; N]; 3]) -> [[T; N]; 3] {
        let [l10, l20, l21] = self.lower;
        for c in 0..N {
            rows[0][c] += l10 * rows[1][c] + l20 * rows[2][c];
            rows[1][c] += l21 * rows[2][c];
        }
        rows
    }

    /// `L x`.
    #[inline(always)]
    pub(super) fn apply(&self, [x0, x1, x2]: [T; 3]) -> Vec3<T> {
        let [l10, l20, l21] = self.lower;
        Vec3([x0, x1 + l10 * x0, x2 + l20 * x0 + l21 * x1])
    }

    /// `L^-T x`.
    #[inline(always)]
    pub(super) fn apply_inverse_transposed(&self, [x0, x1, x2]: [T; 3]) -> Vec3<T> {
        let [l10, l20, l21] = self.lower;
        let x1 = x1 - l21 * x2;
        Vec3([x0 - l10 * x1 - l20 * x2, x1, x2])
    }
}

/// Right-hand sides of three rows, forward substituted: of M numbers, the first of which is 1; the others are the movement of a
/// body that comes last.
pub(super) type Alone<T, const M: usize> = [[T; M]; 3];

/// Three rows that have been eliminated. What they do is linear in the movement u of what comes later and in the M numbers of
/// [`Alone`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Condensation<T> {
    pub(super) root: Root<T>,
    /// What u adds to the right-hand side, forward substituted.
    rows: [[T; 6]; 3],
    /// Entries (1, 0), (2, 0), (2, 1) of what is left of `L^T K L`.
    lower: [T; 3],
    /// Reciprocals of `1 + delta_k p_k`.
    inverse: [T; 3],
}

impl<T: Real> Condensation<T> {
    /// Zero, to be overwritten.
    pub(super) fn zero() -> Self {
        let zero = T::zero();
        Self { root: Root::zero(), rows: [[zero; 6]; 3], lower: [zero; 3], inverse: [zero; 3] }
    }

    /// Eliminates rows with the compliance of `root`, given K, and the rows of G and of b; returns b's, forward substituted,
    /// too.
    #[inline(always)]
    pub(super) fn new<const M: usize>(
        root: Root<T>,
        k: Sym3<T>,
        rows: [[T; 6]; 3],
        alone: Alone<T, M>,
    ) -> (Self, Alone<T, M>) {
        let one = T::splat(1.0);
        let [l10, l20, l21] = root.lower;
        let Sym3([k00, k11, k22, k01, k02, k12]) = k;
        // K's columns times the first column of L, then L^T K L.
        let first = [k00 + l10 * k01 + l20 * k02, k01 + l10 * k11 + l20 * k12, k02 + l10 * k12 + l20 * k22];
        let m00 = first[0] + l10 * first[1] + l20 * first[2];
        let (m10, m20) = (first[1] + l21 * first[2], first[2]);
        let m21 = k12 + l21 * k22;
        let m11 = k11 + l21 * k12 + l21 * m21;
        let (mut rows, mut alone) = (root.gather(rows), root.gather(alone));
        let [d0, d1, d2] = root.diagonal;
        let inverse0 = one / (one + d0 * m00);
        let q0 = d0 * inverse0;
        let (c10, c20) = (m10 * q0, m20 * q0);
        let m11 = m11 - c10 * m10;
        let m21 = m21 - c10 * m20;
        let m22 = k22 - c20 * m20;
        let inverse1 = one / (one + d1 * m11);
        let c21 = m21 * (d1 * inverse1);
        let inverse2 = one / (one + d2 * (m22 - c21 * m21));
        subtract(&mut rows, [c10, c20, c21]);
        subtract(&mut alone, [c10, c20, c21]);
        (Self { root, rows, lower: [m10, m20, m21], inverse: [inverse0, inverse1, inverse2] }, alone)
    }

    /// Whether all pivots are positive, in all lanes.
    #[inline(always)]
    pub(super) fn is_positive(&self) -> bool {
        let mut positive = true;
        for lane in 0..T::LANES {
            positive &= self.is_positive_in(lane);
        }
        positive
    }

    /// Whether they are in one lane.
    #[inline(always)]
    pub(super) fn is_positive_in(&self, lane: usize) -> bool {
        let [a, b, c] = self.inverse;
        (a.lane(lane) > 0.0) & (b.lane(lane) > 0.0) & (c.lane(lane) > 0.0)
    }

    /// Whether no pivot vanishes or is not a number, in one lane.
    pub(super) fn is_regular_in(&self, lane: usize) -> bool {
        self.inverse.iter().all(|inverse| inverse.lane(lane).is_finite())
    }

    /// Negative pivots, in one lane.
    pub(super) fn negative_in(&self, lane: usize) -> usize {
        self.inverse.iter().filter(|inverse| inverse.lane(lane) < 0.0).count()
    }

    /// A row's reciprocal of its pivot.
    #[inline(always)]
    pub(super) fn weight(&self, k: usize) -> T {
        self.root.diagonal[k] * self.inverse[k]
    }

    /// Takes what the rows yield off the stiffness and the forces (whose sign is that of b) that come later.
    #[inline(always)]
    pub(super) fn take_off<const M: usize>(
        &self,
        alone: &Alone<T, M>,
        stiffness: &mut Stiffness<T>,
        forces: &mut [[T; M]; 6],
    ) {
        for k in 0..3 {
            let (row, weight) = (self.rows[k], self.weight(k));
            stiffness.subtract(row, weight);
            for r in 0..6 {
                let share = row[r] * weight;
                for c in 0..M {
                    forces[r][c] -= share * alone[k][c];
                }
            }
        }
    }

    /// What the rows yield, and what they transmit, for a movement u and the M numbers.
    #[inline(always)]
    pub(super) fn solve<const M: usize>(&self, alone: &Alone<T, M>, u: [T; 6], numbers: &[T; M]) -> [Vec3<T>; 2] {
        let mut w = [T::zero(); 3];
        for k in 0..3 {
            for c in 0..6 {
                w[k] += self.rows[k][c] * u[c];
            }
            for c in 0..M {
                w[k] += alone[k][c] * numbers[c];
            }
        }
        let ([m10, m20, m21], [d0, d1, d2]) = (self.lower, self.root.diagonal);
        let x2 = w[2] * self.inverse[2];
        let y2 = x2 * d2;
        let x1 = (w[1] - m21 * y2) * self.inverse[1];
        let y1 = x1 * d1;
        let x0 = (w[0] - m10 * y1 - m20 * y2) * self.inverse[0];
        [self.root.apply([x0 * d0, y1, y2]), self.root.apply_inverse_transposed([x0, x1, x2])]
    }

    /// Another right-hand side, forward substituted, less what the rows are for a movement u.
    #[inline(always)]
    pub(super) fn take(&self, [x, y, z]: [T; 3], u: [T; 6]) -> Alone<T, 1> {
        let mut alone = self.root.gather([[x], [y], [z]]);
        subtract(&mut alone, self.reduction());
        let moved = self.along(u);
        for k in 0..3 {
            alone[k][0] -= moved[k];
        }
        alone
    }

    /// The rows, forward substituted, along a movement.
    #[inline(always)]
    pub(super) fn along(&self, u: [T; 6]) -> [T; 3] {
        let mut out = [T::zero(); 3];
        for k in 0..3 {
            for c in 0..6 {
                out[k] += self.rows[k][c] * u[c];
            }
        }
        out
    }

    /// Undoes the forward substitution of three rows.
    #[inline(always)]
    pub(super) fn undone(&self, [x0, x1, x2]: [T; 3]) -> Vec3<T> {
        let [c10, c20, c21] = self.reduction();
        self.root.apply_inverse_transposed([x0, x1 + c10 * x0, x2 + c20 * x0 + c21 * x1])
    }

    /// Takes off forces what the rows yield to `of_shifts`, in the first three of them, and to `of_turns`.
    #[inline(always)]
    pub(super) fn take_off_forces(&self, of_shifts: [T; 3], of_turns: [T; 3], forces: &mut [T; 6]) {
        for k in 0..3 {
            let weight = self.weight(k);
            let (shift, turn) = (weight * of_shifts[k], weight * of_turns[k]);
            for r in 0..3 {
                forces[r] -= self.rows[k][r] * shift;
                forces[3 + r] -= self.rows[k][3 + r] * turn;
            }
        }
    }

    /// Shares of rows that the elimination has taken off later ones: entries (1, 0), (2, 0), (2, 1).
    #[inline(always)]
    fn reduction(&self) -> [T; 3] {
        let ([m10, m20, m21], first) = (self.lower, self.weight(0));
        [m10 * first, m20 * first, m21 * self.weight(1)]
    }
}

/// Forward substitution of three rows.
#[inline(always)]
fn subtract<T: Real, const N: usize>(rows: &mut [[T; N]; 3], [c10, c20, c21]: [T; 3]) {
    for c in 0..N {
        rows[1][c] -= c10 * rows[0][c];
        rows[2][c] = rows[2][c] - c20 * rows[0][c] - c21 * rows[1][c];
    }
}
