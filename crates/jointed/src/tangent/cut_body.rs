//! Bodies that a node sees as held: those that are, and the far one of a ring, which comes last.

use super::node::{Factor, Left, Sides, Terms, column, set_column, take_row_off};
use super::problem::Problem;
use super::stiffness::Stiffness;
use super::tree_elimination::TreeElimination;
use crate::topology::Node;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Sym3;

impl<T: Real, const M: usize> TreeElimination<T, M> {
    /// What a joint adds to its inner body, whose outer body is held or comes last.
    #[cold]
    pub(super) fn hang(&mut self, problem: &Problem<'_, T>, node: &Node, terms: &Terms<T>) -> Left<T, M> {
        let ([stretch, bend], exists) = problem.hold(node, terms);
        self.solved = exists.select(self.solved, exists);
        let pull = |x: Spatial<T>| Spatial { linear: stretch.apply(x.linear), angular: bend.apply(x.angular) };
        let spring = Stiffness::of_parts(stretch, bend);
        let force = pull(terms.rhs);
        let mut added = Left::new(spring.seen(terms.arms[1]), terms.on_inner(force));
        let outer = node.outer as usize;
        if !problem.is_held(node.outer) {
            for k in 0..6 {
                let mut unit = [T::zero(); 6];
                unit[k] = T::splat(1.0);
                let c = terms.of_outer(Spatial::from_array(unit));
                let mut on_inner = Spatial::zero().plus(pull(c), T::splat(-1.0));
                on_inner.angular += terms.coupled(c.angular);
                set_column(&mut added.forces, 1 + k, terms.on_inner(on_inner));
            }
            let own = Left::new(spring.seen(terms.arms[0]), terms.on_outer(force));
            self.left[outer] = self.left[outer].plus(&own);
        }
        added
    }

    /// What the elimination of a node leaves of the far body. `forces` are those on the outer body, in the joint's rows.
    #[inline(always)]
    pub(super) fn change_far(
        &mut self,
        problem: &Problem<'_, T>,
        (factor, sides): (&Factor<T>, &Sides<T, M>),
        terms: &Terms<T>,
        forces: &[[T; M]; 6],
    ) {
        let Some(far) = problem.far else { return };
        let left = &mut self.left[far];
        for (part, alone) in factor.parts.iter().zip(sides) {
            for (k, alone) in alone.iter().enumerate() {
                take_row_off(left, alone, part.weight(k));
            }
        }
        for (rhs, row) in terms.rhs.to_array().into_iter().zip(forces) {
            for (own, &x) in left.forces.iter_mut().zip(&row[1..]) {
                own[0] += rhs * x;
            }
        }
    }

    /// Adds to the far body what a node adds to its inner body, which it is.
    #[cold]
    pub(super) fn close(&mut self, added: &Left<T, M>, far: usize) {
        let f = |r: usize, c: usize| added.forces[r][1 + c];
        let both = |r: usize, c: usize| -f(r, c) - f(c, r);
        let corner = |k: usize| Sym3([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(r, c)| both(k + r, k + c)));
        let mixed = [0, 1, 2].map(|r| [3, 4, 5].map(|c| both(r, c)));
        let crossed = Stiffness { translation: corner(0), mixed, turning: corner(3) };
        let own = Left::new(added.stiffness.plus(&crossed), column(&added.forces, 0));
        self.left[far] = self.left[far].plus(&own);
    }
}
