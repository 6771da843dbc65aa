//! What the elimination of a node reads off the system.

use crate::block::{InverseMass, Left, NodeTerms, at_connector, on_body};
use crate::system::{JointTerms, System};
use crate::topology::Node;
use kernels::Spatial;
use kernels::lane::{Both, Real};
use kernels::math::{Quat, Sym3, Vec3};

/// A joint as its elimination sees it, gathered from the system; with `BEYOND` where joints have anything beyond those of round
/// rods ([`System::has_beyond`]).
pub(super) struct View<'a, T, const BEYOND: bool> {
    pub(super) joint: &'a JointTerms<T>,
    /// Frame of the bend-twist rows.
    frame: Quat<T>,
    bend_extra: T,
    couplings: Option<Vec3<T>>,
    /// What [`System::second_shear`] says.
    second_shear: Option<(Vec3<T>, T)>,
    axis_a: Vec3<T>,
    /// +1 where the inner body is the joint's body a, -1 where it is b.
    sign: T,
    /// Arms of the outer and the inner connector.
    pub(super) arms: [Vec3<T>; 2],
    /// 1 / m and W of the inner body.
    inner: (T, Sym3<T>),
}

impl<'a, T: Real, const BEYOND: bool> View<'a, T, BEYOND> {
    #[inline(always)]
    pub(super) fn new(system: &'a System<T>, node: &Node) -> Self {
        let joint = &system.joints[node.joint as usize];
        let (outer, inner) = (&system.bodies[node.outer as usize], &system.bodies[node.inner as usize]);
        let [za, zb] = joint.offsets;
        let inner_is_a = system.topology.joints[node.joint as usize][0] == node.inner;
        let (a, sign, z_outer, z_inner) = if inner_is_a { (inner, 1.0, zb, za) } else { (outer, -1.0, za, zb) };
        let mut view = View {
            joint,
            frame: a.orientation,
            bend_extra: T::zero(),
            couplings: None,
            second_shear: None,
            axis_a: a.axis,
            sign: T::splat(sign),
            arms: [outer.axis * z_outer, inner.axis * z_inner],
            inner: (inner.inverse_mass, inner.inverse_inertia),
        };
        if BEYOND {
            view.go_beyond(system, node.joint as usize, inner_is_a);
        }
        view
    }

    /// Takes in what the joint has beyond those of rods.
    #[inline(always)]
    fn go_beyond(&mut self, system: &System<T>, joint: usize, inner_is_a: bool) {
        if let Some([at_a, at_b]) = system.across.get(joint) {
            let [at_outer, at_inner] = if inner_is_a { [at_b, at_a] } else { [at_a, at_b] };
            self.arms = [self.arms[0] + *at_outer, self.arms[1] + *at_inner];
        }
        self.frame = system.frames.get(joint).copied().unwrap_or(self.frame);
        self.bend_extra = system.bend_extra.get(joint).copied().unwrap_or(T::zero());
        self.couplings = system.bend_couplings.get(joint).copied();
        self.second_shear = system.second_shear(joint);
    }

    /// Two side by side; `joint` is made of their joints.
    #[inline(always)]
    pub(super) fn both<'b>(a: &Self, b: &Self, joint: &'b JointTerms<Both<T>>) -> View<'b, Both<T>, BEYOND> {
        let (qa, qb) = (a.frame, b.frame);
        View {
            joint,
            frame: Quat { v: Vec3::both(qa.v, qb.v), w: Both([qa.w, qb.w]) },
            bend_extra: Both([a.bend_extra, b.bend_extra]),
            couplings: a.couplings.zip(b.couplings).map(|(a, b)| Vec3::both(a, b)),
            second_shear: a.second_shear.zip(b.second_shear).map(|(a, b)| (Vec3::both(a.0, b.0), Both([a.1, b.1]))),
            axis_a: Vec3::both(a.axis_a, b.axis_a),
            sign: Both([a.sign, b.sign]),
            arms: [Vec3::both(a.arms[0], b.arms[0]), Vec3::both(a.arms[1], b.arms[1])],
            inner: (Both([a.inner.0, b.inner.0]), Sym3(Both::zip(a.inner.1.0, b.inner.1.0))),
        }
    }

    #[inline(always)]
    pub(super) fn terms(&self) -> NodeTerms<T> {
        let mut bend = if BEYOND {
            self.joint.bend_compliance(self.frame.axis()) + self.joint.second_bending(self.frame, self.bend_extra)
        } else {
            self.joint.bend_compliance(self.axis_a)
        };
        if let Some(couplings) = self.couplings {
            bend += self.joint.couplings(self.frame, couplings);
        }
        let mut stretch = self.joint.stretch_compliance(self.axis_a);
        if let Some((d2, extra)) = self.second_shear {
            stretch += Sym3::outer(d2, extra);
        }
        NodeTerms {
            compliance: [stretch, bend],
            rhs: Spatial::zero().plus(self.joint.to_world(self.joint.rhs, self.frame), self.sign),
            arms: self.arms,
        }
    }

    /// The inner body before any of its joints is eliminated.
    #[inline(always)]
    pub(super) fn fresh(&self) -> Left<T> {
        Left { inverse_mass: InverseMass::free(self.inner.0, self.inner.1), correction: Spatial::zero() }
    }

    /// `J M^-1 impulse` of the inner body.
    #[inline(always)]
    pub(super) fn change(&self, impulse: Spatial<T>) -> Spatial<T> {
        let correction =
            Spatial { linear: impulse.linear * self.inner.0, angular: self.inner.1.apply(impulse.angular) };
        at_connector(self.arms[1], correction)
    }

    /// The joint's impulses on its outer and its inner body.
    #[inline(always)]
    pub(super) fn impulses(&self, x: Spatial<T>) -> [Spatial<T>; 2] {
        let outer = on_body(self.arms[0], x);
        [Spatial { linear: -outer.linear, angular: -outer.angular }, on_body(self.arms[1], x)]
    }

    /// The joint's multipliers.
    #[inline(always)]
    pub(super) fn multipliers(&self, x: Spatial<T>) -> Spatial<T> {
        self.joint.multipliers_from_world(Spatial::zero().plus(x, self.sign), self.frame)
    }
}
