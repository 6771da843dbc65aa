//! Answers where joints form loops: columns of back-substitutions with the sparse factor, several at once.
//!
//! With b_t = J M^-1 f_t, what a force does to the joints' constraints, two forces do the work `f_s M^-1 f_t - b_s A^-1 b_t` on each
//! other's answers. A force on a body is seen by its joints alone, so that b has few entries, and of the columns `A^-1 b_t` few are read.

use std::ops::Range;
use std::sync::Arc;

use crate::kernel::dispatch::vectorized;
use crate::linear::looped::Looped;
use crate::linear::sparse::SparseError;
use crate::linear::transfers::Side;
use crate::system::System;
use crate::topology::Topology;

/// Columns that are solved for at once.
const COLUMNS: usize = 24;

/// What the three forces of a side do to a joint of its body, in world rows.
#[derive(Clone, Copy, Debug)]
struct Seen {
    joint: u32,
    rows: [[f64; 6]; 3],
}

/// A contact: its sides, and what joints see of them.
#[derive(Clone, Debug)]
struct Pushes {
    sides: Range<usize>,
    seen: Range<usize>,
}

/// Solves for answers, with the memory for it.
pub(crate) struct Columnwise {
    topology: Arc<Topology>,
    /// Joints by body, and where those of each begin.
    joints: Vec<u32>,
    starts: Vec<usize>,
    factor: Looped,
    contacts: Vec<Pushes>,
    seen: Vec<Seen>,
}

impl Columnwise {
    /// Memory for systems of this connectivity.
    ///
    /// # Errors
    /// If the factor would be too large.
    pub(super) fn new(topology: &Arc<Topology>) -> Result<Self, SparseError> {
        let ends = topology.joints.iter().zip(0..).flat_map(|(ends, joint)| ends.map(|body| (body, joint)));
        let mut ends: Vec<(u32, u32)> = ends.collect();
        ends.sort_unstable();
        let start = |body: usize| ends.partition_point(|&(other, _)| (other as usize) < body);
        Ok(Self {
            topology: topology.clone(),
            starts: (0..=topology.bodies()).map(start).collect(),
            joints: ends.iter().map(|&(_, joint)| joint).collect(),
            factor: Looped::new(topology)?,
            contacts: Vec::new(),
            seen: Vec::new(),
        })
    }

    /// Whether it is of this connectivity.
    pub(super) fn is_of(&self, topology: &Arc<Topology>) -> bool {
        Arc::ptr_eq(&self.topology, topology)
    }

    /// See [`super::Response::couple`].
    pub(super) fn couple(
        &mut self,
        system: &System<f64>,
        sides: &[Side],
        mut block: impl FnMut(usize, usize, [[f64; 3]; 3]),
    ) {
        // What cannot be factored answers as if there were no joints; the solve beside it says so.
        let is_factored = self.factor.factor(system).is_ok();
        self.see(system, sides);
        let Self { factor, contacts, seen, topology, .. } = self;
        let joints = topology.joints.len();
        for (batch, others) in contacts.chunks(COLUMNS / 3).enumerate() {
            let columns = factor.solve_columns(3 * others.len(), |columns| {
                for (column, other) in others.iter().enumerate() {
                    for Seen { joint, rows } in seen[other.seen.clone()].iter().filter(|_| is_factored) {
                        for (d, row) in rows.iter().enumerate() {
                            add(&mut columns[(3 * column + d) * joints + *joint as usize], row);
                        }
                    }
                }
            });
            let first = batch * (COLUMNS / 3);
            vectorized(
                #[inline(always)]
                || {
                    for (nth, own) in contacts.iter().enumerate().skip(first) {
                        for (column, other) in others.iter().enumerate().take(nth + 1 - first) {
                            let mut work = alone(system, &sides[own.sides.clone()], &sides[other.sides.clone()]);
                            for Seen { joint, rows } in &seen[own.seen.clone()] {
                                let answers = [0, 1, 2].map(|c| &columns[(3 * column + c) * joints + *joint as usize]);
                                for (work, row) in work.iter_mut().zip(rows) {
                                    for (work, answer) in work.iter_mut().zip(answers) {
                                        *work -= dot(row, answer);
                                    }
                                }
                            }
                            block(own.sides.start, other.sides.start, work);
                        }
                    }
                },
            );
        }
    }

    /// Finds what joints see of the sides, contact by contact.
    fn see(&mut self, system: &System<f64>, sides: &[Side]) {
        let Self { joints, starts, contacts, seen, .. } = self;
        contacts.clear();
        seen.clear();
        let mut side = 0;
        for own in sides.chunk_by(|a, b| a.contact == b.contact) {
            let first = seen.len();
            for Side { body, forces, .. } in own {
                let body = *body as usize;
                let answers = forces.map(|force| system.correction(body, force));
                seen.extend(joints[starts[body]..starts[body + 1]].iter().map(|&joint| {
                    let rows = answers.map(|dp| system.constraint_change_by(joint as usize, body, dp).to_array());
                    Seen { joint, rows }
                }));
            }
            contacts.push(Pushes { sides: side..side + own.len(), seen: first..seen.len() });
            side += own.len();
        }
    }
}

/// The work of the forces of some sides on what the bodies of others do on their own.
#[inline(always)]
fn alone(system: &System<f64>, own: &[Side], others: &[Side]) -> [[f64; 3]; 3] {
    let mut work = [[0.0; 3]; 3];
    for (own, other) in own.iter().flat_map(|own| others.iter().map(move |other| (own, other))) {
        if own.body == other.body {
            for (c, &force) in other.forces.iter().enumerate() {
                let answer = system.correction(other.body as usize, force);
                for (work, force) in work.iter_mut().zip(&own.forces) {
                    work[c] += force.dot(answer);
                }
            }
        }
    }
    work
}

/// The sum of products, in pairs.
#[inline(always)]
fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5])
}

#[inline(always)]
fn add(sum: &mut [f64; 6], row: &[f64; 6]) {
    for (sum, x) in sum.iter_mut().zip(row) {
        *sum += x;
    }
}
