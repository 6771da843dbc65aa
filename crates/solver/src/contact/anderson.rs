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

use super::operator::{Chunk, Row};
use super::problem::Problem;
use crate::kernel::dispatch::vectorized;
use crate::kernel::lane::Real;

/// Rounds that are kept.
const MOST: usize = 16;
/// Growth of a round's change, squared, above which it begins anew.
const GROWTH: f64 = 4.0;

/// Added to the diagonal of the least squares' matrix, relative to its largest: rounds that say the same make it singular.
const SHIFT: f64 = 1e-12;

/// One round: its change, what it came to, and `W dz` there; or the differences of these between two rounds.
#[derive(Default)]
struct Round {
    change: Vec<Row>,
    force: Vec<Row>,
    moved: Vec<Chunk>,
}

/// What is known of earlier rounds.
#[derive(Default)]
pub(super) struct Anderson {
    /// Square of the change of the last round, if there was one.
    last: Option<f64>,
    now: Round,
    before: Round,
    differences: Vec<Round>,
    /// Differences that count, and the place of the next.
    count: usize,
    next: usize,
    gram: [[f64; MOST]; MOST],
}

impl Anderson {
    /// Forgets all.
    pub(super) fn begin(&mut self) {
        self.last = None;
        self.count = 0;
        self.next = 0;
    }

    /// Extrapolates after a round that took impulses from `start` to where they are.
    pub(super) fn extrapolate(&mut self, problem: &mut Problem, start: &[Row]) {
        let now = &mut self.now;
        now.change.clear();
        now.force.clear();
        for (unknown, start) in problem.unknowns().iter().zip(start) {
            now.force.push(unknown.force);
            now.change.push([0, 1, 2].map(|k| unknown.force[k] - start[k]));
        }
        now.moved.clone_from(problem.operator.all_moved());
        let size = dot(problem, &now.change, &now.change);
        match self.last {
            Some(last) if size <= GROWTH * last => self.take_difference(problem),
            _ => self.begin(),
        }
        self.last = Some(size);
        std::mem::swap(&mut self.now, &mut self.before);
        if self.count == 0 {
            return;
        }
        let mut gamma = [0.0; MOST];
        for (k, gamma) in gamma.iter_mut().enumerate().take(self.count) {
            *gamma = dot(problem, &self.differences[k].change, &self.before.change);
        }
        if !solve(self.gram, &mut gamma, self.count) {
            self.begin();
            return;
        }
        let Self { before, differences, now, count, .. } = self;
        now.force.clone_from(&before.force);
        vectorized(
            #[inline(always)]
            || {
                for (difference, &gamma) in differences.iter().zip(&gamma).take(*count) {
                    let by = Chunk::splat(gamma);
                    for (moved, difference) in problem.operator.all_moved().iter_mut().zip(&difference.moved) {
                        *moved -= *difference * by;
                    }
                    for (force, difference) in now.force.iter_mut().zip(&difference.force) {
                        *force = [0, 1, 2].map(|k| force[k] - gamma * difference[k]);
                    }
                }
                for (k, &known) in now.force.iter().enumerate() {
                    let friction = problem.unknowns()[k].friction;
                    let force = friction.within_rest([known[0].max(0.0), known[1], known[2]]);
                    problem.set_force_from(k, force, known);
                }
            },
        );
    }

    /// Keeps the difference between the last round and this one.
    fn take_difference(&mut self, problem: &Problem) {
        let Self { now, before, differences, count, next, gram, .. } = self;
        if differences.len() <= *next {
            differences.push(Round::default());
        }
        let difference = &mut differences[*next];
        let rows = |out: &mut Vec<Row>, a: &[Row], b: &[Row]| {
            out.clear();
            out.extend(a.iter().zip(b).map(|(a, b)| [a[0] - b[0], a[1] - b[1], a[2] - b[2]]));
        };
        rows(&mut difference.change, &now.change, &before.change);
        rows(&mut difference.force, &now.force, &before.force);
        difference.moved.clear();
        difference.moved.extend(now.moved.iter().zip(&before.moved).map(|(&a, &b)| a - b));
        *count = (*count + 1).min(MOST);
        for other in 0..*count {
            let product = dot(problem, &differences[*next].change, &differences[other].change);
            gram[*next][other] = product;
            gram[other][*next] = product;
        }
        *next = (*next + 1) % MOST;
    }
}

/// `a^T diag(W) b`.
fn dot(problem: &Problem, a: &[Row], b: &[Row]) -> f64 {
    let mut sum = 0.0;
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        let d = problem.diagonal(k);
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
