//! The way up the tree of joints, which eliminates node after node, and the way down, which substitutes. Forces that come later
//! go up once more, through the factors.

use nalgebra::Vector6;

use super::cholesky::Cholesky;
use super::far::take_row_off;
use super::node::{Factor, Left, Terms, column, set_column};
use super::problem::{Problem, six};
use super::stiffness::Stiffness;
use crate::kernel::Spatial;
use crate::kernel::math::Sym3;
use crate::topology::{Leaves, Node, Topology};

/// The first share of its own mass by which a body is made heavier where the eigenvalues have wrong signs.
const FIRST_SHIFT: f64 = 0.25;
/// Growth of that share from one trial to the next.
const SHIFT_GROWTH: f64 = 4.0;
/// Most trials at a node. The last makes the body 10^14 times as heavy: beyond that it is no matter of signs.
const TRIALS: usize = 25;
/// The same as a share of the body's block of K, where that is more: a system may have next to no mass.
const FIRST_SHARE: f64 = 1e-9;
/// Memory of both ways. Left-overs and factors have M columns: one alone, and one for each movement of the far body.
#[derive(Clone, Debug)]
pub(super) struct Sweep<const M: usize> {
    /// One entry a body.
    pub(super) left: Vec<Left<f64, M>>,
    /// One entry a node.
    factors: Vec<Factor<f64, M>>,
    /// Bodies that are left alone, in the order of the roots.
    roots: Vec<Root<M>>,
    /// Of those, how many a pass has not come to yet.
    roots_left: usize,
    /// Bodies that had to be made heavier.
    pub(super) mended: usize,
    /// Whether what is not at a minimum is left as it is.
    pub(super) is_left: bool,
    /// Then, the eigenvalues whose sign is not that of a minimum.
    pub(super) wrong: usize,
}

/// A body that is left alone: its movement, and the factor of its block where it is free.
#[derive(Clone, Copy, Debug)]
struct Root<const M: usize> {
    movement: [[f64; M]; 6],
    factor: Option<Cholesky>,
}

impl<const M: usize> Sweep<M> {
    pub(super) fn new(topology: &Topology) -> Self {
        let zero = Stiffness::of_parts(Sym3::zero(), Sym3::zero());
        let nodes = topology.elimination.as_deref().map_or(0, <[Node]>::len);
        let ends = topology.elimination.iter().flatten().filter(|node| node.leaves == Leaves::Nothing).count();
        Self {
            left: vec![Left::new(zero, Spatial::zero()); topology.bodies()],
            factors: vec![Factor::zero(); nodes],
            roots: Vec::with_capacity(ends + 1),
            roots_left: 0,
            mended: 0,
            is_left: false,
            wrong: 0,
        }
    }

    /// Solves the equations of a problem; returns whether it could.
    #[inline(always)]
    pub(super) fn solve(
        &mut self,
        problem: &Problem<'_>,
        corrections: &mut [Vector6<f64>],
        multipliers: &mut [Vector6<f64>],
    ) -> bool {
        self.begin(problem);
        let nodes = problem.nodes().len();
        if !self.up(problem, 0..nodes) || !self.end(problem) {
            return false;
        }
        let numbers = self.first_movements(problem, corrections);
        for k in (0..nodes).rev() {
            self.substitute(problem, k, &numbers, corrections, multipliers);
        }
        true
    }

    #[inline(always)]
    pub(super) fn begin(&mut self, problem: &Problem<'_>) {
        (self.mended, self.wrong) = (0, 0);
        self.roots.clear();
        if let Some(far) = problem.far {
            self.left[far] = problem.fresh(far as u32);
        }
    }

    /// Eliminates nodes in turn.
    #[inline(always)]
    pub(super) fn up(&mut self, problem: &Problem<'_>, nodes: std::ops::Range<usize>) -> bool {
        for k in nodes {
            if !self.eliminate(problem, k) {
                return false;
            }
        }
        true
    }

    /// Eliminates a single body, and the far one.
    pub(super) fn end(&mut self, problem: &Problem<'_>) -> bool {
        if problem.nodes().is_empty() {
            self.left[0] = problem.fresh(0);
            return self.eliminate_root(problem, 0, 1.0);
        }
        let length = problem.equations.joints[0].length;
        problem.far.is_none_or(|far| self.eliminate_root(problem, far as u32, length))
    }

    /// Eliminates the outer body and the joint of a node, and of a root what is left.
    #[inline(always)]
    fn eliminate(&mut self, problem: &Problem<'_>, k: usize) -> bool {
        let node = problem.nodes()[k];
        let terms = problem.terms(&node);
        let inner_is_far = problem.far == Some(node.inner as usize);
        let added = match problem.is_apart(node.outer) {
            true => self.hang(problem, &node, &terms),
            false => self.fold_in(problem, k, &node, &terms),
        };
        let Some(added) = added else { return false };
        if inner_is_far {
            self.close(&added, node.inner as usize);
        } else if !problem.is_held(node.inner) {
            let inner = node.inner as usize;
            self.left[inner] = if node.resumes { self.left[inner] } else { problem.fresh(node.inner) }.plus(&added);
        }
        let is_root = node.leaves == Leaves::Nothing && !inner_is_far;
        !is_root || self.eliminate_root(problem, node.inner, problem.joint(&node).length)
    }

    /// [`Self::eliminate`] where it is rare.
    #[cold]
    pub(super) fn eliminate_one(&mut self, problem: &Problem<'_>, k: usize) -> bool {
        self.eliminate(problem, k)
    }

    /// Eliminates the outer body and the joint of a node; returns what that adds to the inner body.
    #[inline(always)]
    fn fold_in(&mut self, problem: &Problem<'_>, k: usize, node: &Node, terms: &Terms<f64>) -> Option<Left<f64, M>> {
        let mut outer = if node.follows { self.left[node.outer as usize] } else { problem.fresh(node.outer) };
        let mut forces = [[0.0; M]; 6];
        for c in 0..M {
            set_column(&mut forces, c, terms.on_outer(column(&outer.forces, c)));
        }
        let length = problem.joint(node).length;
        let mut next = 0.0;
        for trial in 0..TRIALS {
            let (factor, added) = Factor::new(terms, &outer.stiffness, &forces);
            let is_positive = factor.is_positive();
            if is_positive || (self.is_left && factor.is_regular()) {
                self.mended += usize::from(trial > 0);
                if !is_positive {
                    self.wrong += factor.negative();
                }
                if M > 1 {
                    self.change_far(problem, &factor, terms, &forces);
                }
                self.factors[k] = factor;
                return Some(added);
            }
            if self.is_left {
                return None;
            }
            if trial == 0 {
                next = first_shift(problem.equations.bodies[node.outer as usize].mass, length, &outer.stiffness);
            }
            outer.stiffness = heavier(&outer.stiffness, next, length);
            next *= SHIFT_GROWTH;
        }
        None
    }

    /// Eliminates a body that is left alone, one whose rows have such a `length`.
    fn eliminate_root(&mut self, problem: &Problem<'_>, body: u32, length: f64) -> bool {
        if problem.is_held(body) {
            self.roots.push(Root { movement: [[0.0; M]; 6], factor: None });
            return true;
        }
        let mut left = self.left[body as usize];
        let mut next = first_shift(problem.equations.bodies[body as usize].mass, length, &left.stiffness);
        for trial in 0..TRIALS {
            if let Some(factor) = Cholesky::new(&left.stiffness, self.is_left) {
                self.mended += usize::from(trial > 0);
                let (rows, pivots) = factor.forward(&left.forces);
                self.wrong += pivots.iter().filter(|&&pivot| pivot < 0.0).count();
                if let Some(far) = problem.far.filter(|&far| far != body as usize) {
                    for (row, pivot) in rows.iter().zip(pivots) {
                        take_row_off(&mut self.left[far], row, 1.0 / pivot);
                    }
                }
                self.roots.push(Root { movement: factor.backward(rows), factor: Some(factor) });
                return true;
            }
            if self.is_left {
                return false;
            }
            left.stiffness = heavier(&left.stiffness, next, length);
            next *= SHIFT_GROWTH;
        }
        false
    }

    /// The movement of the far body, or of a single one, and the numbers that all columns are for.
    pub(super) fn first_movements(&mut self, problem: &Problem<'_>, corrections: &mut [Vector6<f64>]) -> [f64; M] {
        let mut numbers = [0.0; M];
        numbers[0] = 1.0;
        self.roots_left = self.roots.len();
        if let Some(far) = problem.far {
            self.substitute_root(far, &numbers, corrections);
            numbers[1..].copy_from_slice(corrections[far].as_slice());
        } else if problem.nodes().is_empty() {
            self.substitute_root(0, &numbers, corrections);
        }
        numbers
    }

    /// The movement of the last root that has not been substituted yet.
    fn substitute_root(&mut self, body: usize, numbers: &[f64; M], corrections: &mut [Vector6<f64>]) {
        self.roots_left -= 1;
        if let Some(root) = self.roots.get(self.roots_left) {
            let movement = root.movement.map(|row| row.iter().zip(numbers).map(|(x, number)| x * number).sum());
            corrections[body] = Vector6::from(movement);
        }
    }

    #[inline(always)]
    pub(super) fn substitute(
        &mut self,
        problem: &Problem<'_>,
        k: usize,
        numbers: &[f64; M],
        corrections: &mut [Vector6<f64>],
        multipliers: &mut [Vector6<f64>],
    ) {
        let node = problem.nodes()[k];
        let (outer, inner) = (node.outer as usize, node.inner as usize);
        if node.leaves == Leaves::Nothing && problem.far != Some(inner) {
            self.substitute_root(inner, numbers, corrections);
        }
        let terms = problem.terms(&node);
        let at_inner = Spatial::from_array(corrections[inner].into());
        let transmitted = if problem.is_apart(node.outer) {
            let at_outer = Spatial::from_array(corrections[outer].into());
            let yielded = terms.of_inner(at_inner).plus(terms.of_outer(at_outer), 1.0).plus(terms.rhs, -1.0);
            let [stretch, bend] = problem.hold(&node, &terms).unwrap_or([Sym3::zero(); 2]);
            Spatial { linear: stretch.apply(yielded.linear), angular: bend.apply(yielded.angular) }
        } else {
            let [moved, transmitted] = self.factors[k].solve(&terms, at_inner, numbers);
            corrections[outer] = six(moved);
            transmitted
        };
        multipliers[node.joint as usize] = -six(transmitted);
    }
}

impl Sweep<1> {
    /// Begins to take other right-hand sides of a system that has been solved.
    pub(super) fn begin_carrying(&mut self) {
        self.roots_left = 0;
    }

    /// Takes them at nodes in turn.
    #[inline(always)]
    pub(super) fn carry(&mut self, problem: &Problem<'_>, nodes: std::ops::Range<usize>) {
        for k in nodes {
            self.carry_one(problem, k);
        }
    }

    #[inline(always)]
    pub(super) fn carry_one(&mut self, problem: &Problem<'_>, k: usize) {
        let node = problem.nodes()[k];
        let terms = problem.terms(&node);
        let [outer, inner] = [node.outer as usize, node.inner as usize];
        let added = if problem.is_apart(node.outer) {
            let [stretch, bend] = problem.hold(&node, &terms).unwrap_or([Sym3::zero(); 2]);
            let rhs = terms.rhs;
            terms.on_inner(Spatial { linear: stretch.apply(rhs.linear), angular: bend.apply(rhs.angular) })
        } else {
            let own = if node.follows { self.carried(outer) } else { problem.force(node.outer) };
            self.factors[k].carry(&terms, own)
        };
        if !problem.is_held(node.inner) {
            let own = if node.resumes { self.carried(inner) } else { problem.force(node.inner) };
            self.set_carried(inner, own.plus(added, 1.0));
        }
        if node.leaves == Leaves::Nothing {
            self.carry_to_root(inner);
        }
    }

    /// Ends that: a single body has no node.
    pub(super) fn end_carrying(&mut self, problem: &Problem<'_>) {
        if problem.nodes().is_empty() {
            self.set_carried(0, problem.force(0));
            self.carry_to_root(0);
        }
    }

    fn carry_to_root(&mut self, body: usize) {
        let force = self.left[body].forces;
        let root = &mut self.roots[self.roots_left];
        self.roots_left += 1;
        if let Some(factor) = &root.factor {
            let (rows, _) = factor.forward(&force);
            root.movement = factor.backward(rows);
        }
    }

    /// What has been carried to a body.
    #[inline(always)]
    pub(super) fn carried(&self, body: usize) -> Spatial<f64> {
        column(&self.left[body].forces, 0)
    }

    #[inline(always)]
    pub(super) fn set_carried(&mut self, body: usize, force: Spatial<f64>) {
        set_column(&mut self.left[body].forces, 0, force);
    }
}

/// By how much a body is made heavier at first.
fn first_shift(mass: f64, length: f64, Stiffness { translation, turning, .. }: &Stiffness<f64>) -> f64 {
    let largest = |Sym3([xx, yy, zz, ..]): &Sym3<f64>| xx.abs().max(yy.abs()).max(zz.abs());
    let own = largest(translation).max(largest(turning) / (length * length));
    (FIRST_SHIFT * mass).max(FIRST_SHARE * own)
}

/// The stiffness of a body that is heavier by so much mass.
fn heavier(stiffness: &Stiffness<f64>, mass: f64, length: f64) -> Stiffness<f64> {
    stiffness.plus(&Stiffness::of_parts(Sym3::identity(mass), Sym3::identity(mass * length * length)))
}
