//! A joint's energy with its derivatives, and the small matrices of the elimination.
//!
//! The relative rotation of a joint's two sides is (s, u), real and imaginary part. As the sides turn in their body frames,
//! `du = S dtheta_b / 2 - S^T dtheta_a / 2` with `S = s I + [u]x`; the second derivatives of u are
//!
//! ```text
//! -u |theta_a|^2 / 8 - u |theta_b|^2 / 8 + (theta_a u.theta_b + theta_b u.theta_a - u theta_a.theta_b - s theta_a x theta_b) / 4
//! ```

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use cosserat::internals::kernels::lane::Real;
use cosserat::internals::kernels::math::{Quat, Vec3};

/// A joint's energy, its gradient and its Hessian by the turns of its two sides.
pub(crate) struct Bend<T> {
    pub(crate) relative: Quat<T>,
    pub(crate) energy: T,
    pub(crate) gradient: [Vec3<T>; 2],
    /// Symmetric: 11, 22, 33, 12, 13, 23.
    pub(crate) own: [[T; 6]; 2],
    pub(crate) across: [[T; 3]; 3],
}

impl<T: Real> Bend<T> {
    #[inline(always)]
    pub(crate) fn new(a: Quat<T>, b: Quat<T>, k: [T; 3], rest: [T; 3]) -> Self {
        let relative = (a.conj() * b).upper();
        let (s, u) = (relative.w, relative.v);
        let [u1, u2, u3] = u.0;
        let e = u - Vec3(rest);
        let m = Vec3([k[0] * e.0[0], k[1] * e.0[1], k[2] * e.0[2]]);
        let (half, quarter) = (T::splat(0.5), T::splat(0.25));
        // The rows of S = s I + [u]x; du = S dtheta_b / 2 - S^T dtheta_a / 2.
        let rows = [[s, -u3, u2], [u3, s, -u1], [-u2, u1, s]];
        let k4 = [k[0] * quarter, k[1] * quarter, k[2] * quarter];
        let mut left = rows;
        let mut right = rows;
        for r in 0..3 {
            for c in 0..3 {
                left[r][c] = rows[r][c] * k4[c];
                right[r][c] = rows[r][c] * k4[r];
            }
        }
        let mu = -(m.dot(u) * quarter);
        let own_a = [
            three(left[0], rows[0]) + mu,
            three(left[1], rows[1]) + mu,
            three(left[2], rows[2]) + mu,
            three(left[0], rows[1]),
            three(left[0], rows[2]),
            three(left[1], rows[2]),
        ];
        let own_b = [
            onto(&rows, 0, column(&right, 0)) + mu,
            onto(&rows, 1, column(&right, 1)) + mu,
            onto(&rows, 2, column(&right, 2)) + mu,
            onto(&rows, 0, column(&right, 1)),
            onto(&rows, 0, column(&right, 2)),
            onto(&rows, 1, column(&right, 2)),
        ];
        let [m1, m2, m3] = (m * quarter).0;
        let [x, y, z] = (m * (s * quarter)).0;
        // m u^T + u m^T is symmetric, s [m]x is not.
        let (xy, xz, yz) = (m1 * u2 + m2 * u1, m1 * u3 + m3 * u1, m2 * u3 + m3 * u2);
        let two = T::splat(2.0);
        let across = [
            [
                two * m1 * u1 + mu - onto(&rows, 0, left[0]),
                xy - z - onto(&rows, 1, left[0]),
                xz + y - onto(&rows, 2, left[0]),
            ],
            [
                xy + z - onto(&rows, 0, left[1]),
                two * m2 * u2 + mu - onto(&rows, 1, left[1]),
                yz - x - onto(&rows, 2, left[1]),
            ],
            [
                xz - y - onto(&rows, 0, left[2]),
                yz + x - onto(&rows, 1, left[2]),
                two * m3 * u3 + mu - onto(&rows, 2, left[2]),
            ],
        ];
        let gradient = on_both_sides(s, u, m);
        Self { relative, energy: half * e.dot(m), gradient, own: [own_a, own_b], across }
    }
}

/// What a moment m on the imaginary part of a joint's relative rotation (s, u) is on the turns of its two sides.
#[inline(always)]
pub(crate) fn on_both_sides<T: Real>(s: T, u: Vec3<T>, m: Vec3<T>) -> [Vec3<T>; 2] {
    let (cross, along, half) = (u.cross(m), m * s, T::splat(0.5));
    [-((along + cross) * half), (along - cross) * half]
}

/// The factors `L D L^T` of a symmetric 3 x 3 matrix.
pub(crate) struct Factor<T> {
    lower: [T; 3],
    inverse: [T; 3],
    pub(crate) negative: T,
}

impl<T: Real> Factor<T> {
    #[inline(always)]
    pub(crate) fn new([a11, a22, a33, a12, a13, a23]: [T; 6]) -> Self {
        let (one, zero) = (T::splat(1.0), T::zero());
        let i1 = one / a11;
        let (l21, l31) = (a12 * i1, a13 * i1);
        let d2 = a22 - l21 * a12;
        let t = a23 - l31 * a12;
        let i2 = one / d2;
        let l32 = t * i2;
        let d3 = a33 - l31 * a13 - l32 * t;
        Self {
            lower: [l21, l31, l32],
            inverse: [i1, i2, one / d3],
            negative: a11.select(zero, one) + d2.select(zero, one) + d3.select(zero, one),
        }
    }

    #[inline(always)]
    pub(crate) fn solve(&self, [y1, y2, y3]: [T; 3]) -> [T; 3] {
        let [l21, l31, l32] = self.lower;
        let y2 = y2 - l21 * y1;
        let y3 = (y3 - l31 * y1 - l32 * y2) * self.inverse[2];
        let y2 = y2 * self.inverse[1] - l32 * y3;
        [y1 * self.inverse[0] - l21 * y2 - l31 * y3, y2, y3]
    }
}

#[inline(always)]
pub(crate) fn column<T: Copy>(m: &[[T; 3]; 3], c: usize) -> [T; 3] {
    [m[0][c], m[1][c], m[2][c]]
}

/// Column c of a matrix times a vector.
#[inline(always)]
pub(crate) fn onto<T: Real>(m: &[[T; 3]; 3], c: usize, v: [T; 3]) -> T {
    m[0][c] * v[0] + m[1][c] * v[1] + m[2][c] * v[2]
}

/// Scalar product.
#[inline(always)]
fn three<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
