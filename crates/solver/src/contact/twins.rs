//! Moves of force between twins: contacts that push nearly the same places of the same bodies.
//!
//! The normal responses of neighbouring contacts of two rods are correlated by .998 and more, so that a sweep, which
//! holds one while it solves the other, moves force between them in about `1 / (1 - correlation)` sweeps. A move takes
//! force from the giver g to the taker k at once, along the giver's own impulse, `r = z_g / z_gn`, to the minimum there:
//!
//! ```text
//! z_g -= t r,   z_k += t r,   t = r (w_g - w_k) / (r K r),   0 <= t <= z_gn,   K = W_gg + W_kk - W_gk - W_kg
//! ```
//!
//! Friction goes along with the normal impulse, and cones are convex: both stay in theirs. Where both stick then, the two
//! tangents move to their minimum, too.

use super::cone::{Bound, length};
use super::operator::{Block3, Row};
use super::problem::Problem;
use crate::kernel::dispatch::vectorized;

/// Correlation of two normal responses from which their contacts are twins.
const TWINS: f64 = 0.7;

/// Two contacts, and the block that couples the first to the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Twins {
    pair: [usize; 2],
    block: Block3,
}

/// Finds each contact's twin among those after it: the nearest in order, so that moves go along a row of contacts.
pub(super) fn find(problem: &Problem, twins: &mut Vec<Twins>) {
    twins.clear();
    for a in 0..problem.unknowns().len() {
        let own = problem.diagonal(a)[0][0];
        let is_twin = |&(b, places): &(usize, [Option<usize>; 2])| {
            let normal = problem.operator.normals(a, places);
            normal > 0.0 && normal * normal > TWINS * TWINS * own * problem.diagonal(b)[0][0]
        };
        if let Some((b, places)) = problem.operator.coupled(a, a + 1).find(is_twin) {
            twins.push(Twins { pair: [a, b], block: problem.operator.block(a, places) });
        }
    }
}

/// Moves force between all of them, in turn.
pub(super) fn transfer(twins: &[Twins], problem: &mut Problem) {
    vectorized(
        #[inline(always)]
        || twins.iter().for_each(|twins| twins.transfer(problem)),
    );
}

impl Twins {
    /// Moves force from one to the other.
    #[inline(always)]
    fn transfer(&self, problem: &mut Problem) {
        let force = |k: usize| problem.unknowns()[k].force;
        let mut z = self.pair.map(force);
        if z[0][0] <= 0.0 && z[1][0] <= 0.0 {
            return;
        }
        let bounds = self.pair.map(|k| problem.unknowns()[k].friction);
        let diagonals = self.pair.map(|k| *problem.diagonal(k));
        let w = self.pair.map(|k| problem.gap_and_slip(k));
        let mut difference = [0, 1, 2].map(|r| w[0][r] - w[1][r]);
        let k = [0, 1, 2]
            .map(|r| [0, 1, 2].map(|c| diagonals[0][r][c] + diagonals[1][r][c] - self.block[r][c] - self.block[c][r]));
        let times = |x: Row| k.map(|row| dot(row, x));
        // From the one that is wider open.
        let (giver, sign) = if difference[0] > 0.0 { (0, 1.0) } else { (1, -1.0) };
        let most = z[giver][0];
        let mut moved = false;
        if most > 0.0 {
            let along = match bounds[giver] {
                Bound::Coulomb(_) => 1.0 / most,
                Bound::Lagged(_) => 0.0,
            };
            let ray = [1.0, z[giver][1] * along, z[giver][2] * along];
            let answer = times(ray);
            let (slope, curvature) = (sign * dot(ray, difference), dot(ray, answer));
            if slope > 0.0 && curvature > 1e-9 * (diagonals[0][0][0] + diagonals[1][0][0]) {
                let t = (slope / curvature).min(most);
                for r in 0..3 {
                    z[giver][r] = if t == most { 0.0 } else { z[giver][r] - t * ray[r] };
                    z[1 - giver][r] += t * ray[r];
                    difference[r] -= sign * t * answer[r];
                }
                moved = true;
            }
        }
        let sticks = |z: &[Row; 2]| bounds.iter().zip(z).all(|(bound, z)| length([z[1], z[2]]) < bound.sliding(z[0]));
        // Tangents that point elsewhere are no twins.
        if self.block[1][1] > 0.0 && self.block[2][2] > 0.0 && sticks(&z) {
            let determinant = k[1][1] * k[2][2] - k[1][2] * k[2][1];
            if determinant > 1e-18 * (diagonals[0][1][1] * diagonals[0][2][2]) {
                let x = (k[1][2] * difference[2] - k[2][2] * difference[1]) / determinant;
                let y = (k[2][1] * difference[1] - k[1][1] * difference[2]) / determinant;
                let next = [[z[0][0], z[0][1] + x, z[0][2] + y], [z[1][0], z[1][1] - x, z[1][2] - y]];
                if sticks(&next) {
                    (z, moved) = (next, true);
                }
            }
        }
        if moved {
            problem.set_force(self.pair[0], z[0]);
            problem.set_force(self.pair[1], z[1]);
        }
    }
}

fn dot(a: Row, b: Row) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
