//! Answers where joints form loops: each column of forces goes through the sparse factor, several at once.

use std::sync::Arc;

use super::clear;
use crate::component::{copy_spatial, pick_spatial};
use crate::kernel::Spatial;
use crate::kernel::dispatch::vectorized;
use crate::kernel::lane::{Lanes, Real};
use crate::kernel::math::{Quat, Sym3, Vec3};
use crate::linear::looped::Looped;
use crate::linear::sparse::SparseError;
use crate::linear::transfers::Side;
use crate::system::{BodyTerms, JointTerms, System};
use crate::topology::Topology;

/// Impulses that are answered side by side.
const COLUMNS: usize = 24;
pub(super) type Columns = Lanes<COLUMNS>;

/// Solves for answers, with the memory for it.
pub(crate) struct Columnwise {
    system: System<Columns>,
    dlambda: Vec<Spatial<Columns>>,
    scratch: Vec<Spatial<Columns>>,
    impulses: Vec<Spatial<Columns>>,
    factor: Looped,
}

impl Columnwise {
    /// Memory for systems of this connectivity.
    ///
    /// # Errors
    /// If the factor would be too large.
    pub(super) fn new(topology: &Arc<Topology>) -> Result<Self, SparseError> {
        Ok(Self {
            system: System::new(topology.clone()),
            dlambda: vec![Spatial::zero(); topology.joints.len()],
            scratch: vec![Spatial::zero(); topology.bodies()],
            impulses: Vec::new(),
            factor: Looped::new(topology)?,
        })
    }

    /// Whether it is of this connectivity.
    pub(super) fn is_of(&self, topology: &Arc<Topology>) -> bool {
        Arc::ptr_eq(&self.system.topology, topology)
    }

    /// See [`super::Response::couple`].
    pub(super) fn couple(
        &mut self,
        system: &System<f64>,
        sides: &[Side],
        mut block: impl FnMut(usize, usize, [[f64; 3]; 3]),
    ) {
        self.prepare(system);
        let mut impulses = std::mem::take(&mut self.impulses);
        let mut first = 0;
        while first < sides.len() {
            // Sides of one contact share their columns.
            let (mut lanes, mut end) = (0, first);
            clear(&mut impulses, system.bodies.len());
            for own in sides[first..].chunk_by(|a, b| a.contact == b.contact).take(COLUMNS / 3) {
                for side in own {
                    let impulse = &mut impulses[side.body as usize];
                    for (d, force) in side.forces.iter().enumerate() {
                        let sum = pick_spatial(impulse, lanes + d).plus(*force, 1.0);
                        copy_spatial(impulse, lanes + d, &sum, 0);
                    }
                }
                (lanes, end) = (lanes + 3, end + own.len());
            }
            self.respond(&mut impulses, lanes);
            let mut s = first;
            for (nth, own) in sides[first..].chunk_by(|a, b| a.contact == b.contact).enumerate() {
                let mut work = [Columns::zero(); 3];
                for side in own {
                    let answer = &impulses[side.body as usize];
                    for (work, force) in work.iter_mut().zip(&side.forces) {
                        *work += Spatial::splat(*force).dot(*answer);
                    }
                }
                let mut t = first;
                for (before, other) in sides[first..end].chunk_by(|a, b| a.contact == b.contact).enumerate() {
                    if before <= nth {
                        block(s, t, work.map(|row| [0, 1, 2].map(|c| row.lane(3 * before + c))));
                    }
                    t += other.len();
                }
                s += own.len();
            }
            first = end;
        }
        self.impulses = impulses;
    }

    /// Takes over a system's matrix.
    fn prepare(&mut self, system: &System<f64>) {
        for (own, body) in self.system.bodies.iter_mut().zip(&system.bodies) {
            *own = splat_body(body);
        }
        for (own, joint) in self.system.joints.iter_mut().zip(&system.joints) {
            *own = splat_joint(joint);
        }
        self.system.across.clear();
        self.system.across.extend(system.across.iter().map(|ends| ends.map(splat_vec)));
        self.system.bend_extra.clear();
        self.system.bend_extra.extend(system.bend_extra.iter().copied().map(Columns::splat));
        self.system.shear_extra.clear();
        self.system.shear_extra.extend(system.shear_extra.iter().copied().map(Columns::splat));
        self.system.frames.clear();
        self.system.frames.extend(system.frames.iter().map(splat_quat));
        // What cannot be factored answers as if there were no joints; the solve beside it says so.
        let _ = self.factor.factor(system);
    }

    /// Replaces impulses, one entry a body and the first `lanes` of each, by the corrections dp that answer them.
    fn respond(&mut self, impulses: &mut [Spatial<Columns>], lanes: usize) {
        let Self { system, dlambda, scratch, factor, .. } = self;
        vectorized(
            #[inline(always)]
            || {
                for (i, (own, &impulse)) in scratch.iter_mut().zip(impulses.iter()).enumerate() {
                    *own = system.correction(i, impulse);
                }
                for (j, out) in dlambda.iter_mut().enumerate() {
                    *out = Spatial::zero().plus(system.constraint_change(j, scratch), Columns::splat(-1.0));
                }
            },
        );
        scratch.clear();
        scratch.extend_from_slice(dlambda);
        let take = |lane: usize, j: usize, x: Spatial<f64>| copy_spatial(&mut dlambda[j], lane, &x, 0);
        factor.solve_columns(lanes, |lane, j| pick_spatial(&scratch[j], lane), take);
        scratch.resize(system.bodies.len(), Spatial::zero());
        vectorized(
            #[inline(always)]
            || {
                for (j, &dlambda) in dlambda.iter().enumerate() {
                    system.add_impulse(j, dlambda, impulses);
                }
                for (i, impulse) in impulses.iter_mut().enumerate() {
                    *impulse = system.correction(i, *impulse);
                }
            },
        );
    }
}

fn splat_vec(v: Vec3<f64>) -> Vec3<Columns> {
    Vec3(v.0.map(Columns::splat))
}

fn splat_quat(q: &Quat<f64>) -> Quat<Columns> {
    Quat { v: splat_vec(q.v), w: Columns::splat(q.w) }
}

fn splat_body(body: &BodyTerms<f64>) -> BodyTerms<Columns> {
    BodyTerms {
        inverse_mass: Columns::splat(body.inverse_mass),
        orientation: splat_quat(&body.orientation),
        axis: splat_vec(body.axis),
        inverse_inertia: Sym3(body.inverse_inertia.0.map(Columns::splat)),
    }
}

fn splat_joint(joint: &JointTerms<f64>) -> JointTerms<Columns> {
    JointTerms {
        offsets: joint.offsets.map(Columns::splat),
        length: Columns::splat(joint.length),
        shear: Columns::splat(joint.shear),
        stretch_extra: Columns::splat(joint.stretch_extra),
        bend: Columns::splat(joint.bend),
        twist_extra: Columns::splat(joint.twist_extra),
        s: Columns::splat(joint.s),
        t: splat_vec(joint.t),
        rhs: Spatial::zero(),
    }
}
