//! A chain is eliminated from both its ends, its two halves side by side in vector registers.

use std::ops::Range;

use super::node::{Factor, Left, Sides, Terms, column, set_column};
use super::problem::Problem;
use super::tree_elimination::TreeElimination;
use crate::topology::{Node, Topology};
use kernels::Spatial;
use kernels::lane::{Both, Real};

/// Memory for the two halves of a chain; empty where there is none.
#[derive(Clone, Debug)]
pub(super) struct TwoSided<T> {
    /// One entry a pair of nodes.
    factors: Vec<Factor<Both<T>>>,
    sides: Vec<Sides<Both<T>, 1>>,
    /// Where the two nodes of a pair were eliminated one by one, as a body is held or had to be made heavier, the place of the
    /// first one's factor among those of the sweep, which that of the second follows.
    apart: Vec<Option<usize>>,
}

impl<T: Real> TwoSided<T> {
    /// Where lanes fill the registers already, a chain is eliminated node by node, with the same bits.
    pub(super) fn new(topology: &Topology) -> Self {
        let fold = if T::IN_LANES { 0 } else { topology.fold };
        let sides = vec![[[[Both::zero(); 1]; 3]; 2]; fold];
        Self { factors: vec![Factor::zero(); fold], sides, apart: vec![None; fold] }
    }

    /// The first node of both halves, and how many they are.
    pub(super) fn of(&self, topology: &Topology) -> (usize, usize) {
        let (nodes, pairs) = (topology.elimination.as_deref().map_or(0, <[Node]>::len), self.factors.len());
        // Of a chain the last node is the root, and one more may come first.
        if pairs > 0 { (nodes - 1 - 2 * pairs, 2 * pairs) } else { (0, 0) }
    }

    /// Solves the equations of a problem without a far body in the lanes in which it can be: see [`TreeElimination::solved`].
    #[inline(always)]
    pub(super) fn solve(
        &mut self,
        sweep: &mut TreeElimination<T, 1>,
        problem: &Problem<'_, T>,
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        sweep.begin(problem);
        for (is_after, nodes) in self.alone(problem) {
            if !T::IN_LANES {
                self.up(sweep, problem, is_after);
            }
            sweep.up(problem, nodes);
        }
        sweep.end(problem);
        if sweep.is_solved() {
            self.substitute(sweep, problem, corrections, multipliers);
        }
    }

    /// Solves for other right-hand sides of the last problem.
    #[inline(always)]
    pub(super) fn solve_again(
        &mut self,
        sweep: &mut TreeElimination<T, 1>,
        problem: &Problem<'_, T>,
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        sweep.begin_carrying();
        for (is_after, nodes) in self.alone(problem) {
            if !T::IN_LANES {
                self.carry(sweep, problem, is_after);
            }
            sweep.carry(problem, nodes);
        }
        sweep.end_carrying(problem);
        self.substitute(sweep, problem, corrections, multipliers);
    }

    /// The nodes that are eliminated by themselves: those before the pairs and, with `true`, those after them.
    #[inline(always)]
    fn alone(&self, problem: &Problem<'_, T>) -> [(bool, Range<usize>); 2] {
        let (first, count) = self.of(problem.topology);
        [(false, 0..first), (true, first + count..problem.nodes().len())]
    }

    /// The first node of the pairs, if it is their turn and there are any.
    #[inline(always)]
    fn first(&self, problem: &Problem<'_, T>, is_their_turn: bool) -> Option<usize> {
        (is_their_turn && !self.factors.is_empty()).then(|| self.of(problem.topology).0)
    }

    /// The way down.
    #[inline(always)]
    fn substitute(
        &self,
        sweep: &mut TreeElimination<T, 1>,
        problem: &Problem<'_, T>,
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        let numbers = sweep.first_movements(problem, corrections);
        for (is_after, nodes) in self.alone(problem).into_iter().rev() {
            if !T::IN_LANES {
                self.down(sweep, problem, !is_after, corrections, multipliers);
            }
            sweep.down(problem, nodes, &numbers, corrections, multipliers);
        }
    }

    /// Eliminates both halves.
    #[inline(always)]
    fn up(&mut self, sweep: &mut TreeElimination<T, 1>, problem: &Problem<'_, T>, is_their_turn: bool) {
        let Some(first) = self.first(problem, is_their_turn) else { return };
        let fold = self.factors.len();
        let nodes = problem.nodes();
        let start = |sweep: &TreeElimination<T, 1>, node: &Node| match node.follows {
            true => sweep.left[node.outer as usize],
            false => problem.fresh(node.outer),
        };
        let mut carried = Left::both(&start(sweep, &nodes[first]), &start(sweep, &nodes[first + fold]));
        let mut last = [0; 2];
        for k in 0..fold {
            let pair = [first + k, first + fold + k];
            let [a, b] = [&nodes[pair[0]], &nodes[pair[1]]];
            last = [a.inner as usize, b.inner as usize];
            if !(problem.is_held(a.outer) || problem.is_held(b.outer)) {
                let terms = Terms::both(&problem.terms(a), &problem.terms(b));
                let mut forces = carried.forces;
                set_column(&mut forces, 0, terms.on_outer(column(&carried.forces, 0)));
                let (factor, sides, added) = Factor::new(&terms, &carried.stiffness, &forces);
                if factor.is_positive() {
                    (self.factors[k], self.sides[k]) = (factor, sides);
                    self.apart[k] = None;
                    carried = Left::both(&problem.fresh(a.inner), &problem.fresh(b.inner)).plus(&added);
                    continue;
                }
            }
            self.apart[k] = None;
            for (side, node) in [a, b].into_iter().enumerate() {
                sweep.left[node.outer as usize] = carried.one(side);
                let place = sweep.eliminate_one(problem, pair[side]);
                self.apart[k] = self.apart[k].or(Some(place));
                if !sweep.is_solved() {
                    return;
                }
            }
            carried = Left::both(&sweep.left[last[0]], &sweep.left[last[1]]);
        }
        for (side, body) in last.into_iter().enumerate() {
            sweep.left[body] = carried.one(side);
        }
    }

    /// Takes other right-hand sides in both halves.
    #[inline(always)]
    fn carry(&mut self, sweep: &mut TreeElimination<T, 1>, problem: &Problem<'_, T>, is_their_turn: bool) {
        let Some(first) = self.first(problem, is_their_turn) else { return };
        let fold = self.factors.len();
        let nodes = problem.nodes();
        let start = |sweep: &TreeElimination<T, 1>, node: &Node| match node.follows {
            true => sweep.carried(node.outer as usize),
            false => problem.force(node.outer),
        };
        let mut carried = Spatial::both(start(sweep, &nodes[first]), start(sweep, &nodes[first + fold]));
        let mut last = [0; 2];
        for k in 0..fold {
            let pair = [first + k, first + fold + k];
            let [a, b] = [&nodes[pair[0]], &nodes[pair[1]]];
            last = [a.inner as usize, b.inner as usize];
            if let Some(place) = self.apart[k] {
                for (side, node) in [a, b].into_iter().enumerate() {
                    sweep.set_carried(node.outer as usize, carried.one(side));
                    sweep.carry_one(problem, pair[side], place + side);
                }
                carried = Spatial::both(sweep.carried(last[0]), sweep.carried(last[1]));
            } else {
                let terms = Terms::both(&problem.terms(a), &problem.terms(b));
                let (sides, added) = self.factors[k].carry(&terms, carried);
                self.sides[k] = sides;
                carried = Spatial::both(problem.force(a.inner), problem.force(b.inner)).plus(added, Both::splat(1.0));
            }
        }
        for (side, body) in last.into_iter().enumerate() {
            sweep.set_carried(body, carried.one(side));
        }
    }

    /// How bodies follow each other in the system that has been solved: see [`TreeElimination::each_follower`].
    #[inline(always)]
    pub(super) fn each_follower(
        &self,
        sweep: &TreeElimination<T, 1>,
        problem: &Problem<'_, T>,
        see: &mut impl FnMut(&Node, [[Spatial<T>; 6]; 2]),
    ) {
        for (is_after, nodes) in self.alone(problem) {
            if !T::IN_LANES {
                self.each_follower_of_pairs(sweep, problem, is_after, see);
            }
            sweep.each_follower(problem, nodes, see);
        }
    }

    #[inline(always)]
    fn each_follower_of_pairs(
        &self,
        sweep: &TreeElimination<T, 1>,
        problem: &Problem<'_, T>,
        is_their_turn: bool,
        see: &mut impl FnMut(&Node, [[Spatial<T>; 6]; 2]),
    ) {
        let Some(first) = self.first(problem, is_their_turn) else { return };
        let fold = self.factors.len();
        let nodes = problem.nodes();
        for k in 0..fold {
            let pair = [first + k, first + fold + k];
            if let Some(place) = self.apart[k] {
                for (side, k) in pair.into_iter().enumerate() {
                    sweep.follower(problem, k, place + side, see);
                }
                continue;
            }
            let [a, b] = pair.map(|k| &nodes[k]);
            let columns = self.factors[k].follows(&Terms::both(&problem.terms(a), &problem.terms(b)));
            for (side, node) in [a, b].into_iter().enumerate() {
                see(node, columns.map(|columns| columns.map(|column| column.one(side))));
            }
        }
    }

    /// Substitutes in both halves.
    #[inline(always)]
    fn down(
        &self,
        sweep: &mut TreeElimination<T, 1>,
        problem: &Problem<'_, T>,
        is_their_turn: bool,
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        let Some(first) = self.first(problem, is_their_turn) else { return };
        let fold = self.factors.len();
        let nodes = problem.nodes();
        let movement = |corrections: &[Spatial<T>], bodies: [u32; 2]| {
            let [a, b] = bodies.map(|body| corrections[body as usize]);
            Spatial::both(a, b)
        };
        let mut inner = movement(corrections, [nodes[first + fold - 1].inner, nodes[first + 2 * fold - 1].inner]);
        for k in (0..fold).rev() {
            let pair = [first + k, first + fold + k];
            let [a, b] = [&nodes[pair[0]], &nodes[pair[1]]];
            if let Some(place) = self.apart[k] {
                for (side, k) in pair.into_iter().enumerate() {
                    sweep.substitute(problem, (k, place + side), &[T::splat(1.0)], corrections, multipliers);
                }
                inner = movement(corrections, [a.outer, b.outer]);
                continue;
            }
            let terms = Terms::both(&problem.terms(a), &problem.terms(b));
            let [moved, transmitted] = self.factors[k].solve(&terms, &self.sides[k], inner, &[Both::splat(1.0)]);
            for (side, node) in [a, b].into_iter().enumerate() {
                corrections[node.outer as usize] = moved.one(side);
                multipliers[node.joint as usize] = -transmitted.one(side);
            }
            inner = moved;
        }
    }
}
