//! The elimination of Newton's equations along chains, trees and rings, O(N).
//!
//! From the leaves to the roots a body is eliminated together with the joint at its inner end: the unknowns z = (dp of the
//! outer body, -dlambda of the joint) of a node have the 12 x 12 block Z, and B couples them to the inner body,
//!
//! ```text
//! Z = [ K_o  J_o^T ]    B = [ K_oi ]    K_i <- K_i - B^T Z^-1 B
//!     [ J_o  -a~   ]        [ J_i  ]
//! ```
//!
//! (the primal-dual relative of the Riccati recursion of optimal control; Rao, Wright and Rawlings 1998). The matrix has the
//! inertias of its Z and of what is left of the roots' bodies together (Haynsworth 1968). At a minimum of the energy each Z
//! has six positive and six negative eigenvalues, because bodies and joints beyond a node are at a minimum with the inner body
//! held. Of a ring one body is left to the end, the far one, to which each node may then be coupled besides its inner body;
//! Z sees it as held. So where a Z has others the body is mended there: it is made heavier, until it has them.

use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector6};

use super::ldl::Ldl;
use super::{BodyEquation, Equations, JointEquation};
use crate::topology::{Leaves, Node, Topology};

type Matrix12 = SMatrix<f64, 12, 12>;
type Vector12 = SVector<f64, 12>;

/// The first share of its own mass by which a body is made heavier where the eigenvalues have wrong signs.
const FIRST_SHIFT: f64 = 0.25;
/// Growth of that share from one trial to the next.
const SHIFT_GROWTH: f64 = 4.0;
/// Most trials at a node. The last makes the body 10^14 times as heavy: beyond that it is no matter of signs.
const TRIALS: usize = 25;

/// What has been eliminated, as what it makes of the bodies that come later: `Z^-1 B` for the inner body, the same for the
/// far one, and `Z^-1` times the right-hand side.
#[derive(Clone, Copy, Debug)]
struct Eliminated<const N: usize> {
    inner: SMatrix<f64, N, 6>,
    far: SMatrix<f64, N, 6>,
    alone: SVector<f64, N>,
}

impl<const N: usize> Eliminated<N> {
    fn zero() -> Self {
        Self { inner: SMatrix::zeros(), far: SMatrix::zeros(), alone: SVector::zeros() }
    }

    fn solution(&self, inner: &Vector6<f64>, far: &Vector6<f64>) -> SVector<f64, N> {
        self.alone - self.inner * inner - self.far * far
    }
}

/// Memory of an elimination, and its result.
#[derive(Clone, Debug)]
pub struct Elimination {
    /// Who is joined to whom, with the far body as one that is held.
    topology: Topology,
    /// The body without which there would be no loop, if there is one: it comes last, and all may be coupled to it.
    far: Option<usize>,
    /// What is left of K, one entry a body.
    matrices: Vec<Matrix6<f64>>,
    /// What couples them to the far body.
    couplings: Vec<Matrix6<f64>>,
    /// What is left of the right-hand side, one entry a body.
    vectors: Vec<Vector6<f64>>,
    /// One entry a node.
    nodes: Vec<Eliminated<12>>,
    /// Bodies that are left alone, in the order of the roots.
    roots: Vec<Eliminated<6>>,
    /// dp as (dx, dphi), one entry a body.
    pub corrections: Vec<Vector6<f64>>,
    /// dlambda in world rows, one entry a joint.
    pub multipliers: Vec<Vector6<f64>>,
    /// Bodies that had to be made heavier.
    pub mended: usize,
}

impl Elimination {
    /// Memory for systems of this connectivity; `None` where one body less would leave loops.
    pub fn new(topology: &Topology) -> Option<Self> {
        let without = |far: usize| {
            let mut fixed = topology.fixed.clone();
            fixed[far] = true;
            Some(Topology::new(topology.joints.clone(), fixed)).filter(|less| less.elimination.is_some())
        };
        let (topology, far) = match topology.elimination {
            Some(_) => (topology.clone(), None),
            None => (0..topology.bodies()).find_map(|far| Some((without(far)?, Some(far))))?,
        };
        let (bodies, joints) = (topology.bodies(), topology.joints.len());
        Some(Self {
            topology,
            far,
            matrices: vec![Matrix6::zeros(); bodies],
            couplings: vec![Matrix6::zeros(); bodies],
            vectors: vec![Vector6::zeros(); bodies],
            nodes: vec![Eliminated::zero(); joints],
            roots: Vec::with_capacity(bodies),
            corrections: vec![Vector6::zeros(); bodies],
            multipliers: vec![Vector6::zeros(); joints],
            mended: 0,
        })
    }

    /// Solves the equations; returns whether it could. It cannot where a joint without compliance stands at the outer end of a
    /// tree on a body that is held, and where numbers are not finite.
    pub fn solve(&mut self, equations: &Equations) -> bool {
        self.mended = 0;
        self.roots.clear();
        self.corrections.fill(Vector6::zeros());
        self.couplings.fill(Matrix6::zeros());
        for ((matrix, vector), body) in self.matrices.iter_mut().zip(&mut self.vectors).zip(&equations.bodies) {
            (*matrix, *vector) = own(body);
        }
        let nodes = self.topology.elimination.as_ref().map_or(0, Vec::len);
        let is_done = (0..nodes).all(|k| self.eliminate(k, equations));
        if !is_done || (nodes == 0 && !self.eliminate_root(0, equations)) {
            return false;
        }
        let far = match self.far {
            None => Vector6::zeros(),
            Some(far) => {
                if !self.eliminate_root(far, equations) {
                    return false;
                }
                self.substitute_root(far, &Vector6::zeros());
                self.corrections[far]
            }
        };
        if nodes == 0 {
            self.substitute_root(0, &far);
        }
        (0..nodes).rev().for_each(|k| self.substitute(k, &far));
        true
    }

    /// Eliminates the outer body and the joint of a node, and of a root what is left.
    fn eliminate(&mut self, k: usize, equations: &Equations) -> bool {
        let Some(node) = self.node(k) else { return false };
        let Equations { bodies, joints } = equations;
        let (outer, inner, joint) = (node.outer as usize, node.inner as usize, &joints[node.joint as usize]);
        let outer_is_a = self.topology.joints[node.joint as usize][0] == node.outer;
        let (end_outer, end_inner) = if outer_is_a { (0, 1) } else { (1, 0) };
        let far = self.far;
        let is_far = |body: usize| far == Some(body);
        let (mut z, mut b, mut c) =
            (Matrix12::identity(), SMatrix::<f64, 12, 6>::zeros(), SMatrix::<f64, 12, 6>::zeros());
        let mut rhs = Vector12::zeros();
        let (outer_counts, inner_counts) = (!bodies[outer].is_held(), !bodies[inner].is_held());
        if outer_counts {
            let at_outer = jacobian(joint, end_outer);
            if is_far(outer) {
                c.fixed_view_mut::<6, 6>(6, 0).copy_from(&at_outer);
            } else {
                z.fixed_view_mut::<6, 6>(0, 0).copy_from(&self.matrices[outer]);
                z.fixed_view_mut::<6, 6>(6, 0).copy_from(&at_outer);
                z.fixed_view_mut::<6, 6>(0, 6).copy_from(&at_outer.transpose());
                c.fixed_view_mut::<6, 6>(0, 0).copy_from(&self.couplings[outer]);
                rhs.fixed_rows_mut::<6>(0).copy_from(&self.vectors[outer]);
            }
        }
        let inner_part = if is_far(inner) { &mut c } else { &mut b };
        if inner_counts {
            inner_part.fixed_view_mut::<6, 6>(6, 0).copy_from(&jacobian(joint, end_inner));
        }
        if outer_counts && inner_counts {
            let coupling = if outer_is_a { joint.coupling } else { joint.coupling.transpose() };
            if is_far(outer) {
                let mut own = self.couplings[inner].fixed_view_mut::<3, 3>(3, 3);
                own += coupling.transpose();
            } else {
                let mut own = inner_part.fixed_view_mut::<3, 3>(3, 3);
                own += coupling;
            }
        }
        for (part, compliance) in joint.compliance.iter().enumerate() {
            z.fixed_view_mut::<3, 3>(6 + 3 * part, 6 + 3 * part).copy_from(&-compliance);
        }
        rhs.fixed_rows_mut::<6>(6).copy_from(&stacked(&joint.rhs));
        let mass = [outer, inner].map(|body| bodies[body].mass).into_iter().find(|mass| mass.is_finite());
        let Some(eliminated) = self.factored(&z, &units(mass.unwrap_or(1.0), joint.length), 6, (&b, &c, &rhs)) else {
            return false;
        };
        if inner_counts && !is_far(inner) {
            self.matrices[inner] -= b.transpose() * eliminated.inner;
            self.couplings[inner] -= b.transpose() * eliminated.far;
            self.vectors[inner] -= b.transpose() * eliminated.alone;
        }
        self.change_far(&c, &eliminated, bodies);
        self.nodes[k] = eliminated;
        node.leaves != Leaves::Nothing || is_far(inner) || self.eliminate_root(inner, equations)
    }

    /// Eliminates a body that is left alone.
    fn eliminate_root(&mut self, body: usize, Equations { bodies, .. }: &Equations) -> bool {
        if bodies[body].is_held() {
            self.roots.push(Eliminated::zero());
            return true;
        }
        let units = units(bodies[body].mass, 1.0).fixed_rows::<6>(0).into_owned();
        let c = if self.far == Some(body) { Matrix6::zeros() } else { self.couplings[body] };
        let (matrix, vector) = (self.matrices[body], self.vectors[body]);
        let Some(eliminated) = self.factored(&matrix, &units, 0, (&Matrix6::zeros(), &c, &vector)) else {
            return false;
        };
        self.change_far(&c, &eliminated, bodies);
        self.roots.push(eliminated);
        true
    }

    /// What an elimination leaves of the far body, if there is one.
    fn change_far<const N: usize>(&mut self, c: &SMatrix<f64, N, 6>, by: &Eliminated<N>, bodies: &[BodyEquation]) {
        if let Some(far) = self.far.filter(|&far| !bodies[far].is_held()) {
            self.matrices[far] -= c.transpose() * by.far;
            self.vectors[far] -= c.transpose() * by.alone;
        }
    }

    /// The movement of the last root that has not been substituted yet.
    fn substitute_root(&mut self, body: usize, far: &Vector6<f64>) {
        if let Some(root) = self.roots.pop() {
            self.corrections[body] = root.solution(&Vector6::zeros(), far);
        }
    }

    fn substitute(&mut self, k: usize, far: &Vector6<f64>) {
        let Some(node) = self.node(k) else { return };
        let (outer, inner) = (node.outer as usize, node.inner as usize);
        if node.leaves == Leaves::Nothing && self.far != Some(inner) {
            self.substitute_root(inner, far);
        }
        let solution = self.nodes[k].solution(&self.corrections[inner], far);
        if self.far != Some(outer) {
            self.corrections[outer] = solution.fixed_rows::<6>(0).into_owned();
        }
        self.multipliers[node.joint as usize] = -solution.fixed_rows::<6>(6);
    }

    fn node(&self, k: usize) -> Option<Node> {
        self.topology.elimination.as_ref().map(|order| order[k])
    }

    /// `Z^-1` times what couples a block to the inner and the far body, and times its right-hand side. The first six unknowns
    /// are made heavier until so many eigenvalues are negative; `None` where that does not help.
    fn factored<const N: usize>(
        &mut self,
        matrix: &SMatrix<f64, N, N>,
        units: &SVector<f64, N>,
        negative: usize,
        (inner, far, rhs): (&SMatrix<f64, N, 6>, &SMatrix<f64, N, 6>, &SVector<f64, N>),
    ) -> Option<Eliminated<N>> {
        let mut scaled = SMatrix::<f64, N, N>::from_fn(|r, c| matrix[(r, c)] * units[r] * units[c]);
        if !scaled.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut next = FIRST_SHIFT;
        for trial in 0..TRIALS {
            if let Some(factor) = Ldl::new(scaled)
                && factor.negative == negative
            {
                self.mended += usize::from(trial > 0);
                let far = if self.far.is_some() { solved(&factor, units, far) } else { SMatrix::zeros() };
                return Some(Eliminated {
                    inner: solved(&factor, units, inner),
                    far,
                    alone: solved(&factor, units, rhs),
                });
            }
            (0..6).for_each(|k| scaled[(k, k)] += next);
            next *= SHIFT_GROWTH;
        }
        None
    }
}

/// A body's own share of the matrix and of the right-hand side.
fn own(body: &BodyEquation) -> (Matrix6<f64>, Vector6<f64>) {
    let mut matrix = Matrix6::identity();
    if body.is_held() {
        return (matrix, Vector6::zeros());
    }
    matrix.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(body.mass);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&body.turning);
    (matrix, stacked(&body.defect))
}

fn stacked([linear, angular]: &[Vector3<f64>; 2]) -> Vector6<f64> {
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// A joint's Jacobian with respect to body a (`end` 0) or b (1).
fn jacobian(joint: &JointEquation, end: usize) -> Matrix6<f64> {
    let sign = if end == 0 { 1.0 } else { -1.0 };
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(sign);
    out.fixed_view_mut::<3, 3>(0, 3).copy_from(&(joint.arms[end].cross_matrix() * -sign));
    out.fixed_view_mut::<3, 3>(3, 3).fill_diagonal(-sign);
    out
}

/// Units of a node's unknowns in which masses, arms and lengths are about 1.
fn units(mass: f64, length: f64) -> Vector12 {
    let root = mass.sqrt();
    let sizes = [1.0 / root, 1.0 / (length * root), root, length * root];
    Vector12::from_fn(|k, _| sizes[k / 3])
}

/// The solution for the columns of `rhs`, which are in plain units.
fn solved<const N: usize, const M: usize>(
    factor: &Ldl<N>,
    units: &SVector<f64, N>,
    rhs: &SMatrix<f64, N, M>,
) -> SMatrix<f64, N, M> {
    let mut out = factor.solve(&SMatrix::<f64, N, M>::from_fn(|r, c| rhs[(r, c)] * units[r]));
    for (k, mut row) in out.row_iter_mut().enumerate() {
        row *= units[k];
    }
    out
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen};
    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn random(rng: &mut impl Rng) -> Vector3<f64> {
        Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0))
    }

    fn positive(rng: &mut impl Rng, size: f64) -> Matrix3<f64> {
        let half = Matrix3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        (half * half.transpose() + Matrix3::identity()) * size
    }

    /// A random tree, a chain or (kind 2) a ring with branches, some of the ends held; `soft` is taken off the turns' blocks.
    fn equations(rng: &mut ChaCha8Rng, kind: usize, soft: f64) -> (Topology, Equations) {
        let count = rng.random_range(1..12_usize);
        let mut ends = Vec::new();
        for k in 1..count {
            let parent = if kind == 1 || (kind == 2 && k < 5) { k - 1 } else { rng.random_range(0..k) };
            ends.push(if rng.random() { [k as u32, parent as u32] } else { [parent as u32, k as u32] });
        }
        if kind == 2 && count > 4 {
            ends.push([0, 4]);
        }
        let is_end = |body: usize| ends.iter().flatten().filter(|&&end| end as usize == body).count() < 2;
        let mut equations = Equations::default();
        for body in 0..count {
            let mass = rng.random_range(0.1..2.0);
            let turning = positive(rng, 0.1) - Matrix3::identity() * soft;
            let defect = [random(rng), random(rng)];
            let held = is_end(body) && rng.random_range(0..3) == 0;
            equations.bodies.push(if held { BodyEquation::held() } else { BodyEquation { mass, turning, defect } });
        }
        for _ in &ends {
            equations.joints.push(JointEquation {
                length: 1.0,
                arms: [random(rng), random(rng)],
                compliance: [positive(rng, 1e-3), positive(rng, 1e-2)],
                coupling: Matrix3::from_fn(|_, _| rng.random_range(-1.0..1.0)) * soft,
                rhs: [random(rng), random(rng)],
            });
        }
        let held = equations.bodies.iter().map(BodyEquation::is_held).collect();
        (Topology::new(ends, held), equations)
    }

    /// The whole matrix and right-hand side, bodies first; unknowns of held bodies stand alone.
    fn dense(topology: &Topology, equations: &Equations) -> (DMatrix<f64>, DVector<f64>) {
        let (bodies, joints) = (equations.bodies.len(), equations.joints.len());
        let mut matrix = DMatrix::zeros(6 * (bodies + joints), 6 * (bodies + joints));
        let mut rhs = DVector::zeros(6 * (bodies + joints));
        for (i, body) in equations.bodies.iter().enumerate() {
            let (own, vector) = own(body);
            matrix.fixed_view_mut::<6, 6>(6 * i, 6 * i).copy_from(&own);
            rhs.fixed_rows_mut::<6>(6 * i).copy_from(&vector);
        }
        for (j, joint) in equations.joints.iter().enumerate() {
            let row = 6 * (bodies + j);
            let ends = topology.joints[j].map(|body| body as usize);
            let is_free = ends.map(|body| !equations.bodies[body].is_held());
            for part in 0..2 {
                let at = row + 3 * part;
                matrix.fixed_view_mut::<3, 3>(at, at).copy_from(&-joint.compliance[part]);
                rhs.fixed_rows_mut::<3>(at).copy_from(&joint.rhs[part]);
            }
            for end in (0..2).filter(|&end| is_free[end]) {
                let block = jacobian(joint, end);
                matrix.fixed_view_mut::<6, 6>(row, 6 * ends[end]).copy_from(&block);
                matrix.fixed_view_mut::<6, 6>(6 * ends[end], row).copy_from(&block.transpose());
            }
            if is_free == [true; 2] {
                let [a, b] = ends.map(|body| 6 * body + 3);
                matrix.fixed_view_mut::<3, 3>(a, b).copy_from(&joint.coupling);
                matrix.fixed_view_mut::<3, 3>(b, a).copy_from(&joint.coupling.transpose());
            }
        }
        (matrix, rhs)
    }

    #[test]
    fn chains_trees_and_rings_agree_with_a_dense_solve_and_its_inertia() {
        let rng = &mut ChaCha8Rng::seed_from_u64(5);
        let (mut right, mut wrong) = (0, 0);
        for trial in 0..300 {
            let soft = rng.random_range(0.0..1.0);
            let (topology, equations) = equations(rng, trial % 3, soft);
            let (matrix, rhs) = dense(&topology, &equations);
            let mut elimination = Elimination::new(&topology).unwrap();
            assert!(elimination.solve(&equations));
            let values = SymmetricEigen::new(matrix.clone()).eigenvalues;
            let negative = values.iter().filter(|&&value| value < 0.0).count();
            let is_right = negative == 6 * equations.joints.len();
            assert_eq!(elimination.mended == 0, is_right, "trial {trial}: {negative} of {}", rhs.len());
            *(if is_right { &mut right } else { &mut wrong }) += 1;
            if !is_right {
                continue;
            }
            let expected = matrix.lu().solve(&rhs).unwrap();
            let multipliers = elimination.multipliers.iter().map(|x| -x);
            let blocks: Vec<Vector6<f64>> = elimination.corrections.iter().copied().chain(multipliers).collect();
            let found = DVector::from_iterator(rhs.len(), blocks.iter().flat_map(|block| block.iter().copied()));
            let error = (found - &expected).norm() / expected.norm().max(f64::MIN_POSITIVE);
            assert!(error < 1e-9, "trial {trial}: {error:e}");
            let mut left = equations.clone();
            left.subtract(&topology.joints, &elimination.corrections, &elimination.multipliers);
            let of_bodies = left.bodies.iter().filter(|body| !body.is_held()).flat_map(|body| body.defect);
            let all = of_bodies.chain(left.joints.iter().flat_map(|joint| joint.rhs));
            let worst = all.map(|x| x.norm()).fold(0.0, f64::max);
            assert!(worst < 1e-8, "trial {trial}: {worst:e} is left");
        }
        assert!(right > 50 && wrong > 50, "{right} {wrong}");
    }

    /// Without compliance nothing is lost: the constraints hold after the step to rounding errors.
    #[test]
    fn joints_without_compliance_are_closed() {
        let rng = &mut ChaCha8Rng::seed_from_u64(6);
        for _ in 0..50 {
            let (topology, mut equations) = equations(rng, 1, 0.0);
            equations.bodies.iter_mut().filter(|body| body.is_held()).for_each(|body| body.mass = 1.0);
            for body in &mut equations.bodies {
                body.turning = positive(rng, 0.1);
            }
            equations.joints.iter_mut().for_each(|joint| joint.compliance = [Matrix3::zeros(); 2]);
            let mut elimination = Elimination::new(&topology).unwrap();
            assert!(elimination.solve(&equations));
            assert_eq!(elimination.mended, 0);
            for (joint, ends) in equations.joints.iter().zip(&topology.joints) {
                let [a, b] = ends.map(|body| elimination.corrections[body as usize]);
                let gap = jacobian(joint, 0) * a + jacobian(joint, 1) * b - stacked(&joint.rhs);
                assert!(gap.norm() < 1e-11, "{gap}");
            }
        }
    }
}
