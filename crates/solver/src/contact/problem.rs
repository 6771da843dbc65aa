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

use super::cone::{Bound, Own, natural_residual};
use super::operator::{Block3, Chunk, Operator, Row};
use crate::kernel::dispatch::vectorized;
use crate::kernel::lane::Real;

/// What a sweep knows of a contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unknown {
    /// Impulse times dt [N s^2]: normal, then two tangents.
    pub(crate) force: Row,
    /// Its value before the solve.
    pub(crate) before: Row,
    /// Gap less its target, and slip, if the impulse stays as it was before [m].
    pub(crate) free: Row,
    /// What friction is at most.
    pub(crate) friction: Bound,
    /// Length by which errors are measured [m].
    pub(crate) scale: f64,
}

/// The problem's matrix and its unknowns. Gaps and slips go with every change of an impulse.
#[derive(Default)]
pub(crate) struct Problem {
    unknowns: Vec<Unknown>,
    own: Vec<Own>,
    /// W.
    pub(crate) operator: Operator,
}

impl Problem {
    /// Takes over the operator, all of whose entries are there, with the impulses as they are.
    pub(crate) fn close(&mut self) {
        self.operator.close();
        self.own.clear();
        self.own.extend((0..self.unknowns.len()).map(|contact| Own::new(self.operator.diagonal(contact))));
        self.refresh();
    }

    /// Sums up anew what the impulses do to gaps and slips: rounding errors of many changes go.
    pub(crate) fn refresh(&mut self) {
        self.operator.all_moved().fill(Chunk::zero());
        let Self { unknowns, operator, .. } = self;
        vectorized(
            #[inline(always)]
            || {
                for (contact, unknown) in unknowns.iter().enumerate() {
                    let by = [0, 1, 2].map(|k| unknown.force[k] - unknown.before[k]);
                    if by != [0.0; 3] {
                        operator.change(contact, by);
                    }
                }
            },
        );
    }

    /// The block of a contact's own impulse.
    pub(crate) fn diagonal(&self, contact: usize) -> &Block3 {
        self.own[contact].block()
    }

    /// Compliances of a contact to its own impulse: along the normal, and the larger one across [1/kg].
    pub(crate) fn compliance(&self, contact: usize) -> [f64; 2] {
        self.own[contact].compliance()
    }

    /// Solves each contact in turn with all others held; returns the largest change.
    pub(crate) fn sweep(&mut self, backwards: bool) -> f64 {
        vectorized(
            #[inline(always)]
            || {
                let count = self.unknowns.len();
                let mut change = 0.0_f64;
                for k in 0..count {
                    change = change.max(self.relax(if backwards { count - 1 - k } else { k }));
                }
                change
            },
        )
    }

    /// How far the impulses are from answering gaps and slips: the largest natural residual of a contact, relative to its
    /// scale.
    pub(crate) fn residual(&self) -> f64 {
        let of = |k: usize| {
            let Unknown { force, friction, scale, .. } = self.unknowns[k];
            let [normal, across] = natural_residual(self.compliance(k), force, self.gap_and_slip(k), friction);
            normal.max(across) / scale
        };
        vectorized(
            #[inline(always)]
            || (0..self.unknowns.len()).map(of).fold(0.0, f64::max),
        )
    }

    /// Blocks of a block row with their columns.
    #[cfg(test)]
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = (usize, Block3)> {
        self.operator.coupled(row, 0).map(move |(column, places)| (column, self.operator.block(row, places)))
    }

    /// Gap less its target and slip of a contact with all impulses as they are [m].
    #[inline(always)]
    pub(crate) fn gap_and_slip(&self, contact: usize) -> Row {
        let (free, moved) = (self.unknowns[contact].free, self.operator.moved(contact));
        [free[0] + moved[0], free[1] + moved[1], free[2] + moved[2]]
    }

    /// Adds a contact, whose impulse will start at `force`.
    pub(crate) fn push(&mut self, unknown: Unknown) {
        self.unknowns.push(unknown);
    }

    /// Forgets all contacts.
    pub(crate) fn clear(&mut self) {
        self.unknowns.clear();
    }

    /// The contacts.
    pub(crate) fn unknowns(&self) -> &[Unknown] {
        &self.unknowns
    }

    /// Sets the impulse of a contact.
    #[inline(always)]
    pub(crate) fn set_force(&mut self, contact: usize, force: Row) {
        let old = self.unknowns[contact].force;
        if force != old {
            self.unknowns[contact].force = force;
            self.operator.change(contact, [force[0] - old[0], force[1] - old[1], force[2] - old[2]]);
        }
    }

    /// Sets the impulses of all contacts, in turn.
    pub(crate) fn set_forces(&mut self, force: impl Fn(usize, &Unknown) -> Row) {
        vectorized(
            #[inline(always)]
            || {
                for contact in 0..self.unknowns.len() {
                    let force = force(contact, &self.unknowns[contact]);
                    self.set_force(contact, force);
                }
            },
        );
    }

    /// Takes impulses back to those of earlier, when `W dz` was `moved`.
    pub(crate) fn restore(&mut self, forces: &[Row], moved: &[Chunk]) {
        for (unknown, &force) in self.unknowns.iter_mut().zip(forces) {
            unknown.force = force;
        }
        self.operator.all_moved().copy_from_slice(moved);
    }

    /// Sets the impulse of a contact whose gaps and slips are known as they are at `known`.
    #[inline(always)]
    pub(crate) fn set_force_from(&mut self, contact: usize, force: Row, known: Row) {
        self.unknowns[contact].force = known;
        self.set_force(contact, force);
    }

    /// Solves one contact with all others held; returns by how much it moved.
    #[inline(always)]
    fn relax(&mut self, contact: usize) -> f64 {
        let w = self.gap_and_slip(contact);
        let Unknown { force: old, friction, scale, .. } = self.unknowns[contact];
        let own = &self.own[contact];
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
