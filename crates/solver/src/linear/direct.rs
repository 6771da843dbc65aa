//! The direct solver: block elimination along the tree of joints, O(N) and without fill.
//!
//! A joint's blocks are put together when it is eliminated and never stored; what remains is its share of the factor,
//! 27 numbers. What it leaves of the inverse mass of its inner body (`Left`) is handed to the next joint of that body,
//! which sees it in place of the body's own. For joints j that are eliminated before k, both at a body with the inverse
//! mass H, this is the Schur complement of `A = J M^-1 J^T + alpha~`:
//!
//! ```text
//! J_k H J_k^T - (J_k H J_j^T) D_j^-1 (J_j H J_k^T) = J_k (H - H J_j^T D_j^-1 J_j H) J_k^T
//! ```
//!
//! A chain is eliminated from both its ends, its two halves side by side in vector registers.

mod view;

use self::view::View;
use crate::kernel::Spatial;
use crate::kernel::block::{Block, InverseMass, Left, NodeFactor, assemble, at_connector};
use crate::kernel::lane::{Both, Real};
use crate::kernel::math::{Sym3, map_rows, sum, transposed};
use crate::linear::{LinearInfo, LinearSolver};
use crate::system::{JointTerms, System};
use crate::topology::{Leaves, Node, Topology};

/// Factor of a system whose graph is a tree, and the memory to solve with it.
#[derive(Clone, Debug)]
pub struct TreeFactor<T> {
    /// In the order of elimination, the halves of a folded chain left out.
    nodes: Vec<NodeFactor<T>>,
    /// The two halves of a folded chain.
    folded: Vec<NodeFactor<Both<T>>>,
    /// Bodies that wait for their next joint's elimination.
    waiting: Vec<Left<T>>,
    /// Impulses, on the way down, of the bodies whose next joint's turn has not come.
    impulses: Vec<Spatial<T>>,
    /// What was left of bodies whose joints came in several turns.
    resumed: Vec<InverseMass<T>>,
}

/// `sigma` of a body in a joint: +1 for body a, -1 for body b, with the connector's place z.
#[inline(always)]
fn end<T: Real>(system: &System<T>, joint: u32, body: u32) -> (f64, T) {
    let terms = &system.joints[joint as usize];
    if system.topology.joints[joint as usize][0] == body { (1.0, terms.offsets[0]) } else { (-1.0, terms.offsets[1]) }
}

/// `[r]x W` and `[r]x W [r]x^T` of a joint's body a (`end` 0) or b (1), with the arm r of its connector: `z P` and `z^2 S`
/// with P = [d]x W and S = [d]x W [d]x^T where the connector lies on the axis.
#[inline(always)]
fn lever<T: Real>(system: &System<T>, joint: u32, end: usize) -> ([[T; 3]; 3], Sym3<T>) {
    let body = &system.bodies[system.topology.joints[joint as usize][end] as usize];
    let z = system.joints[joint as usize].offsets[end];
    if let Some(across) = system.across.get(joint as usize) {
        let arm = body.axis * z + across[end];
        let p = body.inverse_inertia.crossed(arm);
        return (p, Sym3::crossed_twice(p, arm));
    }
    let p = body.inverse_inertia.crossed(body.axis);
    let s = Sym3::crossed_twice(p, body.axis);
    (map_rows(p, |row| row * z), s * (z * z))
}

/// D of a joint, in world rows.
///
/// With the arms r of each body: stretch-stretch `sum (1/m) I + [r]x W [r]x^T + alpha~_s`, stretch-bend `sum [r]x W`,
/// bend-bend `sum W + alpha~_b`.
#[inline(always)]
pub fn joint_diagonal<T: Real>(system: &System<T>, joint: u32) -> Block<T> {
    let [a, b] = system.topology.joints[joint as usize].map(|body| &system.bodies[body as usize]);
    let ((pa, sa), (pb, sb)) = (lever(system, joint, 0), lever(system, joint, 1));
    let stretch = Sym3::identity(a.inverse_mass + b.inverse_mass) + sa + sb + system.stretch_compliance(joint as usize);
    let bend = a.inverse_inertia + b.inverse_inertia + system.bend_compliance(joint as usize);
    let mixed = sum(pa, pb);
    assemble(stretch.full(), mixed, transposed(mixed), bend.full())
}

/// The block that couples two joints through body `via`: rows of `joint`, columns of `other`.
///
/// `sigma sigma' [ (1/m) I + z z' S, z P; z' P^T, W ]`, or with arms r and r' off the axis
/// `sigma sigma' [ (1/m) I + [r]x W [r']x^T, [r]x W; ([r']x W)^T, W ]`.
#[inline(always)]
pub fn joint_coupling<T: Real>(system: &System<T>, joint: u32, other: u32, via: u32) -> Block<T> {
    let body = &system.bodies[via as usize];
    let ((sigma, z), (sigma_other, z_other)) = (end(system, joint, via), end(system, other, via));
    let sign = T::splat(sigma * sigma_other);
    if !system.across.is_empty() {
        let arm = |joint: u32, z: T| {
            let is_a = system.topology.joints[joint as usize][0] == via;
            body.axis * z + system.across[joint as usize][usize::from(!is_a)]
        };
        let (arm, arm_other) = (arm(joint, z), arm(other, z_other));
        let p = body.inverse_inertia.crossed(arm);
        let shift = sum(Sym3::identity(body.inverse_mass).full(), map_rows(p, |row| arm_other.cross(row)));
        let [stretch, mixed, turned, bend] =
            [shift, p, transposed(body.inverse_inertia.crossed(arm_other)), body.inverse_inertia.full()]
                .map(|part| map_rows(part, |row| row * sign));
        return assemble(stretch, mixed, turned, bend);
    }
    let p = body.inverse_inertia.crossed(body.axis);
    let s = Sym3::crossed_twice(p, body.axis);
    let stretch = Sym3::identity(body.inverse_mass * sign) + s * (z * z_other * sign);
    assemble(
        stretch.full(),
        map_rows(p, |row| row * (z * sign)),
        map_rows(transposed(p), |row| row * (z_other * sign)),
        map_rows(body.inverse_inertia.full(), |row| row * sign),
    )
}

/// A body on its own.
#[inline(always)]
fn fresh<T: Real>(system: &System<T>, body: u32) -> Left<T> {
    let terms = &system.bodies[body as usize];
    Left { inverse_mass: InverseMass::free(terms.inverse_mass, terms.inverse_inertia), correction: Spatial::zero() }
}

impl<T: Real> TreeFactor<T> {
    /// Memory for systems of this connectivity, which must have no loop.
    pub fn new(topology: &Topology) -> Self {
        let nodes = topology.elimination.as_deref().map_or(0, <[Node]>::len);
        let fold = Self::fold(topology);
        Self {
            nodes: vec![NodeFactor::zero(); nodes - 2 * fold],
            folded: vec![NodeFactor::zero(); fold],
            waiting: Vec::with_capacity(topology.stack_depth),
            impulses: Vec::with_capacity(topology.stack_depth),
            resumed: Vec::with_capacity(topology.resumptions),
        }
    }

    /// Rods in lanes fill the vector registers already.
    #[inline(always)]
    fn fold(topology: &Topology) -> usize {
        if T::IN_LANES { 0 } else { topology.fold }
    }

    /// Solves `A dlambda = b`.
    #[inline(always)]
    pub fn solve(&mut self, system: &System<T>, dlambda: &mut [Spatial<T>]) {
        match system.has_beyond() {
            true => self.solve_joints::<true>(system, dlambda),
            false => self.solve_joints::<false>(system, dlambda),
        }
    }

    #[inline(always)]
    fn solve_joints<const BEYOND: bool>(&mut self, system: &System<T>, dlambda: &mut [Spatial<T>]) {
        let order = system.topology.elimination.as_deref().unwrap_or(&[]);
        let fold = Self::fold(&system.topology);
        // Nodes before the halves of a chain, the halves, and the root after them; without halves all nodes come before.
        let first = order.len() - fold.min(1) - 2 * fold;
        let (second, after) = (first + fold, first + 2 * fold);
        let halves = [&order[first..second], &order[second..after]];
        let alone = [(&order[..first], 0), (&order[after..], first)];
        self.waiting.clear();
        self.impulses.clear();
        self.resumed.clear();
        // Each kernel is called at one place, as it is inlined at each.
        let mut carried = fresh(system, order.first().map_or(0, |node| node.outer));
        for (k, (nodes, offset)) in alone.into_iter().enumerate() {
            if !T::IN_LANES && fold > 0 && k == 1 {
                let left = self.factor_halves::<BEYOND>(system, halves, [carried, fresh(system, halves[1][0].outer)]);
                self.waiting.push(left.one(0));
                carried = left.one(1);
            }
            carried = self.factor::<BEYOND>(system, nodes, offset, carried);
        }
        let mut impulse = Spatial::zero();
        for (k, (nodes, offset)) in alone.into_iter().enumerate().rev() {
            if !T::IN_LANES && fold > 0 && k == 0 {
                let waiting = self.impulses.pop().unwrap_or(Spatial::zero());
                let both = Spatial::both(waiting, impulse);
                impulse = self.substitute_halves::<BEYOND>(system, halves, both, dlambda).one(0);
            }
            impulse = self.substitute::<BEYOND>(system, nodes, offset, impulse, dlambda);
        }
    }

    /// Eliminates the nodes of `order`, whose factors start at `offset`, in turn; what the first may follow on and what
    /// the last leaves is carried.
    #[inline(always)]
    fn factor<const BEYOND: bool>(
        &mut self,
        system: &System<T>,
        order: &[Node],
        offset: usize,
        mut carried: Left<T>,
    ) -> Left<T> {
        for (factor, node) in self.nodes[offset..].iter_mut().zip(order) {
            let view = View::<T, BEYOND>::new(system, node);
            if !node.follows {
                carried = fresh(system, node.outer);
            }
            if node.leaves != Leaves::Nothing && !node.resumes {
                factor.eliminate::<true>(&view.terms(), &mut carried, &view.fresh());
            } else {
                let waited = if node.resumes { self.waiting.pop() } else { None };
                let inner = waited.unwrap_or(view.fresh());
                if node.leaves != Leaves::Nothing {
                    self.resumed.push(inner.inverse_mass);
                }
                factor.eliminate::<false>(&view.terms(), &mut carried, &inner);
            }
            if node.leaves == Leaves::Waiting {
                self.waiting.push(carried);
            }
        }
        carried
    }

    /// The same for two halves of a chain.
    #[inline(always)]
    fn factor_halves<const BEYOND: bool>(
        &mut self,
        system: &System<T>,
        halves: [&[Node]; 2],
        start: [Left<T>; 2],
    ) -> Left<Both<T>> {
        let mut carried = Left::both(&start[0], &start[1]);
        for (factor, (a, b)) in self.folded.iter_mut().zip(halves[0].iter().zip(halves[1])) {
            let (a, b) = (View::<T, BEYOND>::new(system, a), View::<T, BEYOND>::new(system, b));
            let joint = JointTerms::both(a.joint, b.joint);
            let view = View::both(&a, &b, &joint);
            factor.eliminate::<true>(&view.terms(), &mut carried, &view.fresh());
        }
        carried
    }

    /// Goes down the nodes of `order`, given the impulse on the last one's inner body; returns that on the first one's
    /// outer body.
    #[inline(always)]
    fn substitute<const BEYOND: bool>(
        &mut self,
        system: &System<T>,
        order: &[Node],
        offset: usize,
        mut impulse: Spatial<T>,
        dlambda: &mut [Spatial<T>],
    ) -> Spatial<T> {
        for (factor, node) in self.nodes[offset..offset + order.len()].iter().zip(order).rev() {
            let view = View::<T, BEYOND>::new(system, node);
            let change = match node.leaves {
                Leaves::Nothing => Spatial::zero(),
                leaves => {
                    if leaves == Leaves::Waiting {
                        impulse = self.impulses.pop().unwrap_or(impulse);
                    }
                    match if node.resumes { self.resumed.pop() } else { None } {
                        Some(inverse_mass) => at_connector(view.arms[1], inverse_mass.apply(impulse)),
                        None => view.change(impulse),
                    }
                }
            };
            let x = factor.solve(change);
            dlambda[node.joint as usize] = view.multipliers(x);
            let [on_outer, on_inner] = view.impulses(x);
            if node.resumes {
                let before = if node.leaves == Leaves::Nothing { Spatial::zero() } else { impulse };
                self.impulses.push(before.plus(on_inner, T::splat(1.0)));
            }
            impulse = on_outer;
        }
        impulse
    }

    /// The same for two halves of a chain.
    #[inline(always)]
    fn substitute_halves<const BEYOND: bool>(
        &mut self,
        system: &System<T>,
        halves: [&[Node]; 2],
        mut impulse: Spatial<Both<T>>,
        dlambda: &mut [Spatial<T>],
    ) -> Spatial<Both<T>> {
        for (factor, (a, b)) in self.folded.iter().zip(halves[0].iter().zip(halves[1])).rev() {
            let views = [View::<T, BEYOND>::new(system, a), View::<T, BEYOND>::new(system, b)];
            let joint = JointTerms::both(views[0].joint, views[1].joint);
            let view = View::both(&views[0], &views[1], &joint);
            let x = factor.solve(view.change(impulse));
            let multipliers = view.multipliers(x);
            dlambda[a.joint as usize] = multipliers.one(0);
            dlambda[b.joint as usize] = multipliers.one(1);
            impulse = view.impulses(x)[0];
        }
        impulse
    }
}

/// The direct solver for graphs without loops.
#[derive(Clone, Debug)]
pub struct Direct<T> {
    factor: TreeFactor<T>,
}

impl<T: Real> Direct<T> {
    /// Memory for systems of this connectivity; `None` where it has a loop.
    pub fn new(topology: &Topology) -> Option<Self> {
        topology.elimination.is_some().then(|| Self::for_tree(topology))
    }

    /// Memory for systems of this connectivity, which must have no loop: the multipliers of one with a loop stay zero.
    pub(crate) fn for_tree(topology: &Topology) -> Self {
        Self { factor: TreeFactor::new(topology) }
    }
}

impl<T: Real> LinearSolver<T> for Direct<T> {
    fn solve(&mut self, system: &System<T>, _has_start: bool, dlambda: &mut [Spatial<T>]) -> LinearInfo {
        T::dispatch(
            #[inline(always)]
            || self.factor.solve(system, dlambda),
        );
        LinearInfo::default()
    }

    fn uses_start(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;
    use std::sync::Arc;

    use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rod::{Assembly, BodyShape, Material, Pose, RigidBody, RodSpec};

    use super::*;
    use crate::component::{Component, split};
    use crate::formulation::Formulation;

    fn random(rng: &mut impl Rng, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| size * rng.random_range(-1.0..1.0))
    }

    /// A rod along a random walk.
    fn rod(
        assembly: &mut Assembly,
        start: Vector3<f64>,
        segments: usize,
        rng: &mut impl Rng,
    ) -> std::ops::Range<usize> {
        let mut nodes = vec![start];
        let mut direction = random(rng, 1.0);
        for k in 0..segments {
            direction = (direction + random(rng, 0.5)).normalize();
            nodes.push(nodes[k] + direction * rng.random_range(0.05..0.2));
        }
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 5e5, density: 500.0 };
        assembly.rod(&RodSpec::new(nodes, 0.02, material))
    }

    /// One of: a chain, a tree with branches of branches, a star; with nothing, a segment or a face held.
    fn assembly(seed: u64) -> Assembly {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let length = rng.random_range(2..14);
        let trunk = rod(&mut assembly, Vector3::zeros(), length, rng);
        let mut rods = vec![trunk.clone()];
        let kind = seed % 3;
        let (is_chain, is_tree) = (kind == 0, kind == 1);
        let branches = if is_chain { 0 } else { rng.random_range(1..6) };
        for _ in 0..branches {
            let of = rods[rng.random_range(0..rods.len())].clone();
            let parent = if is_tree { rng.random_range(of) } else { trunk.start };
            let start = assembly.state_mut().positions[parent];
            let length = rng.random_range(1..6);
            let branch = rod(&mut assembly, start, length, rng);
            assembly.branch(parent, rng.random_range(0.0..1.0), &branch);
            rods.push(branch);
        }
        match rng.random_range(0..4) {
            0 => {}
            1 => {
                assembly.fix(rng.random_range(trunk));
            }
            2 => {
                assembly.clamp_start(&trunk);
            }
            _ => {
                assembly.clamp_start(&trunk).clamp_end(&trunk).fix(rods[rods.len() - 1].start);
            }
        }
        let state = assembly.state_mut();
        for k in 0..state.positions.len() {
            state.velocities[k] = random(rng, 1.0);
            state.angular_velocities[k] = random(rng, 5.0);
        }
        assembly
    }

    /// The same with rigid bodies here and there: at the ends of rods, between two of them, in the middle of one.
    fn with_bodies(seed: u64) -> Assembly {
        let rng = &mut ChaCha8Rng::seed_from_u64(1000 + seed);
        let mut assembly = assembly(seed);
        let segments = assembly.state_mut().len();
        for _ in 0..rng.random_range(1..4) {
            let count = assembly.state_mut().len();
            let sides = random(rng, 0.1).abs().add_scalar(0.05);
            let position = random(rng, 0.5);
            let orientation = UnitQuaternion::from_scaled_axis(random(rng, 3.0));
            let body = RigidBody::new(BodyShape::Box { sides }, rng.random_range(0.1..10.0));
            let body = assembly.body(body, Pose { position, orientation });
            let segment = if rng.random() { segments - 1 } else { rng.random_range(0..segments) };
            assembly.join_body(segment, rng.random_range(0.0..1.0), body, &random(rng, 0.1));
            for _ in 0..rng.random_range(0..3) {
                let length = rng.random_range(1..5);
                let rod = rod(&mut assembly, position, length, rng);
                assembly.join_body(rod.start, 0.0, body, &random(rng, 0.1));
            }
            let state = assembly.state_mut();
            for k in count..state.len() {
                (state.velocities[k], state.angular_velocities[k]) = (random(rng, 1.0), random(rng, 5.0));
            }
        }
        assembly
    }

    /// `A x` in world rows, from the parts of the system.
    fn apply(system: &System<f64>, x: &[Spatial<f64>]) -> Vec<Spatial<f64>> {
        let mut impulses = vec![Spatial::zero(); system.bodies.len()];
        for (j, &x) in x.iter().enumerate() {
            system.add_impulse(j, x, &mut impulses);
        }
        let corrections: Vec<_> = impulses.iter().enumerate().map(|(i, &x)| system.correction(i, x)).collect();
        let change = |j: usize| {
            let compliance = Spatial {
                linear: system.stretch_compliance(j).apply(x[j].linear),
                angular: system.bend_compliance(j).apply(x[j].angular),
            };
            system.constraint_change(j, &corrections).plus(compliance, 1.0)
        };
        (0..x.len()).map(change).collect()
    }

    fn flat(x: &[Spatial<f64>]) -> DVector<f64> {
        DVector::from_iterator(6 * x.len(), x.iter().flat_map(|x| x.to_array()))
    }

    /// Solves in world rows with the tree and densely; returns the relative difference.
    fn difference(system: &System<f64>, dlambda: &mut [Spatial<f64>]) -> f64 {
        let n = system.joints.len();
        let orientation = |j: usize| system.frame(j);
        let mut dense = DMatrix::zeros(6 * n, 6 * n);
        for column in 0..6 * n {
            let mut unit = vec![Spatial::zero(); n];
            let mut entry = [0.0; 6];
            entry[column % 6] = 1.0;
            unit[column / 6] = Spatial::from_array(entry);
            dense.set_column(column, &flat(&apply(system, &unit)));
        }
        let world = |j: usize| system.joints[j].to_world(system.joints[j].rhs, orientation(j));
        let rhs = flat(&(0..n).map(world).collect::<Vec<_>>());
        let expected = dense.lu().solve(&rhs).unwrap();
        Direct::new(&system.topology).unwrap().solve(system, false, dlambda);
        let got: Vec<_> = (0..n).map(|j| system.joints[j].multipliers_to_world(dlambda[j], orientation(j))).collect();
        (flat(&got) - &expected).norm() / expected.norm().max(f64::MIN_POSITIVE)
    }

    #[test]
    fn chains_trees_and_stars_agree_with_a_dense_solve() {
        agree_with_a_dense_solve(assembly, 1e-9);
    }

    #[test]
    fn rods_with_rigid_bodies_agree_with_a_dense_solve() {
        // Bodies are heavier than rods by orders of magnitude, and the matrix so much worse conditioned.
        agree_with_a_dense_solve(with_bodies, 1e-8);
    }

    fn agree_with_a_dense_solve(assembly: impl Fn(u64) -> Assembly, tolerance: f64) {
        let mut kinds = [0; 4];
        for seed in 0..60 {
            let (model, state) = assembly(seed).finish();
            for formulation in Formulation::ALL {
                for (members, topology) in split(&model) {
                    kinds[0] += usize::from(topology.fold > 0);
                    kinds[1] += usize::from(topology.branches > 0);
                    kinds[2] += usize::from(topology.stack_depth > 1);
                    kinds[3] += usize::from(topology.joints.len() == 2 * (topology.joints.len() / 2));
                    let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
                    // With much longer steps the matrix is so ill-conditioned that dense LU and Cholesky disagree by more.
                    component.predict(0.0, 1e-3, formulation);
                    for iteration in 0..3 {
                        component.evaluate(formulation);
                        let error = difference(&component.system, &mut component.dlambda);
                        assert!(error < tolerance, "seed {seed} {formulation} iteration {iteration}: {error:e}");
                        component.update(formulation, 1.0);
                    }
                }
            }
        }
        assert!(kinds.iter().all(|&count| count > 5), "{kinds:?}");
    }

    #[test]
    fn a_star_with_many_arms_and_a_chain_of_half_turns_agree_with_a_dense_solve() {
        let material = Material { youngs_modulus: 1e9, torsion_modulus: 1e9, density: 1000.0 };
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes = |k: f64| vec![Vector3::new(0.0, 0.0, k), Vector3::new((k * FRAC_PI_2).cos(), k.sin(), k + 0.1)];
        let hub = assembly.rod(&RodSpec::new(nodes(0.0), 0.01, material));
        for k in 0..30 {
            let arm = assembly.rod(&RodSpec::new(nodes(f64::from(k)), 0.01, material));
            assembly.branch(hub.start, 0.03 * f64::from(k), &arm);
        }
        let (model, state) = assembly.finish();
        let (members, topology) = split(&model).remove(0);
        let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
        component.predict(0.0, 0.01, Formulation::Newton);
        component.evaluate(Formulation::Newton);
        for (k, terms) in component.system.joints.iter_mut().enumerate() {
            terms.rhs = Spatial::from_array([k as f64, 1.0, -1.0, 0.5, 0.3, 0.1]);
        }
        let error = difference(&component.system, &mut component.dlambda);
        assert!(error < 1e-9, "{error:e}");
    }
}
