//! Symmetric 6 x 6 matrices over a shift and a turn of a body, and what joints see of them.
//!
//! A joint's Jacobian is `J = sigma [I, -[r]x; 0, -I]` with the arm r of its connector. It is its own inverse, so that all of
//! a body can be said in a joint's rows instead: a matrix is `J^T P J` there, in which the sign drops out.

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use kernels::Spatial;
use kernels::lane::{Both, Real};
use kernels::math::{Sym3, Vec3, map_rows, sum, transposed};

/// A matrix `[A, C; C^T, W]` over (dx, dphi), or over a joint's rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stiffness<T> {
    /// A [kg].
    pub(super) translation: Sym3<T>,
    /// C [kg m], row by row.
    pub(super) mixed: [[T; 3]; 3],
    /// W [kg m^2].
    pub(super) turning: Sym3<T>,
}

impl<T: Real> Stiffness<T> {
    /// One that does not couple shifts with turns.
    #[inline(always)]
    pub(super) fn of_parts(translation: Sym3<T>, turning: Sym3<T>) -> Self {
        Self { translation, mixed: [[T::zero(); 3]; 3], turning }
    }

    #[inline(always)]
    pub(super) fn plus(&self, other: &Self) -> Self {
        Self {
            translation: self.translation + other.translation,
            mixed: sum(self.mixed, other.mixed),
            turning: self.turning + other.turning,
        }
    }

    /// `J^T P J` for a connector with the arm r: from a body's (dx, dphi) to a joint's rows, or back.
    #[inline(always)]
    pub(super) fn seen(&self, r: Vec3<T>) -> Self {
        let d = sum(self.mixed, map_rows(self.translation.full(), |row| row.cross(r)));
        let first = map_rows(transposed(d), |column| column.cross(r));
        let second = map_rows(transposed(self.mixed), |column| column.cross(r));
        let entry = |i: usize, j: usize| first[j][i] + second[i][j];
        let added = Sym3([entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)]);
        Self { translation: self.translation, mixed: map_rows(d, |row| -row), turning: self.turning + added }
    }

    /// Subtracts `k x x^T`.
    #[inline(always)]
    pub(super) fn subtract(&mut self, x: [T; 6], k: T) {
        let mut scaled = x;
        for entry in &mut scaled {
            *entry = *entry * k;
        }
        const UPPER: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
        for (place, (r, c)) in UPPER.into_iter().enumerate() {
            self.translation.0[place] -= scaled[r] * x[c];
            self.turning.0[place] -= scaled[3 + r] * x[3 + c];
        }
        for r in 0..3 {
            for c in 0..3 {
                self.mixed[r][c] -= scaled[r] * x[3 + c];
            }
        }
    }

    /// This where `first` is not negative, else `other`.
    pub(super) fn select(&self, first: T, other: &Self) -> Self {
        let mut out = *other;
        for k in 0..6 {
            out.translation.0[k] = first.select(self.translation.0[k], other.translation.0[k]);
            out.turning.0[k] = first.select(self.turning.0[k], other.turning.0[k]);
        }
        for r in 0..3 {
            for c in 0..3 {
                out.mixed[r][c] = first.select(self.mixed[r][c], other.mixed[r][c]);
            }
        }
        out
    }

    /// `P x`.
    #[inline(always)]
    pub(super) fn apply(&self, x: Spatial<T>) -> Spatial<T> {
        let ([a, b, c], [x0, x1, x2]) = (self.mixed, x.linear.0);
        let mixed = Vec3([Vec3(a).dot(x.angular), Vec3(b).dot(x.angular), Vec3(c).dot(x.angular)]);
        Spatial {
            linear: self.translation.apply(x.linear) + mixed,
            angular: self.turning.apply(x.angular) + Vec3(a) * x0 + Vec3(b) * x1 + Vec3(c) * x2,
        }
    }

    /// Two side by side.
    #[inline(always)]
    pub(super) fn both(a: &Self, b: &Self) -> Stiffness<Both<T>> {
        let mut mixed = [[Both([T::zero(); 2]); 3]; 3];
        for k in 0..3 {
            mixed[k] = Both::zip(a.mixed[k], b.mixed[k]);
        }
        Stiffness {
            translation: Sym3(Both::zip(a.translation.0, b.translation.0)),
            mixed,
            turning: Sym3(Both::zip(a.turning.0, b.turning.0)),
        }
    }
}

impl<T: Real> Stiffness<Both<T>> {
    /// One of the two.
    #[inline(always)]
    pub(super) fn one(&self, k: usize) -> Stiffness<T> {
        let [a, b, c] = self.mixed;
        Stiffness {
            translation: Sym3(Both::pick(self.translation.0, k)),
            mixed: [Both::pick(a, k), Both::pick(b, k), Both::pick(c, k)],
            turning: Sym3(Both::pick(self.turning.0, k)),
        }
    }
}

/// `J x` for a connector with the arm r: a body's (dx, dphi) in a joint's rows, or back.
#[inline(always)]
pub(super) fn in_rows<T: Real>(sigma: T, r: Vec3<T>, x: Spatial<T>) -> Spatial<T> {
    Spatial { linear: (x.linear - r.cross(x.angular)) * sigma, angular: x.angular * -sigma }
}

/// `J^T x` likewise: forces and torques on a body in a joint's rows, or back.
#[inline(always)]
pub(super) fn on_rows<T: Real>(sigma: T, r: Vec3<T>, x: Spatial<T>) -> Spatial<T> {
    Spatial { linear: x.linear * sigma, angular: (r.cross(x.linear) - x.angular) * sigma }
}
