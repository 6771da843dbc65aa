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

use std::ops::Range;

use super::operator::{Chunk, Row};
use super::problem::{Matrix, Unknown, View};
use crate::kernel::lane::Real;

/// Rounds that are kept.
const MOST: usize = 16;
/// Growth of a round's change, squared, above which it begins anew.
const GROWTH: f64 = 4.0;

/// Added to the diagonal of the least squares' matrix, relative to its largest: rounds that say the same make it singular.
const SHIFT: f64 = 1e-12;

/// One round: its change times the roots of diag(W), what it came to, three numbers a contact one after the other, and `W dz`
/// there; or the differences of these between two rounds.
#[derive(Default)]
struct Round {
    change: Vec<Chunk>,
    force: Vec<Chunk>,
    moved: Vec<Chunk>,
}

/// What is known of earlier rounds of some contacts side by side, and of a part of `W dz`: what one thread works on.
#[derive(Default)]
pub(super) struct Share {
    now: Round,
    before: Round,
    differences: Vec<Round>,
    /// Where the next round begins.
    begins: Vec<Chunk>,
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
        let chunks = (3 * unknowns.len()).div_ceil(Chunk::LANES);
        for flat in [&mut now.change, &mut now.force] {
            flat.clear();
            flat.resize(chunks, Chunk::zero());
        }
        for (k, (unknown, start)) in unknowns.iter().zip(start).enumerate() {
            let weight = matrix.diagonal(first + k);
            for r in 0..3 {
                let (chunk, lane) = place(k, r);
                now.force[chunk].0[lane] = unknown.force[r];
                now.change[chunk].0[lane] = (unknown.force[r] - start[r]) * weight[r][r].sqrt();
            }
        }
        now.moved.clear();
        now.moved.extend_from_slice(moved);
        self.square = dot(&now.change, &now.change);
    }

    /// Keeps the difference between the last two rounds.
    #[inline(always)]
    pub(super) fn differ(&mut self, anderson: &Anderson) {
        let Self { now, before, differences, products, .. } = self;
        let Anderson { count, next, .. } = *anderson;
        if differences.len() <= next {
            differences.push(Round::default());
        }
        let difference = &mut differences[next];
        subtract(&mut difference.change, &now.change, &before.change);
        subtract(&mut difference.force, &now.force, &before.force);
        subtract(&mut difference.moved, &now.moved, &before.moved);
        let newest = &differences[next].change;
        for (k, other) in differences.iter().enumerate().take((count + 1).min(MOST)) {
            products[0][k] = dot(newest, &other.change);
            products[1][k] = dot(&now.change, &other.change);
        }
    }

    /// Extrapolates: takes `W dz` where the next round begins, and keeps the impulses there for [`Share::begin_round`].
    #[inline(always)]
    pub(super) fn extrapolate(&mut self, anderson: &Anderson, moved: &mut [Chunk]) {
        let Self { now, differences, begins, .. } = self;
        begins.clone_from(&now.force);
        // Four at a time: memory is what takes the time.
        for (four, gamma) in differences[..anderson.count].chunks(4).zip(anderson.gamma.chunks(4)) {
            go_back(moved, [0, 1, 2, 3].map(|k| four.get(k).map(|difference| &*difference.moved)), gamma);
            go_back(begins, [0, 1, 2, 3].map(|k| four.get(k).map(|difference| &*difference.force)), gamma);
        }
    }

    /// Takes the impulses of these `contacts` where the next round begins, and back into their cones.
    #[inline(always)]
    pub(super) fn begin_round(&self, view: &mut View<'_>, contacts: Range<usize>) {
        for k in 0..contacts.len() {
            let known = [0, 1, 2].map(|r| {
                let (chunk, lane) = place(k, r);
                self.begins[chunk].0[lane]
            });
            let contact = contacts.start + k;
            let friction = view.unknown(contact).friction;
            let force = friction.within_rest([known[0].max(0.0), known[1], known[2]]);
            view.set_force_from(contact, force, known);
        }
    }
}

/// Where the number `r` of a contact's three is among chunks.
#[inline(always)]
fn place(contact: usize, r: usize) -> (usize, usize) {
    ((3 * contact + r) / Chunk::LANES, (3 * contact + r) % Chunk::LANES)
}

/// `a - b`.
#[inline(always)]
fn subtract(out: &mut Vec<Chunk>, a: &[Chunk], b: &[Chunk]) {
    out.clear();
    out.extend_from_slice(a);
    for (out, &b) in out.iter_mut().zip(b) {
        *out -= b;
    }
}

/// `out -= sum gamma d` over up to four differences.
#[inline(always)]
fn go_back(out: &mut [Chunk], differences: [Option<&[Chunk]>; 4], gamma: &[f64]) {
    let by = [0, 1, 2, 3].map(|k| Chunk::splat(gamma[k]));
    if let [Some(a), Some(b), Some(c), Some(d)] = differences {
        for ((((out, &a), &b), &c), &d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            *out -= a * by[0] + b * by[1] + (c * by[2] + d * by[3]);
        }
        return;
    }
    for (difference, &by) in differences.into_iter().flatten().zip(&by) {
        for (out, &difference) in out.iter_mut().zip(difference) {
            *out -= difference * by;
        }
    }
}

/// `a^T b`.
#[inline(always)]
fn dot(a: &[Chunk], b: &[Chunk]) -> f64 {
    let mut sum = Chunk::zero();
    for (&a, &b) in a.iter().zip(b) {
        sum += a * b;
    }
    sum.0.iter().sum()
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
