//! The linear system of one outer iteration, A dlambda = b, in the form that every linear solver reads.
//!
//! `A = J M^-1 J^T + alpha~` is symmetric and positive definite (Kugelstadt et al. 2018); J has six rows a joint, three
//! of stretch-shear and three of bend-twist, and M is the mass matrix of the chosen formulation. It is kept as the parts
//! it is made of. With d the axis of a body, z the place of the connector on it and sigma = +1 for a joint's body a, -1
//! for its body b, a joint's Jacobian with respect to (dx, dphi) of that body is
//!
//! ```text
//! J = sigma [ I  -z [d]x ]      G = (1/l) R_a^T F,   F of [`RotationRows`]
//!           [ 0  -G      ]
//! ```
//!
//! Where joints have rest frames f_a and f_b, `q_a f_a` and `q_b f_b` take the places of q_a and q_b ([`System::frame`]).
//!
//! G never has to be multiplied out: its inverse is l N R_a, and in the rows
//! scaled by it (bend-twist as a world rotation, its multiplier as a world torque) G becomes the identity. The direct
//! solver works on those rows ("world rows"); [`JointTerms::to_world`] and [`JointTerms::from_world`] change over.

use std::sync::Arc;

use crate::rotation::RotationRows;
use crate::topology::Topology;
use kernels::Spatial;
use kernels::lane::{Both, Real};
use kernels::math::{Quat, Sym3, Vec3};

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
    /// How the bend-twist rows measure conj(q_a) q_b.
    pub rows: RotationRows<T>,
    /// Vector part of q_b conj(q_a): the relative rotation in world axes.
    pub t: Vec3<T>,
    /// Right-hand side b: stretch-shear [m], bend-twist [1/m].
    pub rhs: Spatial<T>,
}

impl<T: Real> JointTerms<T> {
    /// Two side by side.
    #[inline(always)]
    pub(crate) fn both(a: &Self, b: &Self) -> JointTerms<Both<T>> {
        let numbers = |x: &Self| [x.length, x.shear, x.stretch_extra, x.bend, x.twist_extra];
        let [length, shear, stretch_extra, bend, twist_extra] = Both::zip(numbers(a), numbers(b));
        JointTerms {
            offsets: Both::zip(a.offsets, b.offsets),
            length,
            shear,
            stretch_extra,
            bend,
            twist_extra,
            rows: RotationRows::both(&a.rows, &b.rows),
            t: Vec3::both(a.t, b.t),
            rhs: Spatial::both(a.rhs, b.rhs),
        }
    }

    /// alpha~ of stretch-shear in world axes, for body a's axis and a joint that yields alike along d1 and d2.
    #[inline(always)]
    pub(crate) fn stretch_compliance(&self, axis_a: Vec3<T>) -> Sym3<T> {
        Sym3::identity(self.shear) + Sym3::outer(axis_a, self.stretch_extra)
    }

    /// alpha~ of bend-twist in world rows, for the axis of the rows' frame and a section that bends alike about d1 and d2:
    /// `G^-1 alpha~ G^-T = l^2 N (alpha~_b I + (alpha~_t - alpha~_b) d d^T) N^T`, with N of [`RotationRows`].
    #[inline(always)]
    pub(crate) fn bend_compliance(&self, axis_a: Vec3<T>) -> Sym3<T> {
        let l2 = self.length * self.length;
        let bend = self.bend * l2;
        let n = self.rows.inverse(self.t, axis_a);
        let [of_identity, of_t] = self.rows.squared();
        Sym3::identity(bend * of_identity) + Sym3::outer(self.t, bend * of_t) + Sym3::outer(n, self.twist_extra * l2)
    }

    /// What a bending compliance about d2 of the rows' frame, which is larger by `extra`, adds to that in world rows:
    /// `extra l^2 N d2 (N d2)^T`.
    #[inline(always)]
    pub(crate) fn second_bending(&self, frame: Quat<T>, extra: T) -> Sym3<T> {
        Sym3::outer(self.rows.inverse(self.t, frame.second_axis()), extra * self.length * self.length)
    }

    /// What couplings of a compliance between d1, d2 and d3 of the rows' frame, (12), (13) and (23), add to that in world rows:
    /// `l^2 N (d_i d_j^T + d_j d_i^T) N^T` of each.
    #[inline(always)]
    pub(crate) fn couplings(&self, frame: Quat<T>, Vec3([of_12, of_13, of_23]): Vec3<T>) -> Sym3<T> {
        let (zero, one) = (T::zero(), T::splat(1.0));
        let axes = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
        let [d1, d2, d3] = axes.map(|axis| self.rows.inverse(self.t, frame.rotate(Vec3(axis))));
        let twice = T::splat(2.0) * self.length * self.length;
        Sym3::sym_outer(d1 * (of_12 * twice), d2)
            + Sym3::sym_outer(d1 * (of_13 * twice), d3)
            + Sym3::sym_outer(d2 * (of_23 * twice), d3)
    }

    /// Rows to world rows: `(r_s, G^-1 r_b)`.
    #[inline(always)]
    pub fn to_world(&self, r: Spatial<T>, q_a: Quat<T>) -> Spatial<T> {
        let angular = self.rows.inverse(self.t, q_a.rotate(r.angular)) * self.length;
        Spatial { linear: r.linear, angular }
    }

    /// World rows to rows: `(r_s, G r_b)`.
    #[inline(always)]
    pub fn from_world(&self, r: Spatial<T>, q_a: Quat<T>) -> Spatial<T> {
        let turned = self.rows.forward(self.t, r.angular);
        let angular = q_a.rotate_back(turned) * (T::splat(1.0) / self.length);
        Spatial { linear: r.linear, angular }
    }

    /// Multipliers from those of the world rows: `(lambda_s, G^-T lambda_b)`.
    #[inline(always)]
    pub fn multipliers_from_world(&self, x: Spatial<T>, q_a: Quat<T>) -> Spatial<T> {
        let turned = self.rows.inverse_transposed(self.t, x.angular);
        Spatial { linear: x.linear, angular: q_a.rotate_back(turned) * self.length }
    }

    /// Multipliers to those of the world rows: `(lambda_s, G^T lambda_b)`, a force and a torque.
    #[inline(always)]
    pub fn multipliers_to_world(&self, x: Spatial<T>, q_a: Quat<T>) -> Spatial<T> {
        let turned = self.rows.forward_transposed(self.t, q_a.rotate(x.angular));
        let angular = turned * (T::splat(1.0) / self.length);
        Spatial { linear: x.linear, angular }
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
    /// Arms of the connectors of bodies a and b across the axes, in world axes [m], one entry a joint; empty where all lie on
    /// the axes, as those of rods do. What follows has `z d` for the arm; with these it is `z d` and they.
    pub across: Vec<[Vec3<T>; 2]>,
    /// Compliance of bending about d2 less that about d1, over dt^2 [1/(kg m^4)], one a joint; empty where all sections bend
    /// alike about both.
    pub bend_extra: Vec<T>,
    /// Entries (12), (13) and (23) of the bend-twist compliance in its rows' frame, over dt^2 [1/(kg m^4)], one a joint; empty where all
    /// joints are elastic.
    pub bend_couplings: Vec<Vec3<T>>,
    /// Compliance along d2 of bodies a less that along their d1, over dt^2 [1/kg], one a joint; empty where all joints yield
    /// alike along both.
    pub shear_extra: Vec<T>,
    /// Frames of the bend-twist rows, one a joint; empty where they are those of bodies a.
    pub frames: Vec<Quat<T>>,
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
            rows: RotationRows::identity(),
            t: Vec3::zero(),
            rhs: Spatial::zero(),
        };
        let (bodies, joints) = (vec![body; topology.bodies()], vec![joint; topology.joints.len()]);
        let (across, bend_extra, shear_extra, frames) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { topology, bodies, joints, across, bend_extra, bend_couplings: Vec::new(), shear_extra, frames }
    }

    /// Whether joints have anything beyond those of round rods that are joined on their axes and measured from each other.
    #[inline(always)]
    pub(crate) fn has_beyond(&self) -> bool {
        let lists = self.across.len() | self.bend_extra.len() | self.shear_extra.len() | self.frames.len();
        lists | self.bend_couplings.len() != 0
    }

    /// Frame of a joint's bend-twist rows.
    #[inline(always)]
    pub fn frame(&self, j: usize) -> Quat<T> {
        match self.frames.get(j) {
            None => self.bodies[self.topology.joints[j][0] as usize].orientation,
            Some(&frame) => frame,
        }
    }

    /// What the compliance of a joint has along d2 of body a beyond that along d1: d2, and by how much it is larger; `None`
    /// where no joint has it.
    #[inline(always)]
    pub fn second_shear(&self, j: usize) -> Option<(Vec3<T>, T)> {
        let &extra = self.shear_extra.get(j)?;
        Some((self.bodies[self.topology.joints[j][0] as usize].orientation.second_axis(), extra))
    }

    /// `JointTerms::stretch_compliance` of a joint, with what it has along d2.
    #[inline(always)]
    pub fn stretch_compliance(&self, j: usize) -> Sym3<T> {
        let alike = self.joints[j].stretch_compliance(self.bodies[self.topology.joints[j][0] as usize].axis);
        match self.second_shear(j) {
            None => alike,
            Some((d2, extra)) => alike + Sym3::outer(d2, extra),
        }
    }

    /// alpha~ of a joint's bend-twist rows: about d1, d2 and d3 of their frame, without [`System::bend_couplings`].
    #[inline(always)]
    pub fn bend_twist_compliance(&self, j: usize) -> Vec3<T> {
        let terms = &self.joints[j];
        let second = self.bend_extra.get(j).map_or(terms.bend, |&extra| terms.bend + extra);
        Vec3([terms.bend, second, terms.bend + terms.twist_extra])
    }

    /// `JointTerms::bend_compliance` of a joint, with all that its section and its rest frames add.
    #[inline(always)]
    pub fn bend_compliance(&self, j: usize) -> Sym3<T> {
        let terms = &self.joints[j];
        let axis = match self.frames.get(j) {
            None => self.bodies[self.topology.joints[j][0] as usize].axis,
            Some(frame) => frame.axis(),
        };
        let alike = terms.bend_compliance(axis);
        let plain = match self.bend_extra.get(j) {
            None => alike,
            Some(&extra) => alike + terms.second_bending(self.frame(j), extra),
        };
        match self.bend_couplings.get(j) {
            None => plain,
            Some(&couplings) => plain + terms.couplings(self.frame(j), couplings),
        }
    }

    /// Adds `J^T lambda` (world rows: a force and a torque on each body) of joint `j` to `impulse`, one entry a body.
    #[inline(always)]
    pub fn add_impulse(&self, j: usize, world: Spatial<T>, impulse: &mut [Spatial<T>]) {
        let [a, b] = self.topology.joints[j];
        let [za, zb] = self.joints[j].offsets;
        let (f, torque) = (world.linear, world.angular);
        let on_a = &mut impulse[a as usize];
        on_a.linear += f;
        on_a.angular += self.bodies[a as usize].axis.cross(f) * za - torque;
        let on_b = &mut impulse[b as usize];
        on_b.linear -= f;
        on_b.angular -= self.bodies[b as usize].axis.cross(f) * zb - torque;
        if let Some([at_a, at_b]) = self.across.get(j) {
            impulse[a as usize].angular += at_a.cross(f);
            impulse[b as usize].angular -= at_b.cross(f);
        }
    }

    /// `M^-1 impulse` of a body: its correction (dx, dphi).
    #[inline(always)]
    pub fn correction(&self, body: usize, impulse: Spatial<T>) -> Spatial<T> {
        let terms = &self.bodies[body];
        Spatial { linear: impulse.linear * terms.inverse_mass, angular: terms.inverse_inertia.apply(impulse.angular) }
    }

    /// What a correction (dx, dphi) of one of its bodies adds to `J dp` of joint `j`, in world rows.
    #[inline(always)]
    pub(crate) fn constraint_change_by(&self, j: usize, body: usize, dp: Spatial<T>) -> Spatial<T> {
        if self.topology.joints[j][0] as usize == body {
            Spatial { linear: self.connector_change(j, 0, dp), angular: -dp.angular }
        } else {
            Spatial { linear: -self.connector_change(j, 1, dp), angular: dp.angular }
        }
    }

    /// By how much a correction (dx, dphi) of body a (`end` 0) or b (1) moves the connector of joint `j` on it.
    #[inline(always)]
    fn connector_change(&self, j: usize, end: usize, dp: Spatial<T>) -> Vec3<T> {
        let body = self.topology.joints[j][end] as usize;
        // -z [d]x dphi = z dphi x d.
        let mut at = dp.linear + dp.angular.cross(self.bodies[body].axis) * self.joints[j].offsets[end];
        if let Some(across) = self.across.get(j) {
            at += dp.angular.cross(across[end]);
        }
        at
    }

    /// `J dp` of joint `j` in world rows, for corrections (dx, dphi), one entry a body.
    #[inline(always)]
    pub fn constraint_change(&self, j: usize, corrections: &[Spatial<T>]) -> Spatial<T> {
        let [a, b] = self.topology.joints[j];
        let (on_a, on_b) = (corrections[a as usize], corrections[b as usize]);
        let linear = self.connector_change(j, 0, on_a) - self.connector_change(j, 1, on_b);
        Spatial { linear, angular: on_b.angular - on_a.angular }
    }
}
