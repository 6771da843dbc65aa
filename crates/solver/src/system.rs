//! The linear system of one outer iteration, A dlambda = b, in the form that every linear solver reads.
//!
//! `A = J M^-1 J^T + alpha~` is symmetric and positive definite (Kugelstadt et al. 2018); J has six rows a joint, three
//! of stretch-shear and three of bend-twist, and M is the mass matrix of the chosen formulation. It is kept as the parts
//! it is made of. With d the axis of a body, z the place of the connector on it and sigma = +1 for a joint's body a, -1
//! for its body b, a joint's Jacobian with respect to (dx, dphi) of that body is
//!
//! ```text
//! J = sigma [ I  -z [d]x ]      G = (1/l) (s I - [u]x) R_a^T,   (s, u) = conj(q_a) q_b
//!           [ 0  -G      ]
//! ```
//!
//! G never has to be multiplied out: its inverse is l (s I + [t]x + t t^T / s) R_a with t = R_a u, and in the rows
//! scaled by it (bend-twist as a world rotation, its multiplier as a world torque) G becomes the identity. The direct
//! solver works on those rows ("world rows"); [`JointTerms::to_world`] and [`JointTerms::from_world`] change over.

use std::sync::Arc;

use crate::kernel::lane::{Both, Real};
use crate::kernel::math::{Quat, Sym3, Vec3};
use crate::topology::Topology;

/// Six numbers of a joint: stretch-shear (world axes), then bend-twist (frame of body a, or world axes in world rows).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Six<T> {
    /// Stretch-shear part.
    pub stretch: Vec3<T>,
    /// Bend-twist part.
    pub bend: Vec3<T>,
}

impl<T: Real> Six<T> {
    /// Zero.
    #[inline(always)]
    pub fn zero() -> Self {
        Self { stretch: Vec3::zero(), bend: Vec3::zero() }
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> T {
        self.stretch.dot(other.stretch) + self.bend.dot(other.bend)
    }

    /// `self + k other`.
    #[inline(always)]
    pub fn plus(self, other: Self, k: T) -> Self {
        Self { stretch: self.stretch + other.stretch * k, bend: self.bend + other.bend * k }
    }

    /// Two side by side.
    #[inline(always)]
    pub fn both(a: Self, b: Self) -> Six<Both<T>> {
        Six { stretch: Vec3::both(a.stretch, b.stretch), bend: Vec3::both(a.bend, b.bend) }
    }

    /// All six, stretch-shear first.
    #[inline(always)]
    pub fn to_array(self) -> [T; 6] {
        let ([a, b, c], [d, e, f]) = (self.stretch.0, self.bend.0);
        [a, b, c, d, e, f]
    }

    /// From all six, stretch-shear first.
    #[inline(always)]
    pub fn from_array([a, b, c, d, e, f]: [T; 6]) -> Self {
        Self { stretch: Vec3([a, b, c]), bend: Vec3([d, e, f]) }
    }
}

impl<T: Real> Six<Both<T>> {
    /// One of the two.
    #[inline(always)]
    pub fn one(self, k: usize) -> Six<T> {
        Six { stretch: self.stretch.one(k), bend: self.bend.one(k) }
    }
}

/// What the system holds of a body.
#[derive(Clone, Copy, Debug)]
pub struct BodyTerms<T> {
    /// 1 / m [1/kg]; zero where fixed.
    pub inverse_mass: T,
    /// Orientation.
    pub orientation: Quat<T>,
    /// Axis d3.
    pub axis: Vec3<T>,
    /// W, the inverse of the rotational mass matrix in world axes [1/(kg m^2)]; zero where fixed.
    pub inverse_inertia: Sym3<T>,
}

/// What the system holds of a joint.
#[derive(Clone, Copy, Debug)]
pub struct JointTerms<T> {
    /// Connectors' places z on the axes of bodies a and b [m].
    pub offsets: [T; 2],
    /// Length l [m].
    pub length: T,
    /// Shear compliance over dt^2 [1/kg].
    pub shear: T,
    /// Stretch minus shear compliance, over dt^2 [1/kg].
    pub stretch_extra: T,
    /// Bend compliance over dt^2 [1/(kg m^4)].
    pub bend: T,
    /// Twist minus bend compliance, over dt^2 [1/(kg m^4)].
    pub twist_extra: T,
    /// Scalar part of conj(q_a) q_b, never negative.
    pub s: T,
    /// Vector part of q_b conj(q_a): the relative rotation in world axes.
    pub t: Vec3<T>,
    /// Right-hand side b: stretch-shear [m], bend-twist [1/m].
    pub rhs: Six<T>,
}

impl<T: Real> JointTerms<T> {
    /// Two side by side.
    #[inline(always)]
    pub fn both(a: &Self, b: &Self) -> JointTerms<Both<T>> {
        let numbers = |x: &Self| [x.length, x.shear, x.stretch_extra, x.bend, x.twist_extra, x.s];
        let [length, shear, stretch_extra, bend, twist_extra, s] = Both::zip(numbers(a), numbers(b));
        JointTerms {
            offsets: Both::zip(a.offsets, b.offsets),
            length,
            shear,
            stretch_extra,
            bend,
            twist_extra,
            s,
            t: Vec3::both(a.t, b.t),
            rhs: Six::both(a.rhs, b.rhs),
        }
    }

    /// alpha~ of stretch-shear in world axes, for body a's axis.
    #[inline(always)]
    pub fn stretch_compliance(&self, axis_a: Vec3<T>) -> Sym3<T> {
        Sym3::identity(self.shear) + Sym3::outer(axis_a, self.stretch_extra)
    }

    /// alpha~ of bend-twist in world rows: `G^-1 alpha~ G^-T = l^2 N (alpha~_b I + (alpha~_t - alpha~_b) d d^T) N^T`
    /// with `N = s I + [t]x + t t^T / s`, for which `N N^T = I + t t^T / s^2`.
    #[inline(always)]
    pub fn bend_compliance(&self, axis_a: Vec3<T>) -> Sym3<T> {
        let l2 = self.length * self.length;
        let inv_s = T::splat(1.0) / self.s;
        let bend = self.bend * l2;
        let n = self.n(axis_a, inv_s);
        Sym3::identity(bend) + Sym3::outer(self.t, bend * inv_s * inv_s) + Sym3::outer(n, self.twist_extra * l2)
    }

    /// `N x`.
    #[inline(always)]
    fn n(&self, x: Vec3<T>, inv_s: T) -> Vec3<T> {
        x * self.s + self.t.cross(x) + self.t * (self.t.dot(x) * inv_s)
    }

    /// Rows to world rows: `(r_s, G^-1 r_b)`.
    #[inline(always)]
    pub fn to_world(&self, r: Six<T>, q_a: Quat<T>) -> Six<T> {
        let bend = self.n(q_a.rotate(r.bend), T::splat(1.0) / self.s) * self.length;
        Six { stretch: r.stretch, bend }
    }

    /// World rows to rows: `(r_s, G r_b)`.
    #[inline(always)]
    pub fn from_world(&self, r: Six<T>, q_a: Quat<T>) -> Six<T> {
        // G = (1/l) R_a^T (s I - [t]x).
        let turned = r.bend * self.s - self.t.cross(r.bend);
        let bend = q_a.rotate_back(turned) * (T::splat(1.0) / self.length);
        Six { stretch: r.stretch, bend }
    }

    /// Multipliers from those of the world rows: `(lambda_s, G^-T lambda_b)`.
    #[inline(always)]
    pub fn multipliers_from_world(&self, x: Six<T>, q_a: Quat<T>) -> Six<T> {
        let inv_s = T::splat(1.0) / self.s;
        let n_transposed = x.bend * self.s - self.t.cross(x.bend) + self.t * (self.t.dot(x.bend) * inv_s);
        Six { stretch: x.stretch, bend: q_a.rotate_back(n_transposed) * self.length }
    }

    /// Multipliers to those of the world rows: `(lambda_s, G^T lambda_b)`, a force and a torque.
    #[inline(always)]
    pub fn multipliers_to_world(&self, x: Six<T>, q_a: Quat<T>) -> Six<T> {
        // G^T = (1/l) (s I + [t]x) R_a.
        let y = q_a.rotate(x.bend);
        let bend = (y * self.s + self.t.cross(y)) * (T::splat(1.0) / self.length);
        Six { stretch: x.stretch, bend }
    }
}

/// The linear system of one outer iteration over one connected set of bodies.
#[derive(Clone, Debug)]
pub struct System<T> {
    /// Connectivity.
    pub topology: Arc<Topology>,
    /// One entry a body.
    pub bodies: Vec<BodyTerms<T>>,
    /// One entry a joint.
    pub joints: Vec<JointTerms<T>>,
}

impl<T: Real> System<T> {
    /// A system without content, to be filled by the constraints' evaluation.
    pub fn new(topology: Arc<Topology>) -> Self {
        let body = BodyTerms {
            inverse_mass: T::zero(),
            orientation: Quat::identity(),
            axis: Vec3::zero(),
            inverse_inertia: Sym3::zero(),
        };
        let joint = JointTerms {
            offsets: [T::zero(); 2],
            length: T::splat(1.0),
            shear: T::zero(),
            stretch_extra: T::zero(),
            bend: T::zero(),
            twist_extra: T::zero(),
            s: T::splat(1.0),
            t: Vec3::zero(),
            rhs: Six::zero(),
        };
        let (bodies, joints) = (vec![body; topology.bodies()], vec![joint; topology.joints.len()]);
        Self { topology, bodies, joints }
    }

    /// Adds `J^T lambda` (world rows: a force and a torque on each body) of joint `j` to `impulse`, one entry a body.
    #[inline(always)]
    pub fn add_impulse(&self, j: usize, world: Six<T>, impulse: &mut [Six<T>]) {
        let [a, b] = self.topology.joints[j];
        let [za, zb] = self.joints[j].offsets;
        let (f, torque) = (world.stretch, world.bend);
        let on_a = &mut impulse[a as usize];
        on_a.stretch += f;
        on_a.bend += self.bodies[a as usize].axis.cross(f) * za - torque;
        let on_b = &mut impulse[b as usize];
        on_b.stretch -= f;
        on_b.bend -= self.bodies[b as usize].axis.cross(f) * zb - torque;
    }

    /// `M^-1 impulse` of a body: its correction (dx, dphi).
    #[inline(always)]
    pub fn correction(&self, body: usize, impulse: Six<T>) -> Six<T> {
        let terms = &self.bodies[body];
        Six { stretch: impulse.stretch * terms.inverse_mass, bend: terms.inverse_inertia.apply(impulse.bend) }
    }

    /// `J dp` of joint `j` in world rows, for corrections (dx, dphi), one entry a body.
    #[inline(always)]
    pub fn constraint_change(&self, j: usize, corrections: &[Six<T>]) -> Six<T> {
        let [a, b] = self.topology.joints[j];
        let [za, zb] = self.joints[j].offsets;
        let (on_a, on_b) = (corrections[a as usize], corrections[b as usize]);
        // -z [d]x dphi = z dphi x d.
        let at_a = on_a.stretch + on_a.bend.cross(self.bodies[a as usize].axis) * za;
        let at_b = on_b.stretch + on_b.bend.cross(self.bodies[b as usize].axis) * zb;
        Six { stretch: at_a - at_b, bend: on_b.bend - on_a.bend }
    }
}
