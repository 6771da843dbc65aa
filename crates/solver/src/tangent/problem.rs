//! What an elimination is to solve, in the kernels' types.

use nalgebra::{Matrix3, Vector3, Vector6};

use super::node::{Left, Terms};
use super::series::Root;
use super::stiffness::Stiffness;
use super::{Equations, JointEquation};
use crate::kernel::Spatial;
use crate::kernel::math::{Sym3, Vec3};
use crate::topology::{Node, Topology};

/// Where a joint holds a body to one that is held, what its rows yield at least, as a share of what the body's mass does, or
/// what the joint does where it bends, if that is less. A Newton step is wrong by that share there, and as many digits are
/// left of what is added to the stiffness.
const LEAST_YIELD: f64 = 1e-8;

/// What is to be solved.
pub(super) struct Problem<'a> {
    /// Who is joined to whom, with the far body as one that is held.
    pub(super) topology: &'a Topology,
    /// The body that comes last, to which all may be coupled.
    pub(super) far: Option<usize>,
    pub(super) equations: &'a Equations,
}

#[inline(always)]
fn vector(x: &Vector3<f64>) -> Vec3<f64> {
    Vec3([x.x, x.y, x.z])
}

#[inline(always)]
fn symmetric(m: &Matrix3<f64>) -> Sym3<f64> {
    Sym3([m.m11, m.m22, m.m33, m.m12, m.m13, m.m23])
}

#[inline(always)]
fn spatial([linear, angular]: &[Vector3<f64>; 2]) -> Spatial<f64> {
    Spatial { linear: vector(linear), angular: vector(angular) }
}

#[inline(always)]
pub(super) fn six(x: Spatial<f64>) -> Vector6<f64> {
    Vector6::from(x.to_array())
}

impl Problem<'_> {
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
    pub(super) fn force(&self, body: u32) -> Spatial<f64> {
        spatial(&self.equations.bodies[body as usize].defect)
    }

    /// A body before any of its joints is eliminated.
    #[inline(always)]
    pub(super) fn fresh<const M: usize>(&self, body: u32) -> Left<f64, M> {
        let own = &self.equations.bodies[body as usize];
        let mass = if own.is_held() { 1.0 } else { own.mass };
        let mut stiffness = Stiffness::of_parts(Sym3::identity(mass), symmetric(&own.turning));
        if !self.equations.rows.is_empty() {
            self.add_rows(body, &mut stiffness);
        }
        Left::new(stiffness, spatial(&own.defect))
    }

    #[cold]
    fn add_rows(&self, body: u32, stiffness: &mut Stiffness<f64>) {
        let rows = &self.equations.rows;
        let own = rows[rows.partition_point(|row| row.body < body)..].iter().take_while(|row| row.body == body);
        own.for_each(|row| stiffness.subtract(row.row, -row.stiffness));
    }

    #[inline(always)]
    pub(super) fn joint(&self, node: &Node) -> &JointEquation {
        &self.equations.joints[node.joint as usize]
    }

    #[inline(always)]
    pub(super) fn terms(&self, node: &Node) -> Terms<f64> {
        let joint = self.joint(node);
        let outer_is_a = self.topology.joints[node.joint as usize][0] == node.outer;
        let m = &joint.coupling;
        let rows = [[m.m11, m.m12, m.m13], [m.m21, m.m22, m.m23], [m.m31, m.m32, m.m33]];
        let columns = [[m.m11, m.m21, m.m31], [m.m12, m.m22, m.m32], [m.m13, m.m23, m.m33]];
        let [a, b] = [vector(&joint.arms[0]), vector(&joint.arms[1])];
        let (sigma, arms, coupling) = if outer_is_a { (1.0, [a, b], rows) } else { (-1.0, [b, a], columns) };
        let compliance = [symmetric(&joint.compliance[0]), symmetric(&joint.compliance[1])];
        Terms { sigma, arms, compliance, coupling, rhs: spatial(&joint.rhs) }
    }

    /// `alpha~^-1` of a joint at whose outer end stands a body that is held, or comes last.
    pub(super) fn hold(&self, node: &Node, terms: &Terms<f64>) -> Option<[Sym3<f64>; 2]> {
        let bodies = &self.equations.bodies;
        let masses = [node.inner, node.outer].map(|body| bodies[body as usize].mass);
        let mass = masses.into_iter().find(|mass| mass.is_finite()).unwrap_or(f64::INFINITY);
        let squared = self.joint(node).length * self.joint(node).length;
        let Sym3([xx, yy, zz, ..]) = terms.compliance[1];
        let bending = xx.max(yy).max(zz) * squared;
        let yielding = if bending > 0.0 { bending.min(1.0 / mass) } else { 1.0 / mass };
        let least = [LEAST_YIELD * yielding, LEAST_YIELD * yielding / squared];
        let [stretch, bend] = [0, 1].map(|part| Root::new(terms.compliance[part]).inverse(least[part]));
        Some([stretch?, bend?])
    }
}
