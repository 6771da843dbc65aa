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
//! (the primal-dual relative of the Riccati recursion of optimal control; Rao, Wright and Rawlings 1998). J_o has an inverse,
//! so that a node takes six rows, not twelve (`node.rs`): with a root `a~ = R R^T` and `P = J_o^-T K_o J_o^-1`,
//! `I + R^T P R` has as many negative eigenvalues as Z has beyond six (both have the same determinant up to its sign, and no
//! eigenvalue of either changes its sign alone as a~ goes to 0).
//!
//! The matrix has the inertias of its Z and of what is left of the roots' bodies together (Haynsworth 1968). At a minimum of
//! the energy each Z has six positive and six negative eigenvalues, because bodies and joints beyond a node are at a minimum
//! with the inner body held, and the six rows are positive. Of a ring one body is left to the end, the far one, to which each
//! node may then be coupled besides its inner body; Z sees it as held. So where the six rows are not positive the body is
//! mended: it is made heavier, until they are.

use super::Equations;
use super::problem::Problem;
use super::tree_elimination::TreeElimination;
use super::two_sided::TwoSided;
use crate::topology::Topology;
use crate::transfer::Columns;
use kernels::Spatial;
use kernels::lane::Real;

#[cfg(test)]
mod tests;

/// Memory of an elimination, and its result.
#[derive(Clone, Debug)]
pub struct Elimination<T = f64> {
    /// Who is joined to whom, with the far body as one that is held.
    topology: Topology,
    memory: Memory<T>,
    /// dp as (dx, dphi), one entry a body.
    pub corrections: Vec<Spatial<T>>,
    /// dlambda in world rows, one entry a joint.
    pub multipliers: Vec<Spatial<T>>,
    /// Bodies that had to be made heavier, a lane each.
    pub mended: T,
}

/// What is kept from the way up to the way down.
#[derive(Clone, Debug)]
enum Memory<T> {
    /// Without loops, the halves of a chain side by side.
    Tree(TreeElimination<T, 1>, TwoSided<T>),
    /// With a far body, the one without which there would be no loop: six more columns.
    Ring(TreeElimination<T, 7>, usize),
}

/// Joints of each free body to others, and the least number of loops that they close.
struct Loops {
    joints: Vec<usize>,
    least: usize,
}

impl Loops {
    fn new(topology: &Topology) -> Self {
        let mut joints = vec![0; topology.bodies()];
        let is_free = |body: &u32| !topology.fixed[*body as usize];
        let between = topology.joints.iter().filter(|ends| ends.iter().all(is_free));
        let count = between.map(|ends| ends.iter().for_each(|&body| joints[body as usize] += 1)).count();
        let bodies = topology.fixed.iter().filter(|fixed| !**fixed).count();
        Self { joints, least: (count + 1).saturating_sub(bodies) }
    }

    /// Whether no loop may be left without a body: it opens one fewer than it has joints, at most.
    fn may_go_with(&self, body: usize) -> bool {
        self.joints[body] > self.least
    }
}

impl<T: Real> Elimination<T> {
    /// Memory for systems of this connectivity; `None` where one body less would leave loops, and for any loop in lanes.
    pub fn new(topology: &Topology) -> Option<Self> {
        let without = |far: usize| {
            let mut fixed = topology.fixed.clone();
            fixed[far] = true;
            Some(Topology::new(topology.joints.clone(), fixed)).filter(|less| less.elimination.is_some())
        };
        let (topology, memory) = match topology.elimination {
            Some(_) => {
                let halves = TwoSided::new(topology);
                (topology.clone(), Memory::Tree(TreeElimination::new(topology, halves.of(topology)), halves))
            }
            None if T::IN_LANES => return None,
            None => {
                let loops = Loops::new(topology);
                let may_be_far = |far: &usize| loops.may_go_with(*far);
                let found = (0..topology.bodies()).filter(may_be_far).find_map(|far| Some((without(far)?, far)));
                let (topology, far) = found?;
                let memory = Memory::Ring(TreeElimination::new(&topology, (0, 0)), far);
                (topology, memory)
            }
        };
        let corrections = vec![Spatial::zero(); topology.bodies()];
        let multipliers = vec![Spatial::zero(); topology.joints.len()];
        Some(Self { topology, memory, corrections, multipliers, mended: T::zero() })
    }

    /// Solves the equations, lane by lane; returns a number that is not negative in the lanes in which it could. It cannot where
    /// a joint without compliance holds two bodies to each other that are both held, and where numbers are not finite.
    pub fn solve_lanes(&mut self, equations: &Equations<T>) -> T {
        self.solve_with(equations, false).0
    }

    /// Solves equations that differ from those of the last solve in their right-hand sides alone, by its factor; returns whether
    /// it could: rings have no such way.
    pub fn solve_again(&mut self, equations: &Equations<T>) -> bool {
        let Self { topology, memory, corrections, multipliers, .. } = self;
        let Memory::Tree(sweep, halves) = memory else { return false };
        let problem = Problem { topology, far: None, equations };
        T::dispatch(
            #[inline(always)]
            || halves.solve_again(sweep, &problem, corrections, multipliers),
        );
        true
    }

    /// Whether bodies form chains and trees, so that other right-hand sides can be solved for by the last factor.
    pub fn is_of_tree(&self) -> bool {
        matches!(self.memory, Memory::Tree(..))
    }

    /// Returns a number that is not negative where it could be solved, and how many eigenvalues have wrong signs.
    fn solve_with(&mut self, equations: &Equations<T>, is_left: bool) -> (T, usize) {
        let Self { topology, memory, corrections, multipliers, mended } = self;
        corrections.fill(Spatial::zero());
        T::dispatch(
            #[inline(always)]
            || match memory {
                Memory::Tree(sweep, halves) => {
                    let problem = Problem { topology, far: None, equations };
                    sweep.is_left = is_left;
                    halves.solve(sweep, &problem, corrections, multipliers);
                    *mended = sweep.mended;
                    (sweep.solved, sweep.wrong)
                }
                Memory::Ring(sweep, far) => {
                    // No code of rings in lanes.
                    if T::IN_LANES {
                        return (T::splat(-1.0), 0);
                    }
                    let problem = Problem { topology, far: Some(*far), equations };
                    sweep.is_left = is_left;
                    sweep.solve(&problem, corrections, multipliers);
                    *mended = sweep.mended;
                    (sweep.solved, sweep.wrong)
                }
            },
        )
    }
}

impl Elimination {
    /// How the bodies that move answer forces, by the factor of the last solve, of these equations: `see` gets each body, how it
    /// follows the one that comes before it, if one does, and its answer where that is held, column by column. Rings have no such order.
    pub fn each_answer(&self, equations: &Equations, see: &mut dyn FnMut(u32, Option<&Columns>, &Columns)) {
        let Memory::Tree(sweep, halves) = &self.memory else { return };
        let problem = Problem { topology: &self.topology, far: None, equations };
        sweep.each_root(&problem, &mut |body, answer| see(body, None, &answer));
        halves.each_follower(sweep, &problem, &mut |node, [follows, answer]| {
            let follows = (!problem.is_held(node.inner)).then_some(&follows);
            see(node.outer, follows, &answer);
        });
    }

    /// Solves the equations; returns whether it could: see [`Self::solve_lanes`].
    pub fn solve(&mut self, equations: &Equations) -> bool {
        self.solve_lanes(equations) >= 0.0
    }

    /// Solves the equations as they are, mending nothing. Returns how many eigenvalues have another sign than at a minimum
    /// of the energy: the directions in which it curves down. `None` where the matrix has no factor in this order of the
    /// bodies: it is singular, or next to it.
    pub fn solve_as_it_is(&mut self, equations: &Equations) -> Option<usize> {
        let (solved, wrong) = self.solve_with(equations, true);
        (solved >= 0.0).then_some(wrong)
    }
}
