//! Moves of force within redundant pairs: contacts that push nearly the same places of the same bodies.
//!
//! The normal responses of neighbouring contacts of two rods are correlated by .998 and more, so that a sweep, which
//! holds one while it solves the other, moves force between them in about `1 / (1 - correlation)` sweeps. A move takes
//! force from the giver g to the taker k at once, each along its own impulse, `r = z / z_n`, or the taker along the giver's where
//! it sticks:
//!
//! ```text
//! z_g -= t r_g,   z_k += t r_k,   t = (s_g - s_k) / c,   0 <= t <= z_gn
//! s = r w,   c = r_g (W_gg r_g - W_gk r_k) + r_k (W_kk r_k - W_kg r_g)
//! ```
//!
//! With sticking contacts alone that is the minimum along the move. Where a contact slides, the work of its friction is no reason
//! to press less (Coulomb's law is no minimum's): `s = w_n` there, and c is no less than what the normal gaps answer. Cones are convex:
//! both stay in theirs. Where both stick then, the two tangents move to their minimum, too.

use std::ops::Range;

use super::cone::{Coulomb, length};
use super::delassus::{Block3, Row};
use super::problem::{Problem, View};

/// Correlation of two normal responses from which their contacts are redundant.
const REDUNDANT: f64 = 0.7;

/// Share of friction's bound from which a contact counts as one that slides: all but rounding errors.
const SLIDES: f64 = 1.0 - 1e-9;

/// Two contacts, and the block that couples the first to the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct RedundantPair {
    pair: [usize; 2],
    block: Block3,
}

/// Finds the partner of each of some contacts among those after it: the one whose response is most like its own.
pub(super) fn find(problem: &Problem, contacts: Range<usize>, pairs: &mut Vec<RedundantPair>) {
    let matrix = problem.matrix();
    pairs.clear();
    for a in contacts {
        let own = matrix.diagonal(a)[0][0];
        let (mut best, mut most) = (None, REDUNDANT * REDUNDANT);
        for (b, normal) in problem.operator.normals(a) {
            let square = normal * normal / (own * matrix.diagonal(b)[0][0]);
            if normal > 0.0 && square > most {
                (best, most) = (Some(b), square);
            }
        }
        if let Some(b) = best {
            pairs.push(RedundantPair { pair: [a, b], block: problem.operator.block(a, b) });
        }
    }
}

impl RedundantPair {
    /// The two contacts.
    pub(super) fn pair(&self) -> [usize; 2] {
        self.pair
    }

    /// Moves force from one to the other.
    #[inline(always)]
    pub(super) fn transfer(&self, view: &mut View<'_>) {
        let matrix = view.matrix();
        let mut state = State {
            z: self.pair.map(|k| view.unknown(k).force),
            w: self.pair.map(|k| view.gap_and_slip(k)),
            bounds: self.pair.map(|k| view.unknown(k).friction),
            own: self.pair.map(|k| *matrix.diagonal(k)),
            block: &self.block,
        };
        let normals = state.share_normals();
        if state.share_tangents() || normals {
            view.set_force(self.pair[0], state.z[0]);
            view.set_force(self.pair[1], state.z[1]);
        }
    }
}

/// A pair as it is: impulses, gaps and slips, what friction is at most, the blocks of W.
struct State<'a> {
    z: [Row; 2],
    w: [Row; 2],
    bounds: [Coulomb; 2],
    own: [Block3; 2],
    block: &'a Block3,
}

impl State<'_> {
    /// Whether a contact's friction is all that there may be.
    #[inline(always)]
    fn slides(&self, k: usize) -> bool {
        let ([n, x, y], bound) = (self.z[k], self.bounds[k]);
        n > 0.0 && length([x, y]) >= SLIDES * bound.most(n)
    }

    /// An impulse with the normal one, along the contact's own.
    #[inline(always)]
    fn ray(&self, k: usize) -> Row {
        self.z[k].map(|z| z / self.z[k][0])
    }

    /// What is left of the slope of the problem's minimum along a ray, which sliding friction is no part of.
    #[inline(always)]
    fn slope(&self, k: usize, ray: Row) -> f64 {
        let power = ray[1] * self.w[k][1] + ray[2] * self.w[k][2];
        ray[0] * self.w[k][0] + if self.slides(k) { power.max(0.0) } else { power }
    }

    /// What impulses `x` of contact `k` and `-y` of the other do to gap and slip of `k`.
    #[inline(always)]
    fn answer(&self, k: usize, x: Row, y: Row) -> Row {
        let across = |r: usize, c: usize| if k == 0 { self.block[r][c] } else { self.block[c][r] };
        [0, 1, 2].map(|r| {
            let of = |c: usize| self.own[k][r][c] * x[c] - across(r, c) * y[c];
            of(0) + of(1) + of(2)
        })
    }

    /// Moves normal force, from the one that is wider open; returns whether any.
    #[inline(always)]
    fn share_normals(&mut self) -> bool {
        let (giver, taker) = if self.w[0][0] > self.w[1][0] { (0, 1) } else { (1, 0) };
        let most = self.z[giver][0];
        if most <= 0.0 {
            return false;
        }
        let mut rays = [self.ray(giver); 2];
        if self.slides(taker) {
            rays[taker] = self.ray(taker);
        }
        let slope = self.slope(giver, rays[giver]) - self.slope(taker, rays[taker]);
        let answers = [self.answer(0, rays[0], rays[1]), self.answer(1, rays[1], rays[0])];
        let along = dot(rays[0], answers[0]) + dot(rays[1], answers[1]);
        let curvature = along.max(answers[0][0] + answers[1][0]);
        if slope <= 0.0 || curvature <= 1e-9 * (self.own[0][0][0] + self.own[1][0][0]) {
            return false;
        }
        let t = (slope / curvature).min(most);
        for r in 0..3 {
            self.z[giver][r] = if t == most { 0.0 } else { self.z[giver][r] - t * rays[giver][r] };
            self.z[taker][r] += t * rays[taker][r];
            self.w[giver][r] -= t * answers[giver][r];
            self.w[taker][r] += t * answers[taker][r];
        }
        true
    }

    /// Moves tangential force where both stick; returns whether any.
    #[inline(always)]
    fn share_tangents(&mut self) -> bool {
        let one = |k: usize, z: Row| length([z[1], z[2]]) < self.bounds[k].most(z[0]);
        let sticks = |z: &[Row; 2]| one(0, z[0]) && one(1, z[1]);
        // Tangents that point elsewhere are none.
        if self.block[1][1] <= 0.0 || self.block[2][2] <= 0.0 || !sticks(&self.z) {
            return false;
        }
        let k = |r: usize, c: usize| self.own[0][r][c] + self.own[1][r][c] - self.block[r][c] - self.block[c][r];
        let determinant = k(1, 1) * k(2, 2) - k(1, 2) * k(2, 1);
        if determinant <= 1e-18 * (self.own[0][1][1] * self.own[0][2][2]) {
            return false;
        }
        let [a, b] = [1, 2].map(|r| self.w[0][r] - self.w[1][r]);
        let x = (k(1, 2) * b - k(2, 2) * a) / determinant;
        let y = (k(2, 1) * a - k(1, 1) * b) / determinant;
        let [u, v] = self.z;
        let next = [[u[0], u[1] + x, u[2] + y], [v[0], v[1] - x, v[2] - y]];
        let moves = sticks(&next);
        if moves {
            self.z = next;
        }
        moves
    }
}

#[inline(always)]
fn dot(a: Row, b: Row) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
