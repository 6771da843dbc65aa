//! The factor of the rest shape, turned along with the segments.
//!
//! In the frame of its body a, a joint's world rows are those of the rest shape as long as the rod bends little over a
//! joint. So: turn a residual from where the segments are to where they would be at rest, `R_a,rest R_a^T` joint by
//! joint, solve with the factor of the rest configuration, turn the result back. With T the change to world rows and Q
//! the turn, `M^-1 = T^T Q^T A_rest^-1 Q T` is symmetric and positive definite whatever the pose. The factor holds
//! while the time step does. The geometric stiffness is not part of it. R_a is the frame of the joint's rows.

use std::sync::Arc;

use nalgebra::UnitQuaternion;
use rod::Model;

use super::approximate_inverse::Precondition;
use crate::linear::looped::Looped;
use crate::linear::operator::Operator;
use crate::linear::sparse::SparseError;
use crate::members::Members;
use crate::rotation::RotationRows;
use crate::system::System;
use crate::topology::Topology;
use kernels::Spatial;
use kernels::math::{Quat, Sym3, Vec3};

/// The factored rest configuration of one connected set of segments.
pub struct Frozen {
    rest: System<f64>,
    /// Frame of each joint's bend-twist rows at rest.
    frames: Vec<Quat<f64>>,
    factor: Looped,
    is_factored: bool,
}

impl Frozen {
    /// The rest configuration of a set of segments.
    ///
    /// # Errors
    /// If the factor would be too large.
    pub fn new(model: &Model, members: &Members, topology: &Topology) -> Result<Self, SparseError> {
        let factor = Looped::new(topology)?;
        let mut rest = System::new(Arc::new(topology.clone()));
        let orientations = rest_orientations(model, members, topology);
        for (body, terms) in rest.bodies.iter_mut().enumerate() {
            terms.orientation = orientations[body];
            terms.axis = orientations[body].axis();
            let Some(segment) = members.segments.get(body).map(|&i| &model.segments[i]) else { continue };
            if !segment.fixed {
                let (across, along) = (1.0 / segment.transverse_inertia(), 1.0 / segment.axial_inertia());
                terms.inverse_mass = 1.0 / segment.mass();
                terms.inverse_inertia = Sym3::identity(across) + Sym3::outer(terms.axis, along - across);
                if let Some(rigid) = &segment.body {
                    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vec3);
                    let along = |k: usize| Sym3::outer(terms.orientation.rotate(axes[k]), 1.0 / rigid.inertia[k]);
                    terms.inverse_inertia = along(0) + along(1) + along(2);
                }
            }
        }
        let mut frames = Vec::with_capacity(topology.joints.len());
        for (k, terms) in rest.joints.iter_mut().enumerate() {
            let joint = &model.joints[members.joints[k]];
            let relative = rest_rotation(joint);
            let [a, b] = topology.joints[k].map(|body| body as usize);
            // A fixed body a may hold on to several joints that do not agree with it; its joint's frame does.
            let q_a = if topology.fixed[a] { orientations[b] * relative.conj() } else { orientations[a] };
            let frame = q_a * own_quat(&joint.rest_frames[0]);
            let strained = own_quat(&rod::darboux::rotation_of(&joint.rest_darboux, joint.length));
            frames.push(frame);
            terms.offsets = [joint.offset_a, joint.offset_b];
            terms.length = joint.length;
            (terms.rows, _) = RotationRows::new(model.strain_measure, strained);
            terms.t = frame.rotate(strained.v);
        }
        if members.joints.iter().any(|&k| model.joints[k].has_rest_frames()) {
            rest.frames.clone_from(&frames);
        }
        let mounts = || members.joints.iter().map(|&k| model.joints[k].mount);
        if mounts().any(|mount| mount.is_some()) {
            let across = |(mount, ends): (Option<rod::Mount>, &[u32; 2])| {
                let places = mount.map_or([Vec3::zero(); 2], |mount| mount.across.map(|at| Vec3([at.x, at.y, 0.0])));
                [0, 1].map(|end| orientations[ends[end] as usize].rotate(places[end]))
            };
            rest.across = mounts().zip(&topology.joints).map(across).collect();
        }
        Ok(Self { rest, frames, factor, is_factored: false })
    }

    /// Factors anew where the compliances over dt^2 are not those of the last time.
    #[inline(always)]
    pub fn refresh(&mut self, system: &System<f64>) {
        let mut same = self.is_factored;
        for (own, terms) in self.rest.joints.iter_mut().zip(&system.joints) {
            let current = [terms.shear, terms.stretch_extra, terms.bend, terms.twist_extra];
            same &= current == [own.shear, own.stretch_extra, own.bend, own.twist_extra];
            [own.shear, own.stretch_extra, own.bend, own.twist_extra] = current;
        }
        if self.rest.bend_extra != system.bend_extra {
            same = false;
            self.rest.bend_extra.clone_from(&system.bend_extra);
        }
        if self.rest.bend_couplings != system.bend_couplings {
            same = false;
            self.rest.bend_couplings.clone_from(&system.bend_couplings);
        }
        if self.rest.shear_extra != system.shear_extra {
            same = false;
            self.rest.shear_extra.clone_from(&system.shear_extra);
        }
        if !same {
            self.is_factored = self.factor.factor(&self.rest).is_ok();
        }
    }

    /// `z = M^-1 r`, one entry a joint.
    #[inline(always)]
    pub fn solve(&mut self, system: &System<f64>, r: impl Fn(usize) -> Spatial<f64>, z: &mut [Spatial<f64>]) {
        let (frames, rest) = (&self.frames, &self.rest.joints);
        let current = |joint: usize| system.frame(joint);
        self.factor.solve_factored(
            #[inline(always)]
            |joint| {
                // Bend-twist is in body frames already.
                let turn = frames[joint] * current(joint).conj();
                let r = r(joint);
                rest[joint].to_world(Spatial { linear: turn.rotate(r.linear), angular: r.angular }, frames[joint])
            },
            #[inline(always)]
            |joint, x| {
                let back = current(joint) * frames[joint].conj();
                let x = rest[joint].multipliers_from_world(x, frames[joint]);
                z[joint] = Spatial { linear: back.rotate(x.linear), angular: x.angular };
            },
        );
    }
}

impl Precondition for Frozen {
    #[inline(always)]
    fn prepare(&mut self, _: &Operator, system: &System<f64>) {
        self.refresh(system);
    }

    #[inline(always)]
    fn apply(&mut self, system: &System<f64>, r: &[Spatial<f64>], z: &mut [Spatial<f64>]) -> f64 {
        self.solve(
            system,
            #[inline(always)]
            |joint| r[joint],
            z,
        );
        let mut product = 0.0;
        for (r, z) in r.iter().zip(z) {
            product += r.dot(*z);
        }
        product
    }
}

fn own_quat(q: &UnitQuaternion<f64>) -> Quat<f64> {
    Quat { v: Vec3([q.i, q.j, q.k]), w: q.w }
}

/// conj(q_a) q_b of a joint at rest.
fn rest_rotation(joint: &rod::Joint) -> Quat<f64> {
    own_quat(&joint.rest_rotation())
}

/// Orientations that bring the joints of a spanning tree to rest. Where a loop or fixed bodies do not agree with that, the
/// joint that closes it is a little off its rest, which costs iterations and nothing else.
fn rest_orientations(model: &Model, members: &Members, topology: &Topology) -> Vec<Quat<f64>> {
    let bodies = topology.bodies();
    let mut incident: Vec<Vec<usize>> = vec![Vec::new(); bodies];
    for (k, ends) in topology.joints.iter().enumerate() {
        ends.iter().for_each(|&body| incident[body as usize].push(k));
    }
    let mut found: Vec<Option<Quat<f64>>> = vec![None; bodies];
    for root in 0..bodies {
        if found[root].is_some() {
            continue;
        }
        found[root] = Some(Quat::identity());
        let mut open = vec![(root, Quat::identity())];
        while let Some((body, q)) = open.pop() {
            for &k in &incident[body] {
                let [a, b] = topology.joints[k].map(|end| end as usize);
                let joint = &model.joints[members.joints[k]];
                let relative = rest_rotation(joint);
                let (other, turned) = if a == body { (b, q * relative) } else { (a, q * relative.conj()) };
                if found[other].is_none() {
                    found[other] = Some(turned);
                    open.push((other, turned));
                }
            }
        }
    }
    found.into_iter().map(|q| q.unwrap_or(Quat::identity())).collect()
}
