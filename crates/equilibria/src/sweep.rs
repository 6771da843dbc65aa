//! One linear solve of Newton's method: energy, gradient and Hessian at the current turns, and their elimination.
//!
//! The unknowns are the turns theta_i of the N segments, each in its own body frame, `q_i <- q_i exp(theta_i)`, and the force
//! lambda with which the cable pulls at its first grip. Positions are eliminated exactly: each joint yields by its compliance
//! alpha times the force F_j that it bears, and the forces are `F_j = lambda + z (weight before joint j)`. What is left is
//!
//! ```text
//! L(q, lambda) = sum_j 1/2 (u_j - u0_j)^T k (u_j - u0_j) - sum_i l_i T_i.d_i + lambda.chord - alpha/2 sum_j |F_j|^2
//! ```
//!
//! with u_j the imaginary part of conj(q_j) q_(j+1), k = 4 K / h over a joint's length h, u0 = h Omega_0 / 2, d_i the axis
//! of segment i and T_i the force at its centre. So an equilibrium here is one of positions and turns, stretch and all. Its Newton matrix is
//! block-tridiagonal with 3 x 3 blocks and a border of three: `[[H, A^T], [A, -alpha]]`. It is a stable minimum of the energy
//! where the matrix has three negative eigenvalues (Haynsworth 1968); the elimination counts its negative pivots.
//!
//! All is in units of the cable's length and of its larger bending stiffness over it. A free end has no last joint, and lambda is known.

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use cosserat::internals::kernels::lane::Real;
use cosserat::internals::kernels::math::{Quat, Vec3};

use crate::joint::{Bend, Factor, column, onto};

/// Joints differ only by their place: half a segment at the grips, then between an end segment and an inner one, then
/// between two inner ones.
pub(crate) const KINDS: usize = 3;

/// A cable cut into segments, or several side by side.
#[derive(Clone, Debug)]
pub(crate) struct Chain<T> {
    /// Lengths of the first and last segment, and of those in between.
    pub(crate) lengths: [T; 2],
    /// k, by the kind of the joint.
    pub(crate) stiffness: [[T; 3]; KINDS],
    /// u0, by the kind of the joint.
    pub(crate) rest: [[T; 3]; KINDS],
    /// 1 where the end is held, 0 where it is free.
    pub(crate) held: T,
    /// Weight before the centre of each segment.
    pub(crate) weights: Vec<T>,
    /// Sum of the joints' compliances, and of compliances times weight before.
    pub(crate) compliance: T,
    pub(crate) sag: T,
    /// From grip to grip.
    pub(crate) chord: Vec3<T>,
    /// Orientations of the grips.
    pub(crate) ends: [Quat<T>; 2],
    /// Orientations of the segments.
    pub(crate) turns: Vec<Quat<T>>,
    /// Force on the start's grip.
    pub(crate) force: Vec3<T>,
}

/// What a solve found at the turns where it began.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found<T> {
    /// L after the step, to second order: at an equilibrium the energy, but for a constant of the query.
    pub(crate) energy: T,
    /// Negative pivots, less those of an equilibrium that is stable: 0 at a minimum.
    pub(crate) wrong: T,
    /// Change of the force on the start's grip.
    pub(crate) force: Vec3<T>,
    /// Largest turn of a segment, and of one against its neighbour.
    pub(crate) turn: T,
    pub(crate) bend: T,
}

/// What is left when the turns of all segments are eliminated.
pub(crate) struct Front<T> {
    /// L without the chord's part, and negative pivots.
    pub(crate) energy: T,
    pub(crate) wrong: T,
    /// From the first grip to the end of the last segment.
    pub(crate) reached: Vec3<T>,
    /// Of the force's rows: the Schur complement without the compliance, and what the right-hand side gains.
    pub(crate) schur: [T; 6],
    pub(crate) rest: Vec3<T>,
    /// Of the rows of the end's turn: what its block and its right-hand side gain, and its coupling with the force.
    pub(crate) block: [T; 6],
    pub(crate) border: [[T; 3]; 3],
    pub(crate) right: Vec3<T>,
    /// The last joint.
    pub(crate) last: Bend<T>,
}

/// What the way back has seen: largest squared turn of a segment and of one against its neighbour, and the sum of gradients
/// times changes.
pub(crate) struct Steps<T> {
    pub(crate) turn: T,
    pub(crate) bend: T,
    pub(crate) slope: T,
}

/// What holds at the turns as they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Balance<T> {
    /// Of bending and twist.
    pub(crate) energy: T,
    /// Largest moment out of balance, and gap at the end.
    pub(crate) residual: [T; 2],
    /// Moments on the cable's ends by its grips, each in its grip's frame.
    pub(crate) moments: [Vec3<T>; 2],
}

/// Rows that stay from the way forwards to the way back, and the solution.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<T> {
    /// D^-1 B, D^-1 Y and D^-1 g.
    next: [[T; 3]; 3],
    border: [[T; 3]; 3],
    right: Vec3<T>,
    gradient: Vec3<T>,
    /// conj(q) q of the joint before.
    relative: Quat<T>,
    /// The turn.
    pub(crate) theta: Vec3<T>,
}

impl<T: Real> Row<T> {
    pub(crate) fn zero() -> Self {
        let (o, z) = ([[T::zero(); 3]; 3], Vec3::zero());
        Self { next: o, border: o, right: z, gradient: z, relative: Quat::identity(), theta: z }
    }
}

#[inline(always)]
fn largest<T: Real>(most: T, v: Vec3<T>) -> T {
    v.0[0].abs().max(v.0[1].abs()).max(v.0[2].abs().max(most))
}

impl<T: Real> Chain<T> {
    #[inline(always)]
    pub(crate) fn kind(joint: usize, count: usize) -> usize {
        if joint == 0 || joint == count {
            0
        } else if joint == 1 || joint == count - 1 {
            1
        } else {
            2
        }
    }

    /// Solves for the step from here with turns made stiffer by `shift` times the segments' lengths; the rows hold it.
    #[inline(always)]
    pub(crate) fn solve(&self, rows: &mut [Row<T>], shift: T) -> Found<T> {
        self.solve_for(rows, shift, |_, own| own, |own| own)
    }

    /// The same for other right-hand sides than the gradient of a segment and the gap, which they are made of.
    #[inline(always)]
    pub(crate) fn solve_for(
        &self,
        rows: &mut [Row<T>],
        shift: T,
        moment: impl Fn(usize, Vec3<T>) -> Vec3<T>,
        miss: impl Fn(Vec3<T>) -> Vec3<T>,
    ) -> Found<T> {
        let (one, zero, half) = (T::splat(1.0), T::zero(), T::splat(0.5));
        let front = self.eliminate(rows, shift, moment);
        // The border: what the chord misses, and the compliance of the joints; a known force does not change.
        let gap = miss(self.gap(front.reached)) * self.held;
        let mut schur = front.schur;
        for k in 0..6 {
            let own = if k < 3 { self.held * self.compliance + one - self.held } else { zero };
            schur[k] = schur[k] * self.held - own;
        }
        let factor = Factor::new(schur);
        let force = -Vec3(factor.solve((gap + front.rest * self.held).0));
        let wrong = front.wrong + (factor.negative - T::splat(3.0));
        let Steps { turn, bend, slope } = self.substitute(rows, force, Vec3::zero(), gap.dot(force));
        let energy = front.energy + (self.force.dot(self.chord) * self.held + half * slope);
        Found { energy, wrong, force, turn: turn.sqrt(), bend: bend.sqrt() }
    }

    /// By how much the chord is missed: the gradient by the force of a chain that reaches so far.
    #[inline(always)]
    pub(crate) fn gap(&self, reached: Vec3<T>) -> Vec3<T> {
        let mut gap = self.chord - reached - self.force * self.compliance;
        gap.0[2] -= self.sag;
        gap
    }

    /// The way forwards: eliminates the turns of all segments, whose gradients `moment` may change.
    #[inline(always)]
    pub(crate) fn eliminate(
        &self,
        rows: &mut [Row<T>],
        shift: T,
        moment: impl Fn(usize, Vec3<T>) -> Vec3<T>,
    ) -> Front<T> {
        let count = self.turns.len();
        let rows = &mut rows[..count];
        let weights = &self.weights[..count];
        let (one, zero, half) = (T::splat(1.0), T::zero(), T::splat(0.5));
        let mut bend = Bend::new(self.ends[0], self.turns[0], self.stiffness[0], self.rest[0]);
        let (mut energy, mut wrong) = (zero, zero);
        let mut reached = Vec3::<T>::zero();
        // What the elimination so far leaves of the Schur complement of the border: 6 entries and the right-hand side.
        let mut schur = [zero; 6];
        let mut rest = Vec3::<T>::zero();
        // What it takes from the next segment's block, border and gradient.
        let mut block = [zero; 6];
        let mut border = [[zero; 3]; 3];
        let mut right = Vec3::<T>::zero();
        for i in 0..count {
            let q = self.turns[i];
            let Bend { relative, energy: own, gradient: [_, from_before], own: [_, before], .. } = bend;
            energy += own;
            let kind = Self::kind(i + 1, count);
            let mut after = Bend::new(
                q,
                if i + 1 < count { self.turns[i + 1] } else { self.ends[1] },
                self.stiffness[kind],
                self.rest[kind],
            );
            if i + 1 == count {
                let held = self.held;
                after.energy = after.energy * held;
                after.gradient[0] = after.gradient[0] * held;
                for entry in &mut after.own[0] {
                    *entry = *entry * held;
                }
                energy += after.energy;
            }
            let length = self.lengths[usize::from(i != 0 && i + 1 != count)];
            let [x, y, z] = q.v.0;
            let w = q.w;
            let two = T::splat(2.0);
            let d1 = Vec3([one - two * (y * y + z * z), two * (x * y + w * z), two * (x * z - w * y)]) * length;
            let d2 = Vec3([two * (x * y - w * z), one - two * (x * x + z * z), two * (y * z + w * x)]) * length;
            let d3 = q.axis() * length;
            reached += d3;
            let mut pull = self.force;
            pull.0[2] += weights[i];
            let t = [pull.dot(d1), pull.dot(d2), pull.dot(d3)];
            energy -= t[2];
            let mut gradient = from_before + after.gradient[0];
            gradient.0[0] += t[1];
            gradient.0[1] -= t[0];
            let gradient = moment(i, gradient);
            let stiffer = shift * length;
            let mut d = block;
            for k in 0..6 {
                d[k] += before[k] + after.own[0][k];
            }
            d[0] += t[2] + stiffer;
            d[1] += t[2] + stiffer;
            d[2] += stiffer;
            d[4] -= half * t[0];
            d[5] -= half * t[1];
            let factor = Factor::new(d);
            wrong += factor.negative;
            for c in 0..3 {
                border[0][c] += d2.0[c];
                border[1][c] -= d1.0[c];
            }
            let g = gradient + right;
            // Columns of D^-1 B, D^-1 Y and D^-1 g.
            let across = &after.across;
            let row = &mut rows[i];
            for c in 0..3 {
                let solved = factor.solve(column(across, c));
                let bordered = factor.solve(column(&border, c));
                for r in 0..3 {
                    row.next[r][c] = solved[r];
                    row.border[r][c] = bordered[r];
                }
            }
            row.right = Vec3(factor.solve(g.0));
            row.gradient = gradient;
            row.relative = relative;
            for (k, (r, c)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
                schur[k] -= onto(&border, r, column(&row.border, c));
            }
            for r in 0..3 {
                rest.0[r] -= onto(&border, r, row.right.0);
            }
            // X^T on what comes next: B^T D^-1 B, B^T D^-1 Y, B^T D^-1 g.
            for (k, (r, c)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
                block[k] = -onto(&row.next, r, column(across, c));
            }
            let old = border;
            for r in 0..3 {
                for c in 0..3 {
                    border[r][c] = -onto(&row.next, r, column(&old, c));
                }
            }
            right = -Vec3([onto(&row.next, 0, g.0), onto(&row.next, 1, g.0), onto(&row.next, 2, g.0)]);
            bend = after;
        }
        Front { energy, wrong, reached, schur, rest, block, border, right, last: bend }
    }

    /// The way back: the turns of all segments as the force changes by `force` and the end turns by `end`; `slope` is where
    /// the sum begins.
    #[inline(always)]
    pub(crate) fn substitute(&self, rows: &mut [Row<T>], force: Vec3<T>, end: Vec3<T>, slope: T) -> Steps<T> {
        let count = self.turns.len();
        let rows = &mut rows[..count];
        let (zero, one) = (T::zero(), T::splat(1.0));
        let mut following = end;
        let (mut turn, mut relatively, mut slope) = (zero, zero, slope);
        let last = (self.turns[count - 1].conj() * self.ends[1]).upper();
        let mut relative = last;
        for i in (0..count).rev() {
            let row = &mut rows[i];
            let mut theta = -row.right;
            for r in 0..3 {
                theta.0[r] -= Vec3(row.border[r]).dot(force);
                theta.0[r] -= Vec3(row.next[r]).dot(following);
            }
            turn = turn.max(theta.norm_squared());
            let against = theta - relative.rotate(following);
            let kept = if i + 1 == count { self.held } else { one };
            relatively = relatively.max(against.norm_squared() * kept);
            slope += theta.dot(row.gradient);
            row.theta = theta;
            following = theta;
            relative = row.relative;
        }
        relatively = relatively.max(following.norm_squared());
        Steps { turn, bend: relatively, slope }
    }

    /// How far from balance it is, and what its ends bear.
    #[inline(always)]
    pub(crate) fn balance(&self) -> Balance<T> {
        let count = self.turns.len();
        let zero = T::zero();
        let mut bend = Bend::new(self.ends[0], self.turns[0], self.stiffness[0], self.rest[0]);
        let first = bend.gradient[0];
        let (mut energy, mut most, mut reached) = (zero, zero, Vec3::zero());
        for (i, &q) in self.turns.iter().enumerate() {
            energy += bend.energy;
            let kind = Self::kind(i + 1, count);
            let next = if i + 1 < count { self.turns[i + 1] } else { self.ends[1] };
            let mut after = Bend::new(q, next, self.stiffness[kind], self.rest[kind]);
            if i + 1 == count {
                after.energy = after.energy * self.held;
                after.gradient = [after.gradient[0] * self.held, after.gradient[1] * self.held];
            }
            let length = self.lengths[usize::from(i != 0 && i + 1 != count)];
            let mut pull = self.force;
            pull.0[2] += self.weights[i];
            let t = q.rotate_back(pull) * length;
            reached += q.axis() * length;
            let mut gradient = bend.gradient[1] + after.gradient[0];
            gradient.0[0] += t.0[1];
            gradient.0[1] -= t.0[0];
            most = largest(most, gradient);
            bend = after;
        }
        energy += bend.energy;
        let mut gap = self.chord - reached - self.force * self.compliance;
        gap.0[2] -= self.sag;
        Balance { energy, residual: [most, largest(zero, gap * self.held)], moments: [first, bend.gradient[1]] }
    }

    /// Goes on: turns by `share` of the step, and the force by `forces` of its change.
    #[inline(always)]
    pub(crate) fn step(&mut self, rows: &[Row<T>], share: T, force: Vec3<T>, forces: T) {
        let half = share * T::splat(0.5);
        for (q, row) in self.turns.iter_mut().zip(rows) {
            let by = Quat { v: row.theta * half, w: T::splat(1.0) };
            *q = (*q * by).normalized();
        }
        self.force += force * forces;
    }
}
