//! The law of one contact: it presses or is open, sticks or slides.

use super::delassus::{Block3, Row};

/// Coulomb's law: friction is at most this share of the normal impulse, whatever that comes to.
#[derive(Clone, Copy, Debug)]
pub struct Coulomb(pub f64);

impl Coulomb {
    /// Whether there is friction at such a normal impulse.
    #[inline(always)]
    pub(crate) fn exists(self, normal: f64) -> bool {
        self.0 > 0.0 && normal > 0.0
    }

    /// The most friction at such a normal impulse.
    #[inline(always)]
    pub(crate) fn most(self, normal: f64) -> f64 {
        self.0 * normal
    }

    /// An impulse with no more friction than there may be.
    #[inline(always)]
    pub(crate) fn within(self, [normal, x, y]: Row) -> Row {
        let (size, most) = (length([x, y]), self.most(normal));
        let share = if size > most { most / size } else { 1.0 };
        [normal, x * share, y * share]
    }
}

/// A contact's answer to its own impulse, and what solving for it takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Own {
    block: Block3,
    /// Reciprocal of the compliance along the normal [kg].
    per_normal: f64,
    /// Inverse of the tangential 2x2 block [kg].
    stick: [[f64; 2]; 2],
    /// The larger compliance across [1/kg].
    across: f64,
    /// Its reciprocal [kg].
    per_across: f64,
}

impl Own {
    /// Of a contact whose block of W is `block`.
    #[inline(always)]
    pub(crate) fn new(block: &Block3) -> Self {
        let d = block;
        let determinant = 1.0 / (d[1][1] * d[2][2] - d[1][2] * d[2][1]);
        let across = largest_eigenvalue(d);
        Self {
            block: *d,
            per_normal: 1.0 / d[0][0],
            stick: [[d[2][2] * determinant, -d[1][2] * determinant], [-d[2][1] * determinant, d[1][1] * determinant]],
            across,
            per_across: 1.0 / across,
        }
    }

    /// The contact's block of W.
    #[inline(always)]
    pub(crate) fn block(&self) -> &Block3 {
        &self.block
    }

    /// Compliances to its own impulse: along the normal, and the larger one across [1/kg].
    #[inline(always)]
    pub(crate) fn compliance(&self) -> [f64; 2] {
        [self.block[0][0], self.across]
    }

    /// The impulse of the contact whose gap and slip are `w` at `old`.
    #[inline(always)]
    pub(crate) fn answer(&self, old: Row, w: Row, friction: Coulomb) -> Row {
        let normal = (old[0] - w[0] * self.per_normal).max(0.0);
        if !friction.exists(normal) {
            return [normal, 0.0, 0.0];
        }
        let dn = normal - old[0];
        let slip = [w[1] + self.block[1][0] * dn, w[2] + self.block[2][0] * dn];
        // Without any slip, if the cone allows.
        let stuck = [
            old[1] - (self.stick[0][0] * slip[0] + self.stick[0][1] * slip[1]),
            old[2] - (self.stick[1][0] * slip[0] + self.stick[1][1] * slip[1]),
        ];
        if length(stuck) <= friction.most(normal) {
            return [normal, stuck[0], stuck[1]];
        }
        let [x, y] = [old[1] - slip[0] * self.per_across, old[2] - slip[1] * self.per_across];
        let (size, most) = (length([x, y]), friction.most(normal));
        // Smaller than the cone of sliding: it is about to stick.
        let k = if size > most { most / size } else { 1.0 };
        [normal, x * k, y * k]
    }
}

/// Length of a vector across the normal.
#[inline(always)]
pub(crate) fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

/// Largest eigenvalue of the tangential 2x2 block.
fn largest_eigenvalue(d: &Block3) -> f64 {
    let (a, b, c) = (d[1][1], d[2][2], 0.5 * (d[1][2] + d[2][1]));
    0.5 * (a + b) + length([0.5 * (a - b), c])
}

/// How far an impulse is from answering gap and slip `w`, as lengths along the normal and across.
#[inline(always)]
pub fn natural_residual(compliance: [f64; 2], force: Row, w: Row, friction: Coulomb) -> [f64; 2] {
    let [cn, ct] = compliance;
    if cn <= 0.0 {
        return [0.0; 2];
    }
    let normal = (force[0] - w[0] / cn).max(0.0);
    let across = if ct > 0.0 && friction.exists(f64::INFINITY) {
        let [x, y] = [force[1] - w[1] / ct, force[2] - w[2] / ct];
        let size = length([x, y]);
        let most = friction.most(normal);
        let k = if size > most { most / size } else { 1.0 };
        length([x * k - force[1], y * k - force[2]]) * ct
    } else {
        0.0
    };
    [((normal - force[0]) * cn).abs(), across]
}

#[cfg(test)]
mod tests;
