//! One node of the elimination: a body and the joint at its inner end, in the rows of that joint.
//!
//! With the outer body's movement c and the inner body's u in the joint's rows ([`super::stiffness`]), the energy of a node is
//!
//! ```text
//! c^T P c / 2 - c^T E u - b^T c + gamma^T alpha~^-1 gamma / 2,    c = rhs + gamma - u
//! ```
//!
//! P is what is left of the outer body, E the coupling of the two bodies' turns, and gamma what the joint yields. The part of
//! degree two in u alone is `P + E + E^T`, and gamma meets u in `P + E`. So gamma is eliminated in two blocks of
//! [`Series`], those of stretch-shear and of bend-twist; E has entries in the second alone.

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use super::Coupling;
use super::condensation::{Alone, Condensation, Root};
use super::stiffness::{Stiffness, in_rows, on_rows};
use kernels::Spatial;
use kernels::lane::{Both, Real};
use kernels::math::{Sym3, Vec3};

/// What is left of a body: its stiffness, and the forces on it, whose first column stands alone. The others are for a unit
/// of movement of a body that comes last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Left<T, const M: usize> {
    pub(super) stiffness: Stiffness<T>,
    pub(super) forces: [[T; M]; 6],
}

impl<T: Real, const M: usize> Left<T, M> {
    /// One on which no force but this one acts.
    #[inline(always)]
    pub(super) fn new(stiffness: Stiffness<T>, force: Spatial<T>) -> Self {
        let mut forces = [[T::zero(); M]; 6];
        set_column(&mut forces, 0, force);
        Self { stiffness, forces }
    }

    #[inline(always)]
    pub(super) fn plus(&self, other: &Self) -> Self {
        let mut forces = self.forces;
        for r in 0..6 {
            for c in 0..M {
                forces[r][c] += other.forces[r][c];
            }
        }
        Self { stiffness: self.stiffness.plus(&other.stiffness), forces }
    }
}

/// Takes a row that has been eliminated off the far body.
#[inline(always)]
pub(super) fn take_row_off<T: Real, const M: usize>(far: &mut Left<T, M>, row: &[T; M], weight: T) {
    let mut movement = [T::zero(); 6];
    movement.copy_from_slice(&row[1..]);
    far.stiffness.subtract(movement, weight);
    for (own, x) in far.forces.iter_mut().zip(movement) {
        own[0] += weight * row[0] * x;
    }
}

impl<T: Real> Left<T, 1> {
    /// Two side by side.
    #[inline(always)]
    pub(super) fn both(a: &Self, b: &Self) -> Left<Both<T>, 1> {
        let force = Spatial::both(column(&a.forces, 0), column(&b.forces, 0));
        Left::new(Stiffness::both(&a.stiffness, &b.stiffness), force)
    }
}

impl<T: Real> Left<Both<T>, 1> {
    /// One of the two.
    #[inline(always)]
    pub(super) fn one(&self, k: usize) -> Left<T, 1> {
        Left::new(self.stiffness.one(k), column(&self.forces, 0).one(k))
    }
}

/// Column c of six rows.
#[inline(always)]
pub(super) fn column<T: Real, const M: usize>(rows: &[[T; M]; 6], c: usize) -> Spatial<T> {
    let mut out = [T::zero(); 6];
    for r in 0..6 {
        out[r] = rows[r][c];
    }
    Spatial::from_array(out)
}

/// Sets column c of six rows.
#[inline(always)]
pub(super) fn set_column<T: Real, const M: usize>(rows: &mut [[T; M]; 6], c: usize, x: Spatial<T>) {
    let x = x.to_array();
    for r in 0..6 {
        rows[r][c] = x[r];
    }
}

/// What a node needs of the equations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terms<T> {
    /// Sign of the outer body in the joint; that of the inner body is opposite.
    pub(super) sigma: T,
    /// Arms of the outer and the inner connector.
    pub(super) arms: [Vec3<T>; 2],
    /// alpha~ of stretch-shear and of bend-twist.
    pub(super) compliance: [Sym3<T>; 2],
    /// That of bend-twist as a root.
    pub(super) bend: Root<T>,
    /// E: how the turns of the outer body (rows) and of the inner body (columns) are coupled.
    pub(super) coupling: Coupling<T>,
    pub(super) rhs: Spatial<T>,
}

impl<T: Real> Terms<T> {
    /// A movement of the inner body in the joint's rows, or back.
    #[inline(always)]
    pub(super) fn of_inner(&self, x: Spatial<T>) -> Spatial<T> {
        in_rows(-self.sigma, self.arms[1], x)
    }

    /// A movement of the outer body in the joint's rows, or back.
    #[inline(always)]
    pub(super) fn of_outer(&self, x: Spatial<T>) -> Spatial<T> {
        in_rows(self.sigma, self.arms[0], x)
    }

    /// Forces on the outer body in the joint's rows, or back.
    #[inline(always)]
    pub(super) fn on_outer(&self, x: Spatial<T>) -> Spatial<T> {
        on_rows(self.sigma, self.arms[0], x)
    }

    /// Forces on the inner body in the joint's rows, or back.
    #[inline(always)]
    pub(super) fn on_inner(&self, x: Spatial<T>) -> Spatial<T> {
        on_rows(-self.sigma, self.arms[1], x)
    }

    /// `E^T x` of a turn in the joint's rows.
    #[inline(always)]
    pub(super) fn coupled(&self, x: Vec3<T>) -> Vec3<T> {
        self.coupling.transposed().apply(x)
    }

    /// Two side by side.
    #[inline(always)]
    pub(super) fn both(a: &Self, b: &Self) -> Terms<Both<T>> {
        let compliance = |part: usize| Sym3(Both::zip(a.compliance[part].0, b.compliance[part].0));
        Terms {
            sigma: Both([a.sigma, b.sigma]),
            arms: [Vec3::both(a.arms[0], b.arms[0]), Vec3::both(a.arms[1], b.arms[1])],
            compliance: [compliance(0), compliance(1)],
            bend: Root::both(&a.bend, &b.bend),
            coupling: Coupling::both(a.coupling, b.coupling),
            rhs: Spatial::both(a.rhs, b.rhs),
        }
    }
}

/// A node that has been eliminated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor<T> {
    /// Rows of stretch-shear, and of bend-twist, which come after them.
    pub(super) parts: [Condensation<T>; 2],
}

/// Right-hand sides of both parts: beside the factor, as others come while it stays.
pub(super) type Sides<T, const M: usize> = [Alone<T, M>; 2];

impl<T: Real> Factor<T> {
    /// Zero, to be overwritten.
    pub(super) fn zero() -> Self {
        Self { parts: [Condensation::zero(); 2] }
    }

    /// Eliminates a node; returns the factor, its right-hand sides, and what it adds to the inner body. `forces` are those on the
    /// outer body in the joint's rows.
    #[inline(always)]
    pub(super) fn new<const M: usize>(
        terms: &Terms<T>,
        outer: &Stiffness<T>,
        forces: &[[T; M]; 6],
    ) -> (Self, Sides<T, M>, Left<T, M>) {
        let mut left = outer.seen(terms.arms[0]);
        let mut forces = *forces;
        let moved = left.apply(terms.rhs).to_array();
        for r in 0..6 {
            forces[r][0] -= moved[r];
        }
        let ([a, b, c], m) = (left.translation.full(), left.mixed);
        let rows = [beside(a, m[0]), beside(b, m[1]), beside(c, m[2])];
        let alone = [forces[0], forces[1], forces[2]];
        let (stretch, of_stretch) = Condensation::new(Root::new(terms.compliance[0]), left.translation, rows, alone);
        stretch.take_off(&of_stretch, &mut left, &mut forces);
        let turning = left.turning;
        let (w, m, e) = (turning.full(), left.mixed, terms.coupling.full());
        let row = |k: usize| {
            let turn = Vec3(w[k]) + Vec3(e[k]);
            let [x, y, z] = turn.0;
            [m[0][k], m[1][k], m[2][k], x, y, z]
        };
        let (rows, alone) = ([row(0), row(1), row(2)], [forces[3], forces[4], forces[5]]);
        left.turning = turning + terms.coupling.symmetric * T::splat(-2.0);
        let (bend, of_bend) = Condensation::new(terms.bend, turning, rows, alone);
        bend.take_off(&of_bend, &mut left, &mut forces);
        let added = Left { stiffness: left.seen(terms.arms[1]), forces: Self::on_inner(terms, &forces) };
        (Self { parts: [stretch, bend] }, [of_stretch, of_bend], added)
    }

    /// Forces of a node on the inner body, from those in the joint's rows.
    #[inline(always)]
    fn on_inner<const M: usize>(terms: &Terms<T>, forces: &[[T; M]; 6]) -> [[T; M]; 6] {
        let mut added = [[T::zero(); M]; 6];
        for c in 0..M {
            let x = column(forces, c);
            let mut x = Spatial { linear: -x.linear, angular: -x.angular };
            if c == 0 {
                x.angular += terms.coupled(terms.rhs.angular);
            }
            set_column(&mut added, c, terms.on_inner(x));
        }
        added
    }

    /// Whether the energy of the node and of all beyond it is at a minimum with the inner body held.
    #[inline(always)]
    pub(super) fn is_positive(&self) -> bool {
        self.parts[0].is_positive() & self.parts[1].is_positive()
    }

    /// Whether it is in one lane.
    pub(super) fn is_positive_in(&self, lane: usize) -> bool {
        self.parts.iter().all(|part| part.is_positive_in(lane))
    }

    /// Whether no pivot vanishes or is not a number, in one lane.
    pub(super) fn is_regular_in(&self, lane: usize) -> bool {
        self.parts.iter().all(|part| part.is_regular_in(lane))
    }

    /// Negative pivots, in one lane.
    pub(super) fn negative_in(&self, lane: usize) -> usize {
        self.parts.iter().map(|part| part.negative_in(lane)).sum()
    }

    /// The outer body's movement (dx, dphi) and what the joint transmits, in world rows, for a movement of the inner body.
    #[inline(always)]
    pub(super) fn solve<const M: usize>(
        &self,
        terms: &Terms<T>,
        sides: &Sides<T, M>,
        inner: Spatial<T>,
        numbers: &[T; M],
    ) -> [Spatial<T>; 2] {
        let u = terms.of_inner(inner);
        let [bent, torque] = self.parts[1].solve(&sides[1], u.to_array(), numbers);
        let near = Spatial { linear: u.linear, angular: u.angular - bent };
        let [stretched, force] = self.parts[0].solve(&sides[0], near.to_array(), numbers);
        let rhs = terms.rhs;
        let c = Spatial { linear: rhs.linear + stretched - u.linear, angular: rhs.angular + bent - u.angular };
        [terms.of_outer(c), Spatial { linear: force, angular: torque }]
    }

    /// Takes another right-hand side, that of `terms` and a force on the outer body; returns its share of the rows and the force on
    /// the inner body.
    ///
    /// P, of which three rows are known from stretch-shear before its elimination and three from bend-twist after it, takes
    /// `P rhs` off the forces.
    #[inline(always)]
    pub(super) fn carry(&self, terms: &Terms<T>, force: Spatial<T>) -> (Sides<T, 1>, Spatial<T>) {
        let rhs = terms.rhs.to_array();
        let [f0, f1, f2, f3, f4, f5] = terms.on_outer(force).to_array();
        let [stretch, bend] = &self.parts;
        let of_stretch = stretch.take([f0, f1, f2], rhs);
        let [[a0], [a1], [a2]] = of_stretch;
        let alone = [a0, a1, a2];
        let along = stretch.along(rhs);
        let [p0, p1, p2] = stretch.undone(along).0;
        let [e3, e4, e5] = terms.coupling.apply(terms.rhs.angular).0;
        let mut forces = [f0 - p0, f1 - p1, f2 - p2, f3 + e3, f4 + e4, f5 + e5];
        let both = [alone[0] + along[0], alone[1] + along[1], alone[2] + along[2]];
        stretch.take_off_forces(alone, both, &mut forces);
        let of_bend = bend.take([forces[3], forces[4], forces[5]], rhs);
        let [[a0], [a1], [a2]] = of_bend;
        let alone = [a0, a1, a2];
        for (force, p) in forces[3..].iter_mut().zip(bend.undone(bend.along(rhs)).0) {
            *force -= p;
        }
        bend.take_off_forces(alone, alone, &mut forces);
        let [f0, f1, f2, f3, f4, f5] = forces;
        let added = Self::on_inner(terms, &[[f0], [f1], [f2], [f3], [f4], [f5]]);
        ([of_stretch, of_bend], column(&added, 0))
    }
}

impl<T: Real> Factor<T> {
    /// How the outer body follows the inner one, and how it answers forces on itself and beyond where that is held: a column for
    /// each unit movement, and for each unit force.
    #[inline(always)]
    pub(super) fn follows(&self, terms: &Terms<T>) -> [[Spatial<T>; 6]; 2] {
        let terms = Terms { rhs: Spatial::zero(), ..*terms };
        let (nothing, numbers) = ([[[T::zero(); 1]; 3]; 2], [T::splat(1.0)]);
        let mut columns = [[Spatial::zero(); 6]; 2];
        for k in 0..6 {
            let mut unit = [T::zero(); 6];
            unit[k] = T::splat(1.0);
            let unit = Spatial::from_array(unit);
            [columns[0][k], _] = self.solve(&terms, &nothing, unit, &numbers);
            let (sides, _) = self.carry(&terms, unit);
            [columns[1][k], _] = self.solve(&terms, &sides, Spatial::zero(), &numbers);
        }
        columns
    }
}

#[inline(always)]
fn beside<T: Real>([a, b, c]: [T; 3], [d, e, f]: [T; 3]) -> [T; 6] {
    [a, b, c, d, e, f]
}
