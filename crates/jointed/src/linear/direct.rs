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
use crate::block::{InverseMass, Left, NodeFactor, at_connector};
use crate::linear::{LinearInfo, LinearSolver};
use crate::system::{JointTerms, System};
use crate::topology::{Leaves, Node, Topology};
use kernels::Spatial;
use kernels::lane::{Both, Real};

/// Factor of a system whose graph is a tree, and the memory to solve with it.
#[derive(Clone, Debug)]
pub(crate) struct TreeFactor<T> {
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

/// A body on its own.
#[inline(always)]
fn fresh<T: Real>(system: &System<T>, body: u32) -> Left<T> {
    let terms = &system.bodies[body as usize];
    Left { inverse_mass: InverseMass::free(terms.inverse_mass, terms.inverse_inertia), correction: Spatial::zero() }
}

impl<T: Real> TreeFactor<T> {
    /// Memory for systems of this connectivity, which must have no loop.
    pub(crate) fn new(topology: &Topology) -> Self {
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
    pub(crate) fn solve(&mut self, system: &System<T>, dlambda: &mut [Spatial<T>]) {
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
    pub fn for_tree(topology: &Topology) -> Self {
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
