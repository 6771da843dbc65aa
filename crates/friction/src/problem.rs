//! The contacts' linear complementarity problem with friction, over all contacts that may press.
//!
//! With z the impulses of the contacts in their own frames (normal, two tangents), W = J P J^T the Delassus operator of
//! what their impulses do to their gaps and slips, and c gap and slip without any change of z:
//!
//! ```text
//! w = c + W dz,   0 <= w_n  perpendicular to  z_n >= 0,   |z_t| <= mu z_n,   z_t against w_t where it slides
//! ```
//!
//! A sweep solves each contact in turn: projected block Gauss-Seidel (Daviet, Bertails-Descoubes and Boissieux 2011 solve
//! hair so; the friction cone at the level of positions is that of Macklin et al. 2014, section 6.1).

use std::ops::Range;

use kernels::dispatch::vectorized;
use kernels::lane::Real;

use super::cone::{Coulomb, Own, natural_residual};
use super::delassus::{Block3, Chunk, Delassus, Moved, Row};
use super::partition::Partition;

/// What a sweep knows of a contact.
#[derive(Clone, Copy, Debug)]
pub struct Unknown {
    /// Impulse times dt [N s^2]: normal, then two tangents.
    pub force: Row,
    /// Its value before the solve.
    pub before: Row,
    /// Gap less its target, and slip, if the impulse stays as it was before [m].
    pub free: Row,
    /// What friction is at most.
    pub friction: Coulomb,
    /// Length by which errors are measured [m].
    pub scale: f64,
}

/// The problem's matrix and its unknowns. Gaps and slips go with every change of an impulse.
#[derive(Default)]
pub struct Problem {
    unknowns: Vec<Unknown>,
    own: Vec<Own>,
    /// W.
    pub operator: Delassus,
    /// `W dz`, by groups.
    moved: Vec<Chunk>,
    /// Which contacts are solved side by side.
    pub partition: Partition,
}

/// What stays of a problem while it is solved.
#[derive(Clone, Copy)]
pub(crate) struct Matrix<'a> {
    own: &'a [Own],
    pub(crate) operator: &'a Delassus,
}

/// Contacts side by side and what their changes move: all, or a part that shares no connected set with others.
pub(crate) struct View<'a> {
    matrix: Matrix<'a>,
    unknowns: &'a mut [Unknown],
    /// Place of the first one among all.
    first: usize,
    moved: Moved<'a>,
}

impl Problem {
    /// Takes over the operator, all of whose entries are there, with the impulses as they are.
    pub fn close(&mut self) {
        self.operator.close();
        self.own.clear();
        self.own.extend((0..self.unknowns.len()).map(|contact| Own::new(self.operator.diagonal(contact))));
        self.moved.resize(self.operator.moved_len(), Chunk::zero());
        self.partition.close(&self.operator, self.unknowns.len());
        self.refresh();
    }

    /// Sums up anew what the impulses do to gaps and slips: rounding errors of many changes go.
    pub(crate) fn refresh(&mut self) {
        self.moved.fill(Chunk::zero());
        let mut view = self.view();
        vectorized(
            #[inline(always)]
            || {
                for contact in 0..view.unknowns.len() {
                    let Unknown { force, before, .. } = view.unknowns[contact];
                    let by = [0, 1, 2].map(|k| force[k] - before[k]);
                    if by != [0.0; 3] {
                        view.matrix.operator.change(&mut view.moved, contact, by);
                    }
                }
            },
        );
    }

    /// All of it.
    #[inline(always)]
    pub(crate) fn view(&mut self) -> View<'_> {
        let (matrix, _, unknowns, moved) = self.split();
        View { matrix, unknowns, first: 0, moved: Moved { chunks: moved, first: 0 } }
    }

    /// What stays while it is solved, the contacts, and `W dz` by groups.
    #[inline(always)]
    pub(crate) fn split(&mut self) -> (Matrix<'_>, &Partition, &mut [Unknown], &mut [Chunk]) {
        let Self { unknowns, own, operator, moved, partition } = self;
        (Matrix { own, operator }, partition, unknowns, moved)
    }

    /// What stays while it is solved.
    #[inline(always)]
    pub(crate) fn matrix(&self) -> Matrix<'_> {
        Matrix { own: &self.own, operator: &self.operator }
    }

    /// Compliances of a contact to its own impulse: along the normal, and the larger one across [1/kg].
    pub fn compliance(&self, contact: usize) -> [f64; 2] {
        self.matrix().compliance(contact)
    }

    /// Solves each contact in turn with all others held; returns the largest change.
    pub(crate) fn sweep(&mut self, backwards: bool) -> f64 {
        let count = self.unknowns.len();
        let mut view = self.view();
        vectorized(
            #[inline(always)]
            || view.sweep(0..count, backwards),
        )
    }

    /// Gap less its target and slip of a contact with all impulses as they are [m].
    #[inline(always)]
    pub(crate) fn gap_and_slip(&self, contact: usize) -> Row {
        let (free, moved) = (self.unknowns[contact].free, self.operator.moved(contact, &self.moved, 0));
        [free[0] + moved[0], free[1] + moved[1], free[2] + moved[2]]
    }

    /// Adds a contact, whose impulse will start at `force`.
    pub fn push(&mut self, unknown: Unknown) {
        self.unknowns.push(unknown);
    }

    /// Forgets all contacts.
    pub fn clear(&mut self) {
        self.unknowns.clear();
        self.partition.clear();
    }

    /// The contacts.
    pub fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// Puts the contacts in another order, `order[k]` being the place that the k-th one had.
    pub fn reorder(&mut self, order: &[u32]) {
        debug_assert_eq!(order.len(), self.unknowns.len());
        let before = self.unknowns.len();
        self.unknowns.reserve(before);
        for &k in order {
            self.unknowns.push(self.unknowns[k as usize]);
        }
        self.unknowns.drain(..before);
    }

    /// `W dz` of all contacts, by groups.
    pub(crate) fn all_moved(&self) -> &[Chunk] {
        &self.moved
    }

    /// Sets the impulses of all contacts, in turn.
    pub(crate) fn set_forces(&mut self, force: impl Fn(usize, &Unknown) -> Row) {
        let mut view = self.view();
        vectorized(
            #[inline(always)]
            || {
                for contact in 0..view.unknowns.len() {
                    let force = force(contact, &view.unknowns[contact]);
                    view.set_force(contact, force);
                }
            },
        );
    }

    /// Takes impulses back to those of earlier, when `W dz` was `moved`.
    pub(crate) fn restore(&mut self, forces: &[Row], moved: &[Chunk]) {
        for (unknown, &force) in self.unknowns.iter_mut().zip(forces) {
            unknown.force = force;
        }
        self.moved.copy_from_slice(moved);
    }
}

impl Matrix<'_> {
    /// The block of a contact's own impulse.
    #[inline(always)]
    pub(crate) fn diagonal(&self, contact: usize) -> &Block3 {
        self.own[contact].block()
    }

    /// Compliances of a contact to its own impulse: along the normal, and the larger one across [1/kg].
    #[inline(always)]
    pub(crate) fn compliance(&self, contact: usize) -> [f64; 2] {
        self.own[contact].compliance()
    }
}

impl<'a> View<'a> {
    /// Of `unknowns` and `moved`, whose places among all begin at the numbers with them. Each contact's groups must be there.
    #[inline(always)]
    pub(crate) fn new(
        matrix: Matrix<'a>,
        (unknowns, first): (&'a mut [Unknown], usize),
        (chunks, first_chunk): (&'a mut [Chunk], usize),
    ) -> Self {
        Self { matrix, unknowns, first, moved: Moved { chunks, first: first_chunk } }
    }

    /// What stays while the problem is solved.
    #[inline(always)]
    pub(crate) fn matrix(&self) -> Matrix<'a> {
        self.matrix
    }

    /// A contact, by its place among all.
    #[inline(always)]
    pub(crate) fn unknown(&self, contact: usize) -> &Unknown {
        &self.unknowns[contact - self.first]
    }

    /// Gap less its target and slip of a contact with all impulses as they are [m].
    #[inline(always)]
    pub(crate) fn gap_and_slip(&self, contact: usize) -> Row {
        let free = self.unknown(contact).free;
        let moved = self.matrix.operator.moved(contact, self.moved.chunks, self.moved.first);
        [free[0] + moved[0], free[1] + moved[1], free[2] + moved[2]]
    }

    /// Solves each of some contacts in turn with all others held; returns the largest change.
    #[inline(always)]
    pub(crate) fn sweep(&mut self, contacts: Range<usize>, backwards: bool) -> f64 {
        let Range { start, end } = contacts;
        let mut change = 0.0_f64;
        for k in 0..end - start {
            change = change.max(self.relax(if backwards { end - 1 - k } else { start + k }));
        }
        change
    }

    /// How far the impulses of some contacts are from answering gaps and slips: their largest natural residual, relative to
    /// its scale.
    #[inline(always)]
    pub(crate) fn residual(&self, contacts: Range<usize>) -> f64 {
        let mut worst = 0.0_f64;
        for k in contacts {
            let Unknown { force, friction, scale, .. } = *self.unknown(k);
            let [normal, across] = natural_residual(self.matrix.compliance(k), force, self.gap_and_slip(k), friction);
            worst = worst.max(normal.max(across) / scale);
        }
        worst
    }

    /// Sets the impulse of a contact.
    #[inline(always)]
    pub(crate) fn set_force(&mut self, contact: usize, force: Row) {
        let old = self.unknown(contact).force;
        if force != old {
            self.unknowns[contact - self.first].force = force;
            let by = [force[0] - old[0], force[1] - old[1], force[2] - old[2]];
            self.matrix.operator.change(&mut self.moved, contact, by);
        }
    }

    /// Sets the impulse of a contact whose gaps and slips are known as they are at `known`.
    #[inline(always)]
    pub(crate) fn set_force_from(&mut self, contact: usize, force: Row, known: Row) {
        self.unknowns[contact - self.first].force = known;
        self.set_force(contact, force);
    }

    /// Solves one contact with all others held; returns by how much it moved.
    #[inline(always)]
    fn relax(&mut self, contact: usize) -> f64 {
        let w = self.gap_and_slip(contact);
        let Unknown { force: old, friction, scale, .. } = *self.unknown(contact);
        let own = &self.matrix.own[contact];
        let d = *own.block();
        if d[0][0] <= 0.0 {
            return 0.0;
        }
        let force = own.answer(old, w, friction);
        if force == old {
            return 0.0;
        }
        self.set_force(contact, force);
        let moved = |k: usize| ((force[k] - old[k]) * d[k][k]).abs();
        moved(0).max(moved(1)).max(moved(2)) / scale
    }
}
