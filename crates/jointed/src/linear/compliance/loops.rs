//! Answers where joints form loops, from products with the sparse factor.
//!
//! With b_t = J M^-1 f_t, what a force does to the joints' constraints, two forces do the work `f_s M^-1 f_t - b_s A^-1 b_t` on each
//! other's answers. A force on a body is seen by its joints alone, so that b has few entries.

use std::ops::Range;
use std::sync::Arc;

use crate::linear::articulated::Side;
use crate::linear::looped::Looped;
use crate::linear::sparse::{Entries, Products, SparseError};
use crate::system::System;
use crate::topology::Topology;

/// Finds answers, with the memory for it.
pub struct Loops {
    topology: Arc<Topology>,
    /// Joints by body, and where those of each begin.
    joints: Vec<u32>,
    starts: Vec<usize>,
    /// The factor, where the system's solver has none.
    own: Looped,
    products: Products,
    /// Sides of each contact.
    contacts: Vec<Range<usize>>,
    /// What joints see of the contacts' forces, in world rows.
    seen: Vec<Entries>,
}

impl Loops {
    /// Memory for systems of this connectivity.
    ///
    /// # Errors
    /// If the factor would be too large.
    pub(super) fn new(topology: &Arc<Topology>) -> Result<Self, SparseError> {
        let ends = topology.joints.iter().zip(0..).flat_map(|(ends, joint)| ends.map(|body| (body, joint)));
        let mut ends: Vec<(u32, u32)> = ends.collect();
        ends.sort_unstable();
        let start = |body: usize| ends.partition_point(|&(other, _)| (other as usize) < body);
        let own = Looped::new(topology)?;
        Ok(Self {
            topology: topology.clone(),
            starts: (0..=topology.bodies()).map(start).collect(),
            joints: ends.iter().map(|&(_, joint)| joint).collect(),
            products: Products::new(own.cholesky()),
            own,
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
        solver: Option<&mut Looped>,
        sides: &[Side],
        mut block: impl FnMut(usize, usize, [[f64; 3]; 3]),
    ) {
        self.see(system, sides);
        let Self { own, products, contacts, seen, .. } = self;
        let factor = solver.unwrap_or(own);
        // What cannot be factored answers as if there were no joints; the solve beside it says so.
        let is_factored = factor.factor(system).is_ok();
        products.find(factor.cholesky(), contacts.len(), if is_factored { seen } else { &[] });
        for (nth, own) in contacts.iter().enumerate() {
            for (k, other) in contacts[..=nth].iter().enumerate() {
                let (mut work, product) =
                    (alone(system, &sides[own.clone()], &sides[other.clone()]), products.block(nth, k));
                for (work, product) in work.iter_mut().flatten().zip(product.iter().flatten()) {
                    *work -= product;
                }
                block(own.start, other.start, work);
            }
        }
    }

    /// Finds what joints see of the sides, contact by contact.
    fn see(&mut self, system: &System<f64>, sides: &[Side]) {
        let Self { joints, starts, contacts, seen, .. } = self;
        contacts.clear();
        seen.clear();
        let mut side = 0;
        for own in sides.chunk_by(|a, b| a.contact == b.contact) {
            let group = contacts.len() as u32;
            for Side { body, forces, .. } in own {
                let body = *body as usize;
                let answers = forces.map(|force| system.correction(body, force));
                seen.extend(joints[starts[body]..starts[body + 1]].iter().map(|&joint| {
                    let columns = answers.map(|dp| system.constraint_change_by(joint as usize, body, dp).to_array());
                    Entries { group, block: joint, columns }
                }));
            }
            contacts.push(side..side + own.len());
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
