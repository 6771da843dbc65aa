//! What an elimination is to solve, node by node.

use super::condensation::Root;
use super::node::{Left, Terms};
use super::stiffness::Stiffness;
use super::{Equations, JointEquation};
use crate::topology::{Node, Topology};
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Sym3;

/// Where a joint holds a body to one that is held, what its rows yield at least, as a share of what the body's mass does, or
/// what the joint does where it bends, if that is less. A Newton step is wrong by that share there, and as many digits are
/// left of what is added to the stiffness.
const LEAST_YIELD: f64 = 1e-8;

/// A joint that yields so many times as much as the stiffest one is held by springs, or turns freely.
const SPRINGS: f64 = 1e3;

/// What is to be solved.
pub(super) struct Problem<'a, T> {
    /// Who is joined to whom, with the far body as one that is held.
    pub(super) topology: &'a Topology,
    /// The body that comes last, to which all may be coupled.
    pub(super) far: Option<usize>,
    pub(super) equations: &'a Equations<T>,
}

impl<T: Real> Problem<'_, T> {
    #[inline(always)]
    pub(super) fn nodes(&self) -> &[Node] {
        self.topology.elimination.as_deref().unwrap_or(&[])
    }

    #[inline(always)]
    pub(super) fn is_held(&self, body: u32) -> bool {
        self.equations.bodies[body as usize].is_held()
    }

    /// Whether a body's movement is not that of its node.
    #[inline(always)]
    pub(super) fn is_apart(&self, body: u32) -> bool {
        self.is_held(body) || self.far == Some(body as usize)
    }

    /// Force and torque on a body.
    #[inline(always)]
    pub(super) fn force(&self, body: u32) -> Spatial<T> {
        self.equations.bodies[body as usize].defect
    }

    /// A body before any of its joints is eliminated.
    #[inline(always)]
    pub(super) fn fresh<const M: usize>(&self, body: u32) -> Left<T, M> {
        let own = &self.equations.bodies[body as usize];
        let mass = if own.is_held() { T::splat(1.0) } else { own.mass };
        let mut stiffness = Stiffness::of_parts(Sym3::identity(mass), own.turning);
        if !self.equations.rows.is_empty() {
            self.add_rows(body, &mut stiffness);
        }
        Left::new(stiffness, own.defect)
    }

    #[cold]
    fn add_rows(&self, body: u32, stiffness: &mut Stiffness<T>) {
        let rows = &self.equations.rows;
        let own = rows[rows.partition_point(|row| row.body < body)..].iter().take_while(|row| row.body == body);
        own.for_each(|row| stiffness.subtract(row.row, -row.stiffness));
    }

    #[inline(always)]
    pub(super) fn joint(&self, node: &Node) -> &JointEquation<T> {
        &self.equations.joints[node.joint as usize]
    }

    #[inline(always)]
    pub(super) fn terms(&self, node: &Node) -> Terms<T> {
        let JointEquation { arms: [a, b], compliance, coupling, rhs, .. } = *self.joint(node);
        let outer_is_a = self.topology.joints[node.joint as usize][0] == node.outer;
        let (sigma, arms, coupling) =
            if outer_is_a { (1.0, [a, b], coupling) } else { (-1.0, [b, a], coupling.transposed()) };
        let bend = match self.equations.roots.get(node.joint as usize) {
            None => Root::new(compliance[1]),
            Some(&root) => root,
        };
        Terms { sigma: T::splat(sigma), arms, compliance, bend, coupling, rhs }
    }

    /// `alpha~^-1` of a joint at whose outer end stands a body that is held, or comes last, and a number that is not negative
    /// where there is one.
    pub(super) fn hold(&self, node: &Node, terms: &Terms<T>) -> ([Sym3<T>; 2], T) {
        let one = T::splat(1.0);
        let free = [node.inner, node.outer].into_iter().find(|&body| !self.is_held(body));
        // Nothing yields where both are held.
        let of_mass = free.map_or(T::zero(), |body| one / self.equations.bodies[body as usize].mass);
        let squared = self.joint(node).length * self.joint(node).length;
        let Sym3([xx, yy, zz, ..]) = terms.compliance[1];
        // Rows that springs hold, or nothing, do not count.
        let limit = self.equations.stiffest * T::splat(SPRINGS);
        let bending = xx.max(yy).max(zz) * squared;
        let bending = (limit - bending).select(bending, limit);
        let least = -(-bending).max(-of_mass);
        let yielding = (-bending).select(of_mass, least) * T::splat(LEAST_YIELD);
        let (stretch, first) = Root::new(terms.compliance[0]).inverse(yielding);
        let (bend, second) = terms.bend.inverse(yielding / squared);
        ([stretch, bend], first.select(second, first))
    }
}
