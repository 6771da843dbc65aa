//! 6 x 6 kernels of transfers along a tree: what an elimination leaves of a body, and how a body follows the one before it.
//!
//! A matrix is six rows of eight numbers each, the last two of them zero, so that a row fills vector registers.

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use kernels::Spatial;
use kernels::lane::{Lanes, Real};
use kernels::math::{Sym3, Vec3};

/// Six numbers and two zeros, or one component of eight spatial vectors.
pub type Row = Lanes<8>;

/// A 6 x 6 matrix, row by row, or eight spatial vectors side by side: linear parts first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows(pub [Row; 6]);

/// A 6 x 6 matrix column by column.
pub(crate) type Columns = [Spatial<f64>; 6];

/// A joint between a body and the one before it in the tree, as the elimination sees it: arms of the two connectors in world
/// axes \[m\], and alpha~ of stretch-shear and of bend-twist in world rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    /// Arm of the connector on the body beyond.
    pub(crate) outer: Vec3<f64>,
    /// Arm of the connector on the body before.
    pub(crate) inner: Vec3<f64>,
    /// Of stretch-shear and of bend-twist.
    pub compliance: [Sym3<f64>; 2],
}

/// How a body follows the one before it: `dp = T dp_before + S f`, with f the force on the body and what lies beyond it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transfer {
    /// The transpose of T.
    pub(crate) transposed: Rows,
    /// S: the answer where the body before is held.
    pub(crate) held: Rows,
}

/// `L Delta L^T` of a symmetric 6 x 6 matrix.
struct Factor {
    lower: [[f64; 6]; 6],
    inverse_pivots: [f64; 6],
}

/// Lower triangle of a symmetric 6 x 6 matrix.
type Lower = [[f64; 6]; 6];

impl Rows {
    /// Zero.
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self([Row::zero(); 6])
    }

    /// The inverse mass matrix of a body on its own.
    #[inline(always)]
    pub(crate) fn free(inverse_mass: f64, inverse_inertia: Sym3<f64>) -> Self {
        let mut out = Self::zero();
        let turn = inverse_inertia.full();
        for r in 0..3 {
            out.0[r].0[r] = inverse_mass;
            for c in 0..3 {
                out.0[3 + r].0[3 + c] = turn[r][c];
            }
        }
        out
    }

    /// `C M` of a connector C with the arm r: `[I, -[r]x; 0, -I]`.
    #[inline(always)]
    fn connected(&self, r: Vec3<f64>) -> Self {
        let m = &self.0;
        let [x, y, z] = r.0.map(Row::splat);
        Self([m[0] + m[4] * z - m[5] * y, m[1] + m[5] * x - m[3] * z, m[2] + m[3] * y - m[4] * x, -m[3], -m[4], -m[5]])
    }

    /// `C^T M`.
    #[inline(always)]
    fn on_body(&self, r: Vec3<f64>) -> Self {
        let m = &self.0;
        let [x, y, z] = r.0.map(Row::splat);
        Self([m[0], m[1], m[2], m[2] * y - m[1] * z - m[3], m[0] * z - m[2] * x - m[4], m[1] * x - m[0] * y - m[5]])
    }

    /// The lower triangle of `M C^T`, which must be symmetric.
    #[inline(always)]
    fn lower_of_connected(&self, r: Vec3<f64>) -> Lower {
        let mut out = [[0.0; 6]; 6];
        for i in 0..6 {
            let [a, b, c, d, e, f, ..] = self.0[i].0;
            let crossed = Vec3([d, e, f]).cross(r);
            out[i] = [a + crossed.0[0], b + crossed.0[1], c + crossed.0[2], -d, -e, -f];
        }
        out
    }

    /// `M X`, for eight spatial vectors X.
    #[inline(always)]
    pub(crate) fn times(&self, x: &Self) -> Self {
        let mut out = Self::zero();
        for r in 0..6 {
            let m = &self.0[r].0;
            let mut sum = x.0[0] * Row::splat(m[0]);
            for k in 1..6 {
                sum += x.0[k] * Row::splat(m[k]);
            }
            out.0[r] = sum;
        }
        out
    }

    /// `M^T X`, for eight spatial vectors X.
    #[inline(always)]
    pub(crate) fn transposed_times(&self, x: &Self) -> Self {
        let mut out = Self::zero();
        for r in 0..6 {
            let mut sum = x.0[0] * Row::splat(self.0[0].0[r]);
            for k in 1..6 {
                sum += x.0[k] * Row::splat(self.0[k].0[r]);
            }
            out.0[r] = sum;
        }
        out
    }

    /// `M -= A^T B`.
    #[inline(always)]
    fn take(&mut self, a: &Self, b: &Self) {
        for r in 0..6 {
            let mut sum = self.0[r];
            for k in 0..6 {
                sum -= b.0[k] * Row::splat(a.0[k].0[r]);
            }
            self.0[r] = sum;
        }
    }

    /// `A M A^T + S` for `transposed = A^T`.
    #[inline(always)]
    pub(crate) fn carried(&self, transfer: &Transfer) -> Self {
        let mut out = transfer.transposed.transposed_times(&self.times(&transfer.transposed));
        for r in 0..6 {
            out.0[r] += transfer.held.0[r];
        }
        out
    }
}

impl Factor {
    /// Factors the lower triangle `d`. A pivot of zero, of what cannot move and does not yield, counts as infinitely stiff.
    #[inline(always)]
    fn new(mut d: Lower) -> Self {
        let mut inverse_pivots = [0.0; 6];
        let mut lower = [[0.0; 6]; 6];
        for k in 0..6 {
            let inverse = if d[k][k] == 0.0 { 0.0 } else { 1.0 / d[k][k] };
            inverse_pivots[k] = inverse;
            for i in k + 1..6 {
                let l = d[i][k] * inverse;
                lower[i][k] = l;
                for j in k + 1..=i {
                    d[i][j] -= l * d[j][k];
                }
            }
        }
        Self { lower, inverse_pivots }
    }

    /// The inverse times `rows`.
    #[inline(always)]
    fn solve(&self, rows: &Rows) -> Rows {
        let mut x = *rows;
        for i in 1..6 {
            let mut sum = x.0[i];
            for k in 0..i {
                sum -= x.0[k] * Row::splat(self.lower[i][k]);
            }
            x.0[i] = sum;
        }
        for k in 0..6 {
            x.0[k] = x.0[k] * Row::splat(self.inverse_pivots[k]);
        }
        for i in (0..5).rev() {
            let mut sum = x.0[i];
            for k in i + 1..6 {
                sum -= x.0[k] * Row::splat(self.lower[k][i]);
            }
            x.0[i] = sum;
        }
        x
    }
}

/// Adds alpha~ to a lower triangle.
#[inline(always)]
fn add_compliance(lower: &mut Lower, compliance: &[Sym3<f64>; 2]) {
    for (half, part) in compliance.iter().enumerate() {
        let [xx, yy, zz, xy, xz, yz] = part.0;
        let o = 3 * half;
        lower[o][o] += xx;
        lower[o + 1][o + 1] += yy;
        lower[o + 2][o + 2] += zz;
        lower[o + 1][o] += xy;
        lower[o + 2][o] += xz;
        lower[o + 2][o + 1] += yz;
    }
}

/// Eliminates a joint: `inner`, the inverse mass H of the body before it, becomes what is left of it. With E what the body
/// beyond answers at the joint,
///
/// ```text
/// E = Co Ho Co^T + alpha~,   D = E + Ci H Ci^T,   H -= (Ci H)^T D^-1 (Ci H)
/// ```
///
/// `outer` is Ho; `None` where the body beyond is fixed. Returns what of E its [`transfer`] takes.
#[inline(always)]
pub(crate) fn eliminate(outer: Option<&Rows>, inner: &mut Rows, link: &Link) -> Option<Joint> {
    let beyond = outer.map(|outer| outer.connected(link.outer));
    let mut e = beyond.map_or([[0.0; 6]; 6], |beyond| beyond.lower_of_connected(link.outer));
    add_compliance(&mut e, &link.compliance);
    let near = inner.connected(link.inner);
    let mut d = near.lower_of_connected(link.inner);
    for r in 0..6 {
        for c in 0..=r {
            d[r][c] += e[r][c];
        }
    }
    let x = Factor::new(d).solve(&near);
    inner.take(&near, &x);
    beyond.map(|beyond| Joint { beyond, e })
}

/// What an elimination knows of a joint whose outer body moves: `Co Ho` and E.
pub struct Joint {
    beyond: Rows,
    e: Lower,
}

/// How the body beyond follows: `X = E^-1 Co Ho`, `T = X^T Ci`, `S = Ho - (Co Ho)^T X`.
#[inline(always)]
pub(crate) fn transfer(joint: &Joint, outer: &Rows, link: &Link) -> Transfer {
    let x = Factor::new(joint.e).solve(&joint.beyond);
    let mut held = *outer;
    held.take(&joint.beyond, &x);
    Transfer { transposed: x.on_body(link.inner), held }
}
