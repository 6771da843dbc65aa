//! The 6x6 kernels of the block elimination: what a joint sees of a body, factor, substitutions.

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use kernels::Spatial;
use kernels::lane::{Both, Real};
use kernels::math::{Sym3, Vec3, map_rows, sum, transposed};

/// A 6x6 block, row by row.
pub(crate) type Block<T> = [[T; 6]; 6];

/// The four 3x3 parts of a block.
#[inline(always)]
pub(crate) fn assemble<T: Real>(ss: [[T; 3]; 3], sb: [[T; 3]; 3], bs: [[T; 3]; 3], bb: [[T; 3]; 3]) -> Block<T> {
    let mut block = [[T::zero(); 6]; 6];
    for r in 0..3 {
        for c in 0..3 {
            block[r][c] = ss[r][c];
            block[r][c + 3] = sb[r][c];
            block[r + 3][c] = bs[r][c];
            block[r + 3][c + 3] = bb[r][c];
        }
    }
    block
}

/// What the joints eliminated so far leave of a body's inverse mass, `[A, C; C^T, W]` for (dx, dphi).
#[derive(Clone, Copy, Debug)]
pub(crate) struct InverseMass<T> {
    /// A [1/kg].
    pub(crate) translation: Sym3<T>,
    /// C, row by row.
    pub(crate) mixed: [[T; 3]; 3],
    /// W.
    pub(crate) rotation: Sym3<T>,
}

/// A body as the joints see it that have not been eliminated yet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Left<T> {
    /// What is left of its inverse mass.
    pub inverse_mass: InverseMass<T>,
    /// How the eliminated joints would move it: (dx, dphi).
    pub correction: Spatial<T>,
}

/// A body's share in a joint, at a connector with the arm r. With J = [I, -[r]x; 0, -I] (for a joint's body b, all signs
/// are opposite) and the inverse mass H: the symmetric J H J^T in its parts, and the left half of J H.
struct Share<T> {
    stretch: Sym3<T>,
    /// Minus the stretch-bend part; `J H = [coupled, mixed; -C^T, -W]`.
    mixed: [[T; 3]; 3],
    coupled: [[T; 3]; 3],
}

impl<T: Real> InverseMass<T> {
    /// That of a body on its own.
    #[inline(always)]
    pub(crate) fn free(inverse_mass: T, inverse_inertia: Sym3<T>) -> Self {
        Self { translation: Sym3::identity(inverse_mass), mixed: [[T::zero(); 3]; 3], rotation: inverse_inertia }
    }

    /// `H impulse`.
    #[inline(always)]
    pub(crate) fn apply(&self, impulse: Spatial<T>) -> Spatial<T> {
        let (f, torque) = (impulse.linear, impulse.angular);
        let [a, b, c] = self.mixed;
        let [x, y, z] = f.0;
        Spatial {
            linear: self.translation.apply(f) + Vec3([Vec3(a).dot(torque), Vec3(b).dot(torque), Vec3(c).dot(torque)]),
            angular: self.rotation.apply(torque) + Vec3(a) * x + Vec3(b) * y + Vec3(c) * z,
        }
    }

    #[inline(always)]
    fn share(&self, r: Vec3<T>) -> Share<T> {
        let mixed = sum(self.mixed, crossed_by(r, self.rotation));
        let coupled = sum(self.translation.full(), transposed(map_rows(self.mixed, |row| row.cross(r))));
        let upper = |m: [[T; 3]; 3]| Sym3([m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2]]);
        Share { stretch: upper(coupled) + upper(map_rows(mixed, |row| row.cross(r))), mixed, coupled }
    }

    /// The same where C = 0 and A is a multiple of the identity.
    #[inline(always)]
    fn share_of_free(&self, r: Vec3<T>) -> Share<T> {
        let mixed = crossed_by(r, self.rotation);
        let [x, y, z] = map_rows(mixed, |row| row.cross(r));
        let k = self.translation.0[0];
        Share {
            stretch: Sym3([k + x[0], k + y[1], k + z[2], x[1], x[2], y[2]]),
            mixed,
            coupled: self.translation.full(),
        }
    }
}

/// `-[r]x W`: row i of W [r]x is (row i of W) x r, and its transpose is this.
#[inline(always)]
fn crossed_by<T: Real>(r: Vec3<T>, w: Sym3<T>) -> [[T; 3]; 3] {
    transposed(map_rows(w.full(), |row| row.cross(r)))
}

/// `J (dx, dphi)` at a connector with the arm r: see `Share`.
#[inline(always)]
pub(crate) fn at_connector<T: Real>(r: Vec3<T>, correction: Spatial<T>) -> Spatial<T> {
    Spatial { linear: correction.linear + correction.angular.cross(r), angular: -correction.angular }
}

/// `J^T (force, torque)` at a connector with the arm r: see `Share`.
#[inline(always)]
pub(crate) fn on_body<T: Real>(r: Vec3<T>, x: Spatial<T>) -> Spatial<T> {
    Spatial { linear: x.linear, angular: r.cross(x.linear) - x.angular }
}

/// What a node needs of the system, in world rows; all of the joint's signs are turned so that the inner body's is +.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeTerms<T> {
    /// alpha~ of stretch-shear and of bend-twist.
    pub compliance: [Sym3<T>; 2],
    /// Right-hand side.
    pub rhs: Spatial<T>,
    /// Arms of the outer and the inner connector.
    pub arms: [Vec3<T>; 2],
}

/// A joint's share of the factor: `D = L Delta L^T`, and the right-hand side less what the joints beyond it take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeFactor<T> {
    /// L below its unit diagonal, row by row.
    lower: [T; 15],
    /// Reciprocals of the pivots Delta.
    inverse_pivots: [T; 6],
    /// Right-hand side.
    rhs: [T; 6],
}

/// Place of entry (row, column) of a strictly lower triangle kept row by row.
const fn below(row: usize, column: usize) -> usize {
    row * (row - 1) / 2 + column
}

impl<T: Real> NodeFactor<T> {
    /// Zero, to be overwritten.
    pub(crate) fn zero() -> Self {
        Self { lower: [T::zero(); 15], inverse_pivots: [T::zero(); 6], rhs: [T::zero(); 6] }
    }

    /// Factors the lower triangle of D.
    #[inline(always)]
    fn factor(&mut self, mut d: Block<T>) {
        for k in 0..6 {
            let inverse = T::splat(1.0) / d[k][k];
            self.inverse_pivots[k] = inverse;
            for i in k + 1..6 {
                let l = d[i][k] * inverse;
                self.lower[below(i, k)] = l;
                for j in k + 1..=i {
                    d[i][j] -= l * d[j][k];
                }
            }
        }
    }

    /// Factors D of a joint between two bodies, given the inner one's share.
    #[inline(always)]
    fn set(&mut self, terms: &NodeTerms<T>, outer: &Left<T>, inner: &Left<T>, near: &Share<T>) {
        let [r_outer, r_inner] = terms.arms;
        let beyond = outer.inverse_mass.share(r_outer);
        let stretch = beyond.stretch + near.stretch + terms.compliance[0];
        let bend = outer.inverse_mass.rotation + inner.inverse_mass.rotation + terms.compliance[1];
        let mixed = sum(beyond.mixed, near.mixed);
        let rhs = terms.rhs.plus(at_connector(r_outer, outer.correction), T::splat(1.0));
        self.rhs = rhs.plus(at_connector(r_inner, inner.correction), T::splat(-1.0)).to_array();
        let minus = transposed(map_rows(mixed, |row| -row));
        self.factor(assemble(stretch.full(), mixed, minus, bend.full()));
    }

    /// Eliminates a joint: what is carried turns from the outer body into what is left of the inner one.
    ///
    /// With `V = L^-1 J H` and `y = L^-1 r`: `H -= V^T Delta^-1 V`, `correction += V^T Delta^-1 y`. If the inner body is
    /// `FRESH`, H is block diagonal and V has a triangle of zeros.
    #[inline(always)]
    pub(crate) fn eliminate<const FRESH: bool>(
        &mut self,
        terms: &NodeTerms<T>,
        carried: &mut Left<T>,
        inner: &Left<T>,
    ) {
        let InverseMass { translation, mixed, rotation } = inner.inverse_mass;
        let r = terms.arms[1];
        let near = if FRESH { inner.inverse_mass.share_of_free(r) } else { inner.inverse_mass.share(r) };
        self.set(terms, carried, inner, &near);
        let zero = T::zero();
        // First row of V that is not zero in a column.
        let first = |column: usize| if FRESH && column < 3 { column } else { 0 };
        let minus = |m: [[T; 3]; 3]| map_rows(m, |row| -row);
        let mut v = assemble(near.coupled, near.mixed, minus(transposed(mixed)), minus(rotation.full()));
        if FRESH {
            for r in 0..6 {
                for c in 0..3 {
                    v[r][c] = if r == c { translation.0[0] } else { zero };
                }
            }
        }
        let mut y = self.rhs;
        for i in 1..6 {
            for k in 0..i {
                let l = self.lower[below(i, k)];
                y[i] -= l * y[k];
                for c in 0..6 {
                    if k >= first(c) {
                        v[i][c] -= l * v[k][c];
                    }
                }
            }
        }
        let mut h = assemble(translation.full(), mixed, transposed(mixed), rotation.full());
        let mut u = inner.correction.to_array();
        for r in 0..6 {
            for k in first(r)..6 {
                let scaled = v[k][r] * self.inverse_pivots[k];
                u[r] += scaled * y[k];
                for c in r..6 {
                    if k >= first(c) {
                        h[r][c] -= scaled * v[k][c];
                    }
                }
            }
        }
        *carried = Left { inverse_mass: InverseMass::from_upper(h), correction: Spatial::from_array(u) };
    }

    /// `x = D^-1 (r - J H impulse)`, given `change = J H impulse`.
    #[inline(always)]
    pub(crate) fn solve(&self, change: Spatial<T>) -> Spatial<T> {
        let change = change.to_array();
        let mut x = self.rhs;
        for k in 0..6 {
            x[k] -= change[k];
        }
        for i in 1..6 {
            for k in 0..i {
                x[i] -= self.lower[below(i, k)] * x[k];
            }
        }
        for k in 0..6 {
            x[k] = x[k] * self.inverse_pivots[k];
        }
        for i in (1..6).rev() {
            for k in 0..i {
                x[k] -= self.lower[below(i, k)] * x[i];
            }
        }
        Spatial::from_array(x)
    }
}

impl<T: Real> InverseMass<T> {
    #[inline(always)]
    fn from_upper(h: Block<T>) -> Self {
        Self {
            translation: Sym3([h[0][0], h[1][1], h[2][2], h[0][1], h[0][2], h[1][2]]),
            mixed: [[h[0][3], h[0][4], h[0][5]], [h[1][3], h[1][4], h[1][5]], [h[2][3], h[2][4], h[2][5]]],
            rotation: Sym3([h[3][3], h[4][4], h[5][5], h[3][4], h[3][5], h[4][5]]),
        }
    }

    /// Two side by side.
    #[inline(always)]
    pub(crate) fn both(a: &Self, b: &Self) -> InverseMass<Both<T>> {
        let mut mixed = [[Both([T::zero(); 2]); 3]; 3];
        for k in 0..3 {
            mixed[k] = Both::zip(a.mixed[k], b.mixed[k]);
        }
        InverseMass {
            translation: Sym3(Both::zip(a.translation.0, b.translation.0)),
            mixed,
            rotation: Sym3(Both::zip(a.rotation.0, b.rotation.0)),
        }
    }
}

impl<T: Real> Left<T> {
    /// Two side by side.
    #[inline(always)]
    pub(crate) fn both(a: &Self, b: &Self) -> Left<Both<T>> {
        Left {
            inverse_mass: InverseMass::both(&a.inverse_mass, &b.inverse_mass),
            correction: Spatial::both(a.correction, b.correction),
        }
    }
}

impl<T: Real> Left<Both<T>> {
    /// One of the two.
    #[inline(always)]
    pub(crate) fn one(&self, k: usize) -> Left<T> {
        let [a, b, c] = self.inverse_mass.mixed;
        Left {
            inverse_mass: InverseMass {
                translation: Sym3(Both::pick(self.inverse_mass.translation.0, k)),
                mixed: [Both::pick(a, k), Both::pick(b, k), Both::pick(c, k)],
                rotation: Sym3(Both::pick(self.inverse_mass.rotation.0, k)),
            },
            correction: self.correction.one(k),
        }
    }
}
