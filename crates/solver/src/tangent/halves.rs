//! A chain is eliminated from both its ends, its two halves side by side in vector registers.

use super::node::{Factor, Left, Sides, Terms, column, set_column};
use super::problem::Problem;
use super::sweep::Sweep;
use crate::kernel::Spatial;
use crate::kernel::lane::{Both, Real};
use crate::topology::{Node, Topology};

/// Memory for the two halves of a chain; empty where there is none.
#[derive(Clone, Debug)]
pub(super) struct Halves<T> {
    /// One entry a pair of nodes.
    factors: Vec<Factor<Both<T>>>,
    sides: Vec<Sides<Both<T>, 1>>,
    /// Where the two nodes of a pair were eliminated one by one, as a body is held or had to be made heavier, the place of the
    /// first one's factor among those of the sweep, which that of the second follows.
    apart: Vec<Option<usize>>,
}

impl<T: Real> Halves<T> {
    /// Where lanes fill the registers already, a chain is eliminated node by node, with the same bits.
    pub(super) fn new(topology: &Topology) -> Self {
        let fold = if T::LANES == 1 { topology.fold } else { 0 };
        let sides = vec![[[[Both::zero(); 1]; 3]; 2]; fold];
        Self { factors: vec![Factor::zero(); fold], sides, apart: vec![None; fold] }
    }

    /// The first node of both halves, and how many they are.
    pub(super) fn of(&self, topology: &Topology) -> (usize, usize) {
        let (nodes, pairs) = (topology.elimination.as_deref().map_or(0, <[Node]>::len), self.factors.len());
        // Of a chain the last node is the root, and one more may come first.
        if pairs > 0 { (nodes - 1 - 2 * pairs, 2 * pairs) } else { (0, 0) }
    }

    /// Solves the equations of a problem without a far body in the lanes in which it can be: see [`Sweep::solved`].
    #[inline(always)]
    pub(super) fn solve(
        &mut self,
        sweep: &mut Sweep<T, 1>,
        problem: &Problem<'_, T>,
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        let (nodes, fold, first) = self.places(problem);
        sweep.begin(problem);
        sweep.up(problem, 0..first);
        if fold > 0 {
            self.up(sweep, problem, first);
        }
        sweep.up(problem, first + 2 * fold..nodes);
        sweep.end(problem);
        if sweep.is_solved() {
            self.substitute(sweep, problem, corrections, multipliers);
        }
    }

    /// Solves for other right-hand sides of the last problem.
    #[inline(always)]
    pub(super) fn solve_again(
        &mut self,
        sweep: &mut Sweep<T, 1>,
        problem: &Problem<'_, T>,
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        let (nodes, fold, first) = self.places(problem);
        sweep.begin_carrying();
        sweep.carry(problem, 0..first);
        if fold > 0 {
            self.carry(sweep, problem, first);
        }
        sweep.carry(problem, first + 2 * fold..nodes);
        sweep.end_carrying(problem);
        self.substitute(sweep, problem, corrections, multipliers);
    }

    /// Number of nodes, of pairs of them, and the first node of a pair.
    #[inline(always)]
    fn places(&self, problem: &Problem<'_, T>) -> (usize, usize, usize) {
        (problem.nodes().len(), self.factors.len(), self.of(problem.topology).0)
    }

    /// The way down.
    #[inline(always)]
    fn substitute(
        &self,
        sweep: &mut Sweep<T, 1>,
        problem: &Problem<'_, T>,
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
        let (nodes, fold, first) = self.places(problem);
        let numbers = sweep.first_movements(problem, corrections);
        sweep.down(problem, first + 2 * fold..nodes, &numbers, corrections, multipliers);
        if fold > 0 {
            self.down(sweep, problem, first, corrections, multipliers);
        }
        sweep.down(problem, 0..first, &numbers, corrections, multipliers);
    }

    /// Eliminates both halves, whose nodes begin at `first`.
    #[inline(always)]
    fn up(&mut self, sweep: &mut Sweep<T, 1>, problem: &Problem<'_, T>, first: usize) {
        let fold = self.factors.len();
        let nodes = problem.nodes();
        let start = |sweep: &Sweep<T, 1>, node: &Node| match node.follows {
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
    fn carry(&mut self, sweep: &mut Sweep<T, 1>, problem: &Problem<'_, T>, first: usize) {
        let fold = self.factors.len();
        let nodes = problem.nodes();
        let start = |sweep: &Sweep<T, 1>, node: &Node| match node.follows {
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

    /// How bodies follow each other in the system that has been solved: see [`Sweep::each_follower`].
    #[inline(always)]
    pub(super) fn each_follower(
        &self,
        sweep: &Sweep<T, 1>,
        problem: &Problem<'_, T>,
        see: &mut impl FnMut(&Node, [[Spatial<T>; 6]; 2]),
    ) {
        let (count, fold, first) = self.places(problem);
        let nodes = problem.nodes();
        sweep.each_follower(problem, 0..first, see);
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
        sweep.each_follower(problem, first + 2 * fold..count, see);
    }

    /// Substitutes in both halves.
    #[inline(always)]
    fn down(
        &self,
        sweep: &mut Sweep<T, 1>,
        problem: &Problem<'_, T>,
        first: usize,
        corrections: &mut [Spatial<T>],
        multipliers: &mut [Spatial<T>],
    ) {
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
