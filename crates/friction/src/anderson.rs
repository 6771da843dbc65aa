//! Anderson's acceleration of a fixed-point iteration on the impulses of contacts.
//!
//! Rounds of sweeps take impulses z to G(z). With f = G(z) - z of the last rounds, and differences between one round and the
//! next (Anderson 1965; Walker and Ni 2011):
//!
//! ```text
//! gamma = argmin |f - dF gamma|,   z = G(z) - dG gamma,   |x|^2 = x^T diag(W) x
//! ```
//!
//! While contacts neither open nor close, stick nor slide anew, a round is linear, and this is a Krylov method on it. Where a round's
//! change is much larger than the one before, what is known of earlier rounds is forgotten.

use kernels::flat::{flat, flat_mut};

use super::delassus::{Chunk, Row};
use super::problem::{Matrix, Unknown, View};

/// Rounds that are kept: more say nothing of contacts that open, close, stick or slide in between.
const MOST: usize = 4;
/// Growth of a round's change, squared, above which it begins anew.
const GROWTH: f64 = 2.0;

/// Added to the diagonal of the least squares' matrix, relative to its largest: rounds that say the same make it singular.
const SHIFT: f64 = 1e-12;

/// One round: its change, what it came to, and `W dz` there; or the differences of these between two rounds.
#[derive(Default)]
struct Round {
    change: Vec<Row>,
    force: Vec<Row>,
    moved: Vec<Chunk>,
}

/// What is known of earlier rounds of some contacts side by side, and of a part of `W dz`: what one thread works on.
#[derive(Default)]
pub(super) struct Share {
    now: Round,
    before: Round,
    differences: Vec<Round>,
    /// Where the next round begins.
    begins: Vec<Row>,
    /// This share of the square of the last change, and of products of the newest difference, and of the last change, with all
    /// differences.
    pub(super) square: f64,
    products: [[f64; MOST]; 2],
}

/// What is known of earlier rounds of all contacts.
#[derive(Default)]
pub(super) struct Anderson {
    /// Square of the change of the last round, if there was one.
    last: Option<f64>,
    /// Differences that count, and the place of the next.
    count: usize,
    next: usize,
    gram: [[f64; MOST]; MOST],
    gamma: [f64; MOST],
}

impl Anderson {
    /// Forgets all.
    pub(super) fn begin(&mut self) {
        self.last = None;
        self.count = 0;
        self.next = 0;
    }

    /// Takes over a round, whose change has this square; returns whether there is a difference to the one before, for
    /// [`Share::differ`].
    pub(super) fn take_round(&mut self, square: f64) -> bool {
        let goes_on = self.last.is_some_and(|last| square <= GROWTH * last);
        if !goes_on {
            self.begin();
        }
        self.last = Some(square);
        goes_on
    }

    /// Takes over the difference, which all `shares` have made; returns whether [`Share::extrapolate`] may follow.
    pub(super) fn take_difference<'a>(&mut self, shares: impl Iterator<Item = &'a Share> + Clone) -> bool {
        self.count = (self.count + 1).min(MOST);
        let sum = |which: usize, k: usize| shares.clone().map(|share| share.products[which][k]).sum::<f64>();
        for k in 0..self.count {
            let product = sum(0, k);
            self.gram[self.next][k] = product;
            self.gram[k][self.next] = product;
            self.gamma[k] = sum(1, k);
        }
        self.next = (self.next + 1) % MOST;
        let is_solved = solve(self.gram, &mut self.gamma, self.count);
        if !is_solved {
            self.begin();
        }
        is_solved
    }
}

impl Share {
    /// Takes over a round of these contacts, the first of which is number `first`, that began at `start`.
    #[inline(always)]
    pub(super) fn note(
        &mut self,
        matrix: Matrix<'_>,
        (unknowns, first): (&[Unknown], usize),
        start: &[Row],
        moved: &[Chunk],
    ) {
        let Self { now, before, .. } = self;
        std::mem::swap(now, before);
        now.change.clear();
        now.force.clear();
        for (unknown, start) in unknowns.iter().zip(start) {
            now.force.push(unknown.force);
            now.change.push([0, 1, 2].map(|k| unknown.force[k] - start[k]));
        }
        now.moved.clear();
        now.moved.extend_from_slice(moved);
        self.square = dot(matrix, first, &now.change, &now.change);
    }

    /// Keeps the difference between the last two rounds.
    #[inline(always)]
    pub(super) fn differ(&mut self, matrix: Matrix<'_>, first: usize, anderson: &Anderson) {
        let Self { now, before, differences, products, .. } = self;
        let Anderson { count, next, .. } = *anderson;
        if differences.len() <= next {
            differences.push(Round::default());
        }
        let difference = &mut differences[next];
        let rows = |out: &mut Vec<Row>, a: &[Row], b: &[Row]| {
            out.clear();
            out.extend(a.iter().zip(b).map(|(a, b)| [a[0] - b[0], a[1] - b[1], a[2] - b[2]]));
        };
        rows(&mut difference.change, &now.change, &before.change);
        rows(&mut difference.force, &now.force, &before.force);
        difference.moved.clear();
        difference.moved.extend(now.moved.iter().zip(&before.moved).map(|(&a, &b)| a - b));
        for k in 0..(count + 1).min(MOST) {
            products[0][k] = dot(matrix, first, &differences[next].change, &differences[k].change);
            products[1][k] = dot(matrix, first, &differences[k].change, &now.change);
        }
    }

    /// Extrapolates: takes `W dz` where the next round begins, and keeps the impulses there for [`Share::begin_round`].
    #[inline(always)]
    pub(super) fn extrapolate(&mut self, anderson: &Anderson, moved: &mut [Chunk]) {
        let Self { now, differences, begins, .. } = self;
        begins.clone_from(&now.force);
        for (difference, &gamma) in differences.iter().zip(&anderson.gamma).take(anderson.count) {
            for (moved, difference) in flat_mut(moved).iter_mut().zip(flat(&difference.moved)) {
                *moved -= difference * gamma;
            }
            for (force, difference) in begins.iter_mut().zip(&difference.force) {
                *force = [0, 1, 2].map(|k| force[k] - gamma * difference[k]);
            }
        }
    }

    /// Takes the impulses of these contacts, the first of which is number `first`, where the next round begins, and back into their cones.
    #[inline(always)]
    pub(super) fn begin_round(&self, view: &mut View<'_>, first: usize) {
        for (k, &known) in self.begins.iter().enumerate() {
            let friction = view.unknown(first + k).friction;
            let force = friction.within([known[0].max(0.0), known[1], known[2]]);
            view.set_force_from(first + k, force, known);
        }
    }
}

/// `a^T diag(W) b`, of contacts from `first` on.
#[inline(always)]
fn dot(matrix: Matrix<'_>, first: usize, a: &[Row], b: &[Row]) -> f64 {
    let mut sum = 0.0;
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        let d = matrix.diagonal(first + k);
        sum += a[0] * d[0][0] * b[0] + a[1] * d[1][1] * b[1] + a[2] * d[2][2] * b[2];
    }
    sum
}

/// Solves a symmetric positive system of `size` equations in place; returns whether it is one.
fn solve(mut a: [[f64; MOST]; MOST], x: &mut [f64; MOST], size: usize) -> bool {
    let largest = (0..size).map(|k| a[k][k]).fold(0.0, f64::max);
    for (k, row) in a.iter_mut().enumerate().take(size) {
        row[k] += SHIFT * largest;
    }
    for k in 0..size {
        let (above, below) = a.split_at_mut(k + 1);
        let (x_above, x_below) = x.split_at_mut(k + 1);
        let pivot = &above[k];
        if pivot[k] <= 0.0 || !pivot[k].is_finite() {
            return false;
        }
        for (row, x) in below[..size - k - 1].iter_mut().zip(x_below) {
            let by = row[k] / pivot[k];
            for (entry, other) in row[k..size].iter_mut().zip(&pivot[k..size]) {
                *entry -= by * other;
            }
            *x -= by * x_above[k];
        }
    }
    for k in (0..size).rev() {
        for column in k + 1..size {
            x[k] -= a[k][column] * x[column];
        }
        x[k] /= a[k][k];
    }
    x[..size].iter().all(|x| x.is_finite())
}
