//! The way up the tree of joints, which eliminates node after node, and the way down, which substitutes. Forces that come later
//! go up once more, through the factors.

use super::cholesky::Cholesky;
use super::node::{Factor, Left, Sides, Terms, column, set_column, take_row_off};
use super::problem::Problem;
use super::stiffness::Stiffness;
use crate::topology::{Leaves, Node, Topology};
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Sym3;

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
pub(super) struct TreeElimination<T, const M: usize> {
    /// One entry a body.
    pub(super) left: Vec<Left<T, M>>,
    /// One entry a node that is eliminated by itself, in their order; then those of the halves of a chain that came apart.
    factors: Vec<(Factor<T>, Sides<T, M>)>,
    /// The first node of both halves of a chain, and how many they are.
    halves: (usize, usize),
    /// Bodies that are left alone, in the order of the roots.
    roots: Vec<Root<T, M>>,
    /// Of those, how many a pass has not come to yet.
    roots_left: usize,
    /// Bodies that had to be made heavier, a lane each.
    pub(super) mended: T,
    /// Not negative as long as a lane could be solved.
    pub(super) solved: T,
    /// Whether what is not at a minimum is left as it is.
    pub(super) is_left: bool,
    /// Then, the eigenvalues whose sign is not that of a minimum, in all lanes.
    pub(super) wrong: usize,
}

/// A body that is left alone: its movement, and the factor of its block where it is free.
#[derive(Clone, Copy, Debug)]
struct Root<T, const M: usize> {
    movement: [[T; M]; 6],
    factor: Option<Cholesky<T>>,
}

impl<T: Real, const M: usize> TreeElimination<T, M> {
    /// Memory for all nodes but those of the halves of a chain, so many from the first on.
    pub(super) fn new(topology: &Topology, halves: (usize, usize)) -> Self {
        let zero = Stiffness::of_parts(Sym3::zero(), Sym3::zero());
        let nodes = topology.elimination.as_deref().map_or(0, <[Node]>::len);
        let ends = topology.elimination.iter().flatten().filter(|node| node.leaves == Leaves::Nothing).count();
        Self {
            left: vec![Left::new(zero, Spatial::zero()); topology.bodies()],
            factors: vec![(Factor::zero(), [[[T::zero(); M]; 3]; 2]); nodes - halves.1],
            halves,
            roots: Vec::with_capacity(ends + 1 + topology.lone.len()),
            roots_left: 0,
            mended: T::zero(),
            solved: T::zero(),
            is_left: false,
            wrong: 0,
        }
    }

    /// Solves the equations of a problem in the lanes in which it can be: see [`Self::solved`].
    #[inline(always)]
    pub(super) fn solve(
        &mut self,
        problem: &Problem<'_, T>,
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        self.begin(problem);
        let nodes = problem.nodes().len();
        self.up(problem, 0..nodes);
        self.end(problem);
        if !self.is_solved() {
            return;
        }
        let numbers = self.first_movements(problem, corrections);
        self.down(problem, 0..nodes, &numbers, corrections, multipliers);
    }

    #[inline(always)]
    pub(super) fn begin(&mut self, problem: &Problem<'_, T>) {
        (self.mended, self.solved, self.wrong) = (T::zero(), T::zero(), 0);
        self.roots.clear();
        self.factors.truncate(problem.nodes().len() - self.halves.1);
        if let Some(far) = problem.far {
            self.left[far] = problem.fresh(far as u32);
        }
    }

    /// Whether any lane could be solved so far.
    #[inline(always)]
    pub(super) fn is_solved(&self) -> bool {
        (0..T::LANES).any(|lane| self.solved.lane(lane) >= 0.0)
    }

    /// Eliminates nodes in turn, as long as any lane can be solved.
    #[inline(always)]
    pub(super) fn up(&mut self, problem: &Problem<'_, T>, nodes: std::ops::Range<usize>) {
        for k in nodes {
            if !self.is_solved() {
                return;
            }
            self.eliminate(problem, k, self.place(k));
        }
    }

    /// Place of the factor of a node that is eliminated by itself.
    #[inline(always)]
    fn place(&self, k: usize) -> usize {
        let (first, count) = self.halves;
        if k < first { k } else { k - count }
    }

    /// Eliminates bodies without joints, and the far one.
    pub(super) fn end(&mut self, problem: &Problem<'_, T>) {
        if !self.is_solved() {
            return;
        }
        for &body in &problem.topology.lone {
            self.left[body as usize] = problem.fresh(body);
            self.eliminate_root(problem, body, T::splat(1.0));
        }
        if let Some(far) = problem.far {
            self.eliminate_root(problem, far as u32, problem.equations.joints[0].length);
        }
    }

    /// Eliminates the outer body and the joint of a node, whose factor has its place, and of a root what is left.
    #[inline(always)]
    fn eliminate(&mut self, problem: &Problem<'_, T>, k: usize, place: usize) {
        let node = problem.nodes()[k];
        let terms = problem.terms(&node);
        let inner_is_far = problem.far == Some(node.inner as usize);
        let added = match problem.is_apart(node.outer) {
            true => self.hang(problem, &node, &terms),
            false => self.fold_in(problem, place, &node, &terms),
        };
        if inner_is_far {
            self.close(&added, node.inner as usize);
        } else if !problem.is_held(node.inner) {
            let inner = node.inner as usize;
            self.left[inner] = if node.resumes { self.left[inner] } else { problem.fresh(node.inner) }.plus(&added);
        }
        if node.leaves == Leaves::Nothing && !inner_is_far {
            self.eliminate_root(problem, node.inner, problem.joint(&node).length);
        }
    }

    /// [`Self::eliminate`] of a node of the halves of a chain, where it is rare; returns the place of its factor.
    #[cold]
    pub(super) fn eliminate_one(&mut self, problem: &Problem<'_, T>, k: usize) -> usize {
        let place = self.factors.len();
        self.factors.push((Factor::zero(), [[[T::zero(); M]; 3]; 2]));
        self.eliminate(problem, k, place);
        place
    }

    /// Eliminates the outer body and the joint of a node; returns what that adds to the inner body.
    #[inline(always)]
    fn fold_in(&mut self, problem: &Problem<'_, T>, place: usize, node: &Node, terms: &Terms<T>) -> Left<T, M> {
        let outer = if node.follows { self.left[node.outer as usize] } else { problem.fresh(node.outer) };
        let mut forces = [[T::zero(); M]; 6];
        for c in 0..M {
            set_column(&mut forces, c, terms.on_outer(column(&outer.forces, c)));
        }
        let mut eliminated = Factor::new(terms, &outer.stiffness, &forces);
        if !eliminated.0.is_positive() {
            eliminated = self.mend(problem, node, terms, (&outer.stiffness, &forces), eliminated);
        }
        let (factor, sides, added) = eliminated;
        if M > 1 {
            self.change_far(problem, (&factor, &sides), terms, &forces);
        }
        self.factors[place] = (factor, sides);
        added
    }

    /// Makes the outer body of a node heavier in the lanes in which it is not at a minimum, until it is, or counts what is not.
    #[cold]
    fn mend(
        &mut self,
        problem: &Problem<'_, T>,
        node: &Node,
        terms: &Terms<T>,
        (outer, forces): (&Stiffness<T>, &[[T; M]; 6]),
        mut last: (Factor<T>, Sides<T, M>, Left<T, M>),
    ) -> (Factor<T>, Sides<T, M>, Left<T, M>) {
        let length = problem.joint(node).length;
        let mut next = first_shift(problem.equations.bodies[node.outer as usize].mass, length, outer);
        let mut outer = *outer;
        for trial in 0..TRIALS {
            if trial > 0 {
                last = T::dispatch(
                    #[inline(always)]
                    || Factor::new(terms, &outer, forces),
                );
            }
            let (factor, solved) = (&last.0, self.solved);
            let mut waiting = T::splat(-1.0);
            for lane in (0..T::LANES).filter(|&lane| solved.lane(lane) >= 0.0) {
                if self.is_left {
                    self.wrong += factor.negative_in(lane);
                    if !factor.is_regular_in(lane) {
                        self.solved.set_lane(lane, -1.0);
                    }
                } else if !factor.is_positive_in(lane) {
                    waiting.set_lane(lane, 1.0);
                    if trial == 0 {
                        self.mended.set_lane(lane, self.mended.lane(lane) + 1.0);
                    }
                }
            }
            if (0..T::LANES).all(|lane| waiting.lane(lane) < 0.0) {
                return last;
            }
            if trial + 1 == TRIALS {
                self.solved = waiting.select(T::splat(-1.0), self.solved);
            }
            outer = heavier(&outer, next, length).select(waiting, &outer);
            next = next * T::splat(SHIFT_GROWTH);
        }
        last
    }

    /// Eliminates a body that is left alone, one whose rows have such a `length`.
    fn eliminate_root(&mut self, problem: &Problem<'_, T>, body: u32, length: T) {
        if problem.is_held(body) {
            self.roots.push(Root { movement: [[T::zero(); M]; 6], factor: None });
            return;
        }
        let mut left = self.left[body as usize];
        let mut next = first_shift(problem.equations.bodies[body as usize].mass, length, &left.stiffness);
        let (mut factor, mut exists) = Cholesky::new(&left.stiffness, self.is_left);
        for trial in 0..TRIALS {
            let solved = self.solved;
            let waiting = || (0..T::LANES).filter(|&lane| exists.lane(lane) < 0.0 && solved.lane(lane) >= 0.0);
            if waiting().next().is_none() {
                break;
            }
            for lane in waiting() {
                if self.is_left || trial + 1 == TRIALS {
                    self.solved.set_lane(lane, -1.0);
                } else if trial == 0 {
                    self.mended.set_lane(lane, self.mended.lane(lane) + 1.0);
                }
            }
            left.stiffness = left.stiffness.select(exists, &heavier(&left.stiffness, next, length));
            next = next * T::splat(SHIFT_GROWTH);
            (factor, exists) = Cholesky::new(&left.stiffness, self.is_left);
        }
        let (rows, pivots) = factor.forward(&left.forces);
        if self.is_left {
            let negative = |pivot: &T| (0..T::LANES).filter(|&lane| pivot.lane(lane) < 0.0).count();
            self.wrong += pivots.iter().map(negative).sum::<usize>();
        }
        if let Some(far) = problem.far.filter(|&far| far != body as usize) {
            for (row, pivot) in rows.iter().zip(pivots) {
                take_row_off(&mut self.left[far], row, T::splat(1.0) / pivot);
            }
        }
        self.roots.push(Root { movement: factor.backward(rows), factor: Some(factor) });
    }

    /// The movements of the far body and of those without joints, and the numbers that all columns are for.
    pub(super) fn first_movements(&mut self, problem: &Problem<'_, T>, corrections: &mut [Spatial<T>]) -> [T; M] {
        let mut numbers = [T::zero(); M];
        numbers[0] = T::splat(1.0);
        self.roots_left = self.roots.len();
        if let Some(far) = problem.far {
            self.substitute_root(far, &numbers, corrections);
            numbers[1..].copy_from_slice(&corrections[far].to_array());
        }
        for &body in problem.topology.lone.iter().rev() {
            self.substitute_root(body as usize, &numbers, corrections);
        }
        numbers
    }

    /// The movement of the last root that has not been substituted yet.
    fn substitute_root(&mut self, body: usize, numbers: &[T; M], corrections: &mut [Spatial<T>]) {
        self.roots_left -= 1;
        if let Some(root) = self.roots.get(self.roots_left) {
            let sum = |row: [T; M]| row.into_iter().zip(numbers).fold(T::zero(), |sum, (x, &number)| sum + x * number);
            corrections[body] = Spatial::from_array(root.movement.map(sum));
        }
    }

    /// Substitutes in nodes that are eliminated by themselves, in turn from the last.
    #[inline(always)]
    pub(super) fn down(
        &mut self,
        problem: &Problem<'_, T>,
        nodes: std::ops::Range<usize>,
        numbers: &[T; M],
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        for k in nodes.rev() {
            self.substitute(problem, (k, self.place(k)), numbers, corrections, multipliers);
        }
    }

    /// Substitutes in a node, whose factor has its place.
    #[inline(always)]
    pub(super) fn substitute(
        &mut self,
        problem: &Problem<'_, T>,
        (k, place): (usize, usize),
        numbers: &[T; M],
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        let node = problem.nodes()[k];
        let (outer, inner) = (node.outer as usize, node.inner as usize);
        if node.leaves == Leaves::Nothing && problem.far != Some(inner) {
            self.substitute_root(inner, numbers, corrections);
        }
        let terms = problem.terms(&node);
        let at_inner = corrections[inner];
        let transmitted = if problem.is_apart(node.outer) {
            let one = T::splat(1.0);
            let at_outer = terms.of_outer(corrections[outer]);
            let yielded = terms.of_inner(at_inner).plus(at_outer, one).plus(terms.rhs, -one);
            let ([stretch, bend], _) = problem.hold(&node, &terms);
            Spatial { linear: stretch.apply(yielded.linear), angular: bend.apply(yielded.angular) }
        } else {
            let (factor, sides) = &self.factors[place];
            let [moved, transmitted] = factor.solve(&terms, sides, at_inner, numbers);
            corrections[outer] = moved;
            transmitted
        };
        multipliers[node.joint as usize] = -transmitted;
    }
}

impl<T: Real> TreeElimination<T, 1> {
    /// Begins to take other right-hand sides of a system that has been solved.
    pub(super) fn begin_carrying(&mut self) {
        self.roots_left = 0;
    }

    /// Takes them at nodes in turn.
    #[inline(always)]
    pub(super) fn carry(&mut self, problem: &Problem<'_, T>, nodes: std::ops::Range<usize>) {
        for k in nodes {
            self.carry_one(problem, k, self.place(k));
        }
    }

    /// Takes them at a node, whose factor has its place.
    #[inline(always)]
    pub(super) fn carry_one(&mut self, problem: &Problem<'_, T>, k: usize, place: usize) {
        let node = problem.nodes()[k];
        let terms = problem.terms(&node);
        let [outer, inner] = [node.outer as usize, node.inner as usize];
        let added = if problem.is_apart(node.outer) {
            let ([stretch, bend], _) = problem.hold(&node, &terms);
            let rhs = terms.rhs;
            terms.on_inner(Spatial { linear: stretch.apply(rhs.linear), angular: bend.apply(rhs.angular) })
        } else {
            let own = if node.follows { self.carried(outer) } else { problem.force(node.outer) };
            let (factor, own_sides) = &mut self.factors[place];
            let (sides, added) = factor.carry(&terms, own);
            *own_sides = sides;
            added
        };
        if !problem.is_held(node.inner) {
            let own = if node.resumes { self.carried(inner) } else { problem.force(node.inner) };
            self.set_carried(inner, own.plus(added, T::splat(1.0)));
        }
        if node.leaves == Leaves::Nothing {
            self.carry_to_root(inner);
        }
    }

    /// How bodies follow each other in the system that has been solved, node by node.
    #[inline(always)]
    pub(super) fn each_follower(
        &self,
        problem: &Problem<'_, T>,
        nodes: std::ops::Range<usize>,
        see: &mut impl FnMut(&Node, [[Spatial<T>; 6]; 2]),
    ) {
        for k in nodes {
            self.follower(problem, k, self.place(k), see);
        }
    }

    /// The same of a node whose factor has its place.
    #[inline(always)]
    pub(super) fn follower(
        &self,
        problem: &Problem<'_, T>,
        k: usize,
        place: usize,
        see: &mut impl FnMut(&Node, [[Spatial<T>; 6]; 2]),
    ) {
        let node = &problem.nodes()[k];
        if !problem.is_held(node.outer) {
            see(node, self.factors[place].0.follows(&problem.terms(node)));
        }
    }

    /// The bodies that are left alone and move, and how they answer forces on themselves and beyond.
    pub(super) fn each_root(&self, problem: &Problem<'_, T>, see: &mut impl FnMut(u32, [Spatial<T>; 6])) {
        let ends = problem.nodes().iter().filter(|node| node.leaves == Leaves::Nothing).map(|node| node.inner);
        let lone = problem.topology.lone.iter().copied();
        for (body, root) in ends.chain(lone).zip(&self.roots) {
            if let Some(factor) = &root.factor {
                see(body, factor.inverse());
            }
        }
    }

    /// Ends that: bodies without joints have no node.
    pub(super) fn end_carrying(&mut self, problem: &Problem<'_, T>) {
        for &body in &problem.topology.lone {
            self.set_carried(body as usize, problem.force(body));
            self.carry_to_root(body as usize);
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
    pub(super) fn carried(&self, body: usize) -> Spatial<T> {
        column(&self.left[body].forces, 0)
    }

    #[inline(always)]
    pub(super) fn set_carried(&mut self, body: usize, force: Spatial<T>) {
        set_column(&mut self.left[body].forces, 0, force);
    }
}

/// By how much a body is made heavier at first.
fn first_shift<T: Real>(mass: T, length: T, Stiffness { translation, turning, .. }: &Stiffness<T>) -> T {
    let largest = |Sym3([xx, yy, zz, ..]): &Sym3<T>| xx.abs().max(yy.abs()).max(zz.abs());
    let own = largest(translation).max(largest(turning) / (length * length));
    (mass * T::splat(FIRST_SHIFT)).max(own * T::splat(FIRST_SHARE))
}

/// The stiffness of a body that is heavier by so much mass.
fn heavier<T: Real>(stiffness: &Stiffness<T>, mass: T, length: T) -> Stiffness<T> {
    stiffness.plus(&Stiffness::of_parts(Sym3::identity(mass), Sym3::identity(mass * length * length)))
}
