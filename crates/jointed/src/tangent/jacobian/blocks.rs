//! Blocks of 6 x 6 numbers of the Jacobian, and what joints' rows do with them.

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use crate::block::{Block, assemble};
use crate::tangent::Coupling;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{self, Sym3, Vec3, cross_matrix, map_rows, transposed};

/// Rows of a block, which the compiler is not told: loops over them stay loops, as unrolled ones take it minutes in all lanes.
#[inline(always)]
fn rows() -> std::ops::Range<usize> {
    0..std::hint::black_box(6)
}

/// Three rows of a block.
type Half<T> = [[T; 6]; 3];

/// A joint's blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointBlocks<T> {
    /// Arms of the connectors of bodies a and b.
    pub(super) arms: [Vec3<T>; 2],
    /// What stands in the place of `-[r]x` in J' of body a.
    pub(super) tilted: [[T; 3]; 3],
    /// alpha~ of stretch-shear and of bend-twist.
    pub(super) compliance: [Sym3<T>; 2],
    /// K' of body a (rows) with body b (columns), of their turns.
    pub(super) coupling: Coupling<T>,
}

impl<T: Real> JointBlocks<T> {
    /// J of body a (0) or b (1), as forces see it.
    #[inline(always)]
    pub(super) fn forces(&self, end: usize) -> Rows<T> {
        Rows { sigma: T::splat([1.0, -1.0][end]), mixed: cross_matrix(-self.arms[end]) }
    }

    /// J' of body a (0) or b (1), as movements see it.
    #[inline(always)]
    pub(super) fn movements(&self, end: usize) -> Rows<T> {
        if end == 0 { Rows { sigma: T::splat(1.0), mixed: self.tilted } } else { self.forces(1) }
    }

    /// K' of the body at an end (rows) with the other one (columns).
    #[inline(always)]
    pub(super) fn coupling(&self, end: usize) -> Coupling<T> {
        if end == 0 { self.coupling } else { self.coupling.transposed() }
    }

    /// `alpha~ x`.
    #[inline(always)]
    pub(super) fn yielded(&self, x: Spatial<T>) -> Spatial<T> {
        let [stretch, bend] = &self.compliance;
        Spatial { linear: stretch.apply(x.linear), angular: bend.apply(x.angular) }
    }

    /// Rows of bend-twist of `alpha~ x`.
    #[inline(always)]
    pub(super) fn bent(&self, x: &Block<T>) -> Half<T> {
        times(&self.compliance[1].full(), &below(x))
    }

    /// `x alpha~`.
    #[inline(always)]
    pub(super) fn yielding(&self, x: &Block<T>) -> Block<T> {
        let (stretch, bend) = (self.compliance[0].full(), self.compliance[1].full());
        let mut out = [[T::zero(); 6]; 6];
        for r in rows() {
            for c in 0..3 {
                for k in 0..3 {
                    out[r][c] += x[r][k] * stretch[k][c];
                    out[r][3 + c] += x[r][3 + k] * bend[k][c];
                }
            }
        }
        out
    }
}

/// A block `sigma [I, M; 0, -I]`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows<T> {
    pub(super) sigma: T,
    mixed: [[T; 3]; 3],
}

impl<T: Real> Rows<T> {
    /// `R x`.
    #[inline(always)]
    pub(super) fn apply(&self, x: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: (x.linear + math::times(self.mixed, x.angular)) * self.sigma,
            angular: x.angular * -self.sigma,
        }
    }

    /// `R^T x`.
    #[inline(always)]
    pub(super) fn tr_apply(&self, x: Spatial<T>) -> Spatial<T> {
        let ([a, b, c], [x0, x1, x2]) = (self.mixed, x.linear.0);
        let mixed = Vec3(a) * x0 + Vec3(b) * x1 + Vec3(c) * x2;
        Spatial { linear: x.linear * self.sigma, angular: (mixed - x.angular) * self.sigma }
    }

    /// `R^T x` of a block.
    #[inline(always)]
    pub(super) fn tr_times(&self, x: &Block<T>) -> Block<T> {
        let mixed = times(&transposed(self.mixed), &[x[0], x[1], x[2]]);
        let mut out = *x;
        for r in 0..3 {
            for c in 0..6 {
                out[r][c] = x[r][c] * self.sigma;
                out[3 + r][c] = (mixed[r][c] - x[3 + r][c]) * self.sigma;
            }
        }
        out
    }

    /// `x R`.
    #[inline(always)]
    pub(super) fn after(&self, x: &Block<T>) -> Block<T> {
        let mut out = *x;
        for r in rows() {
            for c in 0..3 {
                let mut mixed = -x[r][3 + c];
                for k in 0..3 {
                    mixed += x[r][k] * self.mixed[k][c];
                }
                out[r][c] = x[r][c] * self.sigma;
                out[r][3 + c] = mixed * self.sigma;
            }
        }
        out
    }

    /// `R^T` itself.
    #[inline(always)]
    pub(super) fn transposed(&self) -> Block<T> {
        let (zero, identity) = ([[T::zero(); 3]; 3], Sym3::identity(self.sigma).full());
        let mixed = map_rows(transposed(self.mixed), |row| row * self.sigma);
        assemble(identity, zero, mixed, map_rows(identity, |row| -row))
    }
}

/// The last three rows.
#[inline(always)]
pub(super) fn below<T: Real>(x: &Block<T>) -> Half<T> {
    [x[3], x[4], x[5]]
}

#[inline(always)]
fn times<T: Real>(m: &[[T; 3]; 3], x: &Half<T>) -> Half<T> {
    let mut out = [[T::zero(); 6]; 3];
    for r in 0..3 {
        for k in 0..3 {
            for c in 0..6 {
                out[r][c] += m[r][k] * x[k][c];
            }
        }
    }
    out
}

/// Adds a coupling of turns times turns, which are three rows, to the turns of a block.
#[inline(always)]
pub(super) fn add_turned<T: Real>(out: &mut Block<T>, coupling: Coupling<T>, turns: &Half<T>) {
    let turned = times(&coupling.full(), turns);
    for r in 0..3 {
        for c in 0..6 {
            out[3 + r][c] += turned[r][c];
        }
    }
}

/// Adds to the rows and columns of turns.
#[inline(always)]
pub(super) fn add_to_turns<T: Real>(out: &mut Block<T>, part: [[T; 3]; 3]) {
    for r in 0..3 {
        for c in 0..3 {
            out[3 + r][3 + c] += part[r][c];
        }
    }
}

/// `a b`.
#[inline(always)]
pub(super) fn product<T: Real>(a: &Block<T>, b: &Block<T>) -> Block<T> {
    let mut out = [[T::zero(); 6]; 6];
    for r in rows() {
        let mut sum = out[r];
        for k in 0..6 {
            for c in 0..6 {
                sum[c] += a[r][k] * b[k][c];
            }
        }
        out[r] = sum;
    }
    out
}

/// Adds a block.
#[inline(always)]
pub(super) fn add<T: Real>(own: &mut Block<T>, by: &Block<T>) {
    for r in 0..6 {
        for c in 0..6 {
            own[r][c] += by[r][c];
        }
    }
}

/// `m x`.
#[inline(always)]
pub(super) fn apply<T: Real>(m: &Block<T>, x: Spatial<T>) -> Spatial<T> {
    let x = x.to_array();
    let mut out = [T::zero(); 6];
    for r in rows() {
        for c in 0..6 {
            out[r] += m[r][c] * x[c];
        }
    }
    Spatial::from_array(out)
}

/// `m^T x`.
#[inline(always)]
pub(super) fn tr_apply<T: Real>(m: &Block<T>, x: Spatial<T>) -> Spatial<T> {
    let x = x.to_array();
    let mut out = [T::zero(); 6];
    for r in rows() {
        for c in 0..6 {
            out[c] += m[r][c] * x[r];
        }
    }
    Spatial::from_array(out)
}

/// The inverse, by Gauss's and Jordan's elimination with the largest pivot in a column; not finite where there is none.
#[inline(always)]
pub(super) fn inverse<T: Real>(m: &Block<T>) -> Block<T> {
    let (one, zero) = (T::splat(1.0), T::zero());
    let (mut left, mut right) = (*m, [[zero; 6]; 6]);
    let rows = rows();
    for k in rows.clone() {
        right[k][k] = one;
    }
    for k in rows.clone() {
        for r in k + 1..rows.end {
            let is_larger = left[r][k].abs() - left[k][k].abs();
            exchange(&mut left, [k, r], is_larger);
            exchange(&mut right, [k, r], is_larger);
        }
        let scale = one / left[k][k];
        for c in 0..6 {
            left[k][c] = left[k][c] * scale;
            right[k][c] = right[k][c] * scale;
        }
        let (of_left, of_right) = (left[k], right[k]);
        for r in rows.clone() {
            if r != k {
                let share = left[r][k];
                for c in 0..6 {
                    left[r][c] -= share * of_left[c];
                    right[r][c] -= share * of_right[c];
                }
            }
        }
    }
    right
}

/// Exchanges two rows in the lanes where a number is not negative.
#[inline(always)]
fn exchange<T: Real>(m: &mut Block<T>, [a, b]: [usize; 2], where_positive: T) {
    if T::LANES == 1 {
        if where_positive.lane(0) >= 0.0 {
            m.swap(a, b);
        }
        return;
    }
    for c in 0..6 {
        let (first, second) = (m[a][c], m[b][c]);
        m[a][c] = where_positive.select(second, first);
        m[b][c] = where_positive.select(first, second);
    }
}

/// Symmetric parts of a block of a body alone: its mass, and how its turns resist.
#[inline(always)]
pub(super) fn of_body<T: Real>(mass: T, turning: [[T; 3]; 3]) -> Block<T> {
    let zero = [[T::zero(); 3]; 3];
    assemble(Sym3::identity(mass).full(), zero, zero, turning)
}

/// Sum of a block's numbers: not finite where one of them is not.
#[inline(always)]
pub(super) fn total<T: Real>(m: &Block<T>) -> T {
    let mut out = T::zero();
    for row in m {
        for &x in row {
            out += x;
        }
    }
    out
}

/// Negative of a coupling, all nine numbers.
#[inline(always)]
pub(super) fn minus<T: Real>(coupling: Coupling<T>) -> [[T; 3]; 3] {
    map_rows(coupling.full(), |row| -row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernels::lane::Lanes;

    /// Numbers of which rows have to be exchanged.
    fn block(seed: f64) -> Block<f64> {
        let mut out = [[0.0; 6]; 6];
        for r in 0..6 {
            for c in 0..6 {
                out[r][c] = (seed + 7.3 * r as f64 + 3.1 * c as f64 * (1.0 + r as f64)).sin();
            }
        }
        (out[0][0], out[2][2]) = (0.0, 1e-14);
        out
    }

    #[test]
    fn an_inverse_has_the_same_bits_in_lanes() {
        let alone = [0.3, 1.7].map(|seed| (block(seed), inverse(&block(seed))));
        let mut both = [[Lanes([0.0; 2]); 6]; 6];
        for r in 0..6 {
            for c in 0..6 {
                both[r][c] = Lanes([alone[0].0[r][c], alone[1].0[r][c]]);
            }
        }
        let both = inverse(&both);
        for (lane, (m, own)) in alone.iter().enumerate() {
            let unit = product(m, own);
            for r in 0..6 {
                for c in 0..6 {
                    assert_eq!(both[r][c].lane(lane).to_bits(), own[r][c].to_bits());
                    assert!((unit[r][c] - f64::from(r == c)).abs() < 1e-12, "{unit:?}");
                }
            }
        }
    }

    #[test]
    fn a_singular_block_has_no_inverse() {
        let mut m = block(0.3);
        m[4] = [0.0; 6];
        assert!(!total(&inverse(&m)).is_finite());
    }
}
