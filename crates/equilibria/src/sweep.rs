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

use solver::kernel::lane::Real;
use solver::kernel::math::{Quat, Vec3};

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

/// A joint's energy, its gradient and its Hessian by the turns of its two sides.
pub(crate) struct Bend<T> {
    pub(crate) relative: Quat<T>,
    energy: T,
    pub(crate) gradient: [Vec3<T>; 2],
    /// Symmetric: 11, 22, 33, 12, 13, 23.
    own: [[T; 6]; 2],
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
struct Factor<T> {
    lower: [T; 3],
    inverse: [T; 3],
    negative: T,
}

impl<T: Real> Factor<T> {
    #[inline(always)]
    fn new([a11, a22, a33, a12, a13, a23]: [T; 6]) -> Self {
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
    fn solve(&self, [y1, y2, y3]: [T; 3]) -> [T; 3] {
        let [l21, l31, l32] = self.lower;
        let y2 = y2 - l21 * y1;
        let y3 = (y3 - l31 * y1 - l32 * y2) * self.inverse[2];
        let y2 = y2 * self.inverse[1] - l32 * y3;
        [y1 * self.inverse[0] - l21 * y2 - l31 * y3, y2, y3]
    }
}

#[inline(always)]
fn column<T: Copy>(m: &[[T; 3]; 3], c: usize) -> [T; 3] {
    [m[0][c], m[1][c], m[2][c]]
}

/// Column c of a matrix times a vector.
#[inline(always)]
fn onto<T: Real>(m: &[[T; 3]; 3], c: usize, v: [T; 3]) -> T {
    m[0][c] * v[0] + m[1][c] * v[1] + m[2][c] * v[2]
}

/// Scalar product.
#[inline(always)]
fn three<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
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
            energy = energy - t[2];
            let mut gradient = from_before + after.gradient[0];
            gradient.0[0] += t[1];
            gradient.0[1] = gradient.0[1] - t[0];
            let gradient = moment(i, gradient);
            let stiffer = shift * length;
            let mut d = block;
            for k in 0..6 {
                d[k] += before[k] + after.own[0][k];
            }
            d[0] += t[2] + stiffer;
            d[1] += t[2] + stiffer;
            d[2] += stiffer;
            d[4] = d[4] - half * t[0];
            d[5] = d[5] - half * t[1];
            let factor = Factor::new(d);
            wrong += factor.negative;
            for c in 0..3 {
                border[0][c] += d2.0[c];
                border[1][c] = border[1][c] - d1.0[c];
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
                schur[k] = schur[k] - onto(&border, r, column(&row.border, c));
            }
            for r in 0..3 {
                rest.0[r] = rest.0[r] - onto(&border, r, row.right.0);
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
        // The border: what the chord misses, and the compliance of the joints; a known force does not change.
        let mut gap = self.chord - reached - self.force * self.compliance;
        gap.0[2] = gap.0[2] - self.sag;
        let gap = miss(gap) * self.held;
        for k in 0..6 {
            let own = if k < 3 { self.held * self.compliance + one - self.held } else { zero };
            schur[k] = schur[k] * self.held - own;
        }
        let factor = Factor::new(schur);
        let force = -Vec3(factor.solve((gap + rest * self.held).0));
        wrong += factor.negative - T::splat(3.0);
        // Back.
        let mut following = Vec3::<T>::zero();
        let (mut turn, mut relatively, mut slope) = (zero, zero, gap.dot(force));
        let last = (self.turns[count - 1].conj() * self.ends[1]).upper();
        let mut relative = last;
        for i in (0..count).rev() {
            let row = &mut rows[i];
            let mut theta = -row.right;
            for r in 0..3 {
                theta.0[r] = theta.0[r] - Vec3(row.border[r]).dot(force);
                if i + 1 < count {
                    theta.0[r] = theta.0[r] - Vec3(row.next[r]).dot(following);
                }
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
        energy += self.force.dot(self.chord) * self.held + half * slope;
        Found { energy, wrong, force, turn: turn.sqrt(), bend: relatively.sqrt() }
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
            gradient.0[1] = gradient.0[1] - t.0[0];
            most = largest(most, gradient);
            bend = after;
        }
        energy += bend.energy;
        let mut gap = self.chord - reached - self.force * self.compliance;
        gap.0[2] = gap.0[2] - self.sag;
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
