//! Vectors, quaternions and 3x3 matrices over [`Real`], as small as the kernels need them.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use crate::lane::{Both, Real};

/// A 3-vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<T>(pub [T; 3]);

impl<T: Real> Vec3<T> {
    /// The same vector in every lane.
    #[inline(always)]
    pub fn splat(x: Vec3<f64>) -> Self {
        Self([T::splat(x.0[0]), T::splat(x.0[1]), T::splat(x.0[2])])
    }
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self([T::zero(); 3])
    }
    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> T {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }
    /// Vector product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }
    /// Squared length.
    #[inline(always)]
    pub fn norm_squared(self) -> T {
        self.dot(self)
    }
}

impl<T: Real> Vec3<T> {
    /// Two side by side.
    #[inline(always)]
    pub fn both(a: Self, b: Self) -> Vec3<Both<T>> {
        Vec3(Both::zip(a.0, b.0))
    }
}

impl<T: Real> Vec3<Both<T>> {
    /// One of the two.
    #[inline(always)]
    pub(crate) fn one(self, k: usize) -> Vec3<T> {
        Vec3(Both::pick(self.0, k))
    }
}

impl<T: Real> Add for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<T: Real> Sub for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl<T: Real> Neg for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self([-self.0[0], -self.0[1], -self.0[2]])
    }
}

impl<T: Real> Mul<T> for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: T) -> Self {
        Self([self.0[0] * k, self.0[1] * k, self.0[2] * k])
    }
}

impl<T: Real> AddAssign for Vec3<T> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<T: Real> SubAssign for Vec3<T> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

/// A quaternion: vector part and scalar part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quat<T> {
    /// Vector part.
    pub v: Vec3<T>,
    /// Scalar part.
    pub w: T,
}

impl<T: Real> Quat<T> {
    /// The same quaternion in every lane.
    #[inline(always)]
    pub fn splat(q: Quat<f64>) -> Self {
        Self { v: Vec3::splat(q.v), w: T::splat(q.w) }
    }
    /// No rotation.
    #[inline(always)]
    pub fn identity() -> Self {
        Self { v: Vec3::zero(), w: T::splat(1.0) }
    }
    /// Conjugate: the inverse of a unit quaternion.
    #[inline(always)]
    pub fn conj(self) -> Self {
        Self { v: -self.v, w: self.w }
    }
    /// Rotates a vector; the quaternion must be of unit length.
    #[inline(always)]
    pub fn rotate(self, x: Vec3<T>) -> Vec3<T> {
        let t = self.v.cross(x);
        let t = t + t;
        x + t * self.w + self.v.cross(t)
    }
    /// Rotates a vector back.
    #[inline(always)]
    pub fn rotate_back(self, x: Vec3<T>) -> Vec3<T> {
        self.conj().rotate(x)
    }
    /// The rotated z axis, d3.
    #[inline(always)]
    pub fn axis(self) -> Vec3<T> {
        let [x, y, z] = self.v.0;
        let two = T::splat(2.0);
        Vec3([two * (x * z + self.w * y), two * (y * z - self.w * x), T::splat(1.0) - two * (x * x + y * y)])
    }
    /// The rotated y axis, d2.
    #[inline(always)]
    pub fn second_axis(self) -> Vec3<T> {
        self.rotate(Vec3([T::zero(), T::splat(1.0), T::zero()]))
    }
    /// Turns by a world rotation vector [rad]: the unit quaternion along (1, phi / 2) q.
    #[inline(always)]
    pub fn turned(self, phi: Vec3<T>) -> Self {
        let half = phi * T::splat(0.5);
        let v = self.v + half * self.w + half.cross(self.v);
        Self { v, w: self.w - half.dot(self.v) }.normalized()
    }
    /// The world rotation vector [rad] that [`Self::turned`] takes `before` here by.
    #[inline(always)]
    pub fn turn_since(self, before: Self) -> Vec3<T> {
        let turn = (self * before.conj()).upper();
        turn.v * (T::splat(2.0) / turn.w)
    }
    /// At unit length.
    #[inline(always)]
    pub fn normalized(self) -> Self {
        let scale = T::splat(1.0) / (self.v.norm_squared() + self.w * self.w).sqrt();
        Self { v: self.v * scale, w: self.w * scale }
    }
    /// This quaternion or its opposite, whichever has a scalar part >= 0.
    #[inline(always)]
    pub fn upper(self) -> Self {
        let sign = self.w.select(T::splat(1.0), T::splat(-1.0));
        Self { v: self.v * sign, w: self.w * sign }
    }
}

impl<T: Real> Mul for Quat<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self { v: o.v * self.w + self.v * o.w + self.v.cross(o.v), w: self.w * o.w - self.v.dot(o.v) }
    }
}

/// A symmetric 3x3 matrix: xx, yy, zz, xy, xz, yz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sym3<T>(pub [T; 6]);

impl<T: Real> Sym3<T> {
    /// The zero matrix.
    #[inline(always)]
    pub fn zero() -> Self {
        Self([T::zero(); 6])
    }
    /// `k` times the identity.
    #[inline(always)]
    pub fn identity(k: T) -> Self {
        let o = T::zero();
        Self([k, k, k, o, o, o])
    }
    /// `k a a^T`.
    #[inline(always)]
    pub fn outer(a: Vec3<T>, k: T) -> Self {
        let [x, y, z] = a.0;
        let [kx, ky, kz] = (a * k).0;
        Self([x * kx, y * ky, z * kz, x * ky, x * kz, y * kz])
    }
    /// The symmetric part of `a b^T`.
    #[inline(always)]
    pub fn sym_outer(a: Vec3<T>, b: Vec3<T>) -> Self {
        let ([a0, a1, a2], [b0, b1, b2], h) = (a.0, b.0, T::splat(0.5));
        Self([a0 * b0, a1 * b1, a2 * b2, h * (a0 * b1 + a1 * b0), h * (a0 * b2 + a2 * b0), h * (a1 * b2 + a2 * b1)])
    }
    /// Matrix times vector.
    #[inline(always)]
    pub fn apply(self, x: Vec3<T>) -> Vec3<T> {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        let [a, b, c] = x.0;
        Vec3([xx * a + xy * b + xz * c, xy * a + yy * b + yz * c, xz * a + yz * b + zz * c])
    }
    /// Inverse of a positive definite matrix, by its adjugate.
    #[inline(always)]
    pub fn inverse(self) -> Self {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        let (a, b, c) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
        let k = T::splat(1.0) / (xx * a + xy * b + xz * c);
        Self([a * k, (xx * zz - xz * xz) * k, (xx * yy - xy * xy) * k, b * k, c * k, (xy * xz - xx * yz) * k])
    }
    /// Sum of the entries on the diagonal.
    #[inline(always)]
    pub fn trace(self) -> T {
        let [xx, yy, zz, ..] = self.0;
        xx + yy + zz
    }
    /// All nine entries, row by row.
    #[inline(always)]
    pub fn full(self) -> [[T; 3]; 3] {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    }
    /// `[a]x M` with the cross-product matrix of `a`, row by row.
    #[inline(always)]
    pub fn crossed(self, a: Vec3<T>) -> [[T; 3]; 3] {
        let columns = map_rows(self.full(), |column| a.cross(column));
        transposed(columns)
    }
    /// `[a]x M [a]x^T`, given `crossed = [a]x M`.
    #[inline(always)]
    pub fn crossed_twice(crossed: [[T; 3]; 3], a: Vec3<T>) -> Self {
        // Row i of P [a]x^T is a x (row i of P).
        let [r0, r1, r2] = map_rows(crossed, |row| a.cross(row));
        Self([r0[0], r1[1], r2[2], r0[1], r0[2], r1[2]])
    }
}

impl<T: Real> Add for Sym3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        let mut out = self;
        for k in 0..6 {
            out.0[k] += o.0[k];
        }
        out
    }
}

impl<T: Real> AddAssign for Sym3<T> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<T: Real> Mul<T> for Sym3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: T) -> Self {
        let mut out = self;
        for entry in &mut out.0 {
            *entry = *entry * k;
        }
        out
    }
}

/// `f` of each row. (The standard library's `map` on arrays is not always inlined, and then runs without vectors.)
#[inline(always)]
pub fn map_rows<T: Real>(m: [[T; 3]; 3], f: impl Fn(Vec3<T>) -> Vec3<T>) -> [[T; 3]; 3] {
    [f(Vec3(m[0])).0, f(Vec3(m[1])).0, f(Vec3(m[2])).0]
}

/// Matrix times vector.
#[inline(always)]
pub fn times<T: Real>([a, b, c]: [[T; 3]; 3], x: Vec3<T>) -> Vec3<T> {
    Vec3([Vec3(a).dot(x), Vec3(b).dot(x), Vec3(c).dot(x)])
}

/// `[a]x`, the matrix of the vector product with `a`.
#[inline(always)]
pub fn cross_matrix<T: Real>(Vec3([x, y, z]): Vec3<T>) -> [[T; 3]; 3] {
    let zero = T::zero();
    [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
}

/// Sum of two 3x3 matrices.
#[inline(always)]
pub fn sum<T: Real>(a: [[T; 3]; 3], b: [[T; 3]; 3]) -> [[T; 3]; 3] {
    [(Vec3(a[0]) + Vec3(b[0])).0, (Vec3(a[1]) + Vec3(b[1])).0, (Vec3(a[2]) + Vec3(b[2])).0]
}

/// Transpose of a 3x3 matrix.
#[inline(always)]
pub fn transposed<T: Copy>(m: [[T; 3]; 3]) -> [[T; 3]; 3] {
    [[m[0][0], m[1][0], m[2][0]], [m[0][1], m[1][1], m[2][1]], [m[0][2], m[1][2], m[2][2]]]
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Vec3<f64> = Vec3([0.3, -1.0, 2.0]);
    const W: Sym3<f64> = Sym3([4.0, 3.0, 5.0, 0.5, -0.2, 1.0]);

    #[test]
    fn crossed_products_agree_with_their_definition() {
        let x = Vec3([1.0, 2.0, -0.5]);
        let p = W.crossed(A);
        let applied = Vec3([Vec3(p[0]).dot(x), Vec3(p[1]).dot(x), Vec3(p[2]).dot(x)]);
        assert!((applied - A.cross(W.apply(x))).norm_squared() < 1e-24);
        let twice = Sym3::crossed_twice(p, A).apply(x);
        assert!((twice - A.cross(W.apply(-A.cross(x)))).norm_squared() < 1e-24);
    }

    #[test]
    fn inverse_times_matrix_is_the_identity() {
        let x = Vec3([1.0, 2.0, -0.5]);
        assert!((W.inverse().apply(W.apply(x)) - x).norm_squared() < 1e-28);
    }

    #[test]
    fn quaternions_rotate_like_nalgebra() {
        let q = nalgebra::UnitQuaternion::from_euler_angles(0.4, -1.0, 2.2);
        let own = Quat { v: Vec3([q.i, q.j, q.k]), w: q.w };
        let x = nalgebra::Vector3::new(0.3, -0.7, 1.9);
        let expected = q * x;
        let got = own.rotate(Vec3([x.x, x.y, x.z]));
        assert!((0..3).all(|k| (got.0[k] - expected[k]).abs() < 1e-14));
        assert!((own.axis() - own.rotate(Vec3([0.0, 0.0, 1.0]))).norm_squared() < 1e-28);
    }
}
