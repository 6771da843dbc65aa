//! How a component's bodies answer impulses from outside: `P f` with `P = M^-1 - M^-1 J^T A^-1 J M^-1`, several at once.

use std::sync::Arc;

use crate::component::{copy_spatial, pick_spatial};
use crate::kernel::Spatial;
use crate::kernel::dispatch::vectorized;
use crate::kernel::lane::{Lanes, Real};
use crate::kernel::math::{Quat, Sym3, Vec3};
use crate::linear::LinearSolver;
use crate::linear::direct::Direct;
use crate::linear::looped::Looped;
use crate::linear::sparse::SparseError;
use crate::system::{BodyTerms, JointTerms, System};
use crate::topology::Topology;

/// Impulses that are answered side by side.
pub(crate) const COLUMNS: usize = 8;
pub(crate) type Columns = Lanes<COLUMNS>;

/// Solves for answers, with the memory for it.
pub(crate) struct Response {
    system: System<Columns>,
    dlambda: Vec<Spatial<Columns>>,
    scratch: Vec<Spatial<Columns>>,
    solver: Factor,
}

enum Factor {
    /// Each lane eliminates the tree for itself.
    Tree(Box<Direct<Columns>>),
    Looped(Box<Looped>),
    /// Joints do not answer: P is M^-1.
    Alone,
}

impl Response {
    /// Memory for systems of this connectivity, whose bodies answer `with_joints` or each for itself.
    ///
    /// # Errors
    /// If the factor would be too large.
    pub(crate) fn new(system: &System<f64>, with_joints: bool) -> Result<Self, SparseError> {
        let topology: &Topology = &system.topology;
        let solver = match Direct::new(topology) {
            _ if !with_joints => Factor::Alone,
            Some(direct) => Factor::Tree(Box::new(direct)),
            None => Factor::Looped(Box::new(Looped::new(topology)?)),
        };
        let (bodies, joints) = (topology.bodies(), topology.joints.len());
        Ok(Self {
            system: System::new(system.topology.clone()),
            dlambda: vec![Spatial::zero(); joints],
            scratch: vec![Spatial::zero(); bodies],
            solver,
        })
    }

    /// Whether it is of this connectivity.
    pub(crate) fn is_of(&self, topology: &Arc<Topology>) -> bool {
        Arc::ptr_eq(&self.system.topology, topology)
    }

    /// Takes over a system's matrix.
    pub(crate) fn prepare(&mut self, system: &System<f64>) {
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
        if let Factor::Looped(looped) = &mut self.solver {
            // What cannot be factored answers as if there were no joints; the solve beside it says so.
            let _ = looped.factor(system);
        }
    }

    /// Replaces impulses, one entry a body, by the corrections dp that answer them.
    pub(crate) fn respond(&mut self, impulses: &mut [Spatial<Columns>]) {
        let Self { system, dlambda, scratch, solver } = self;
        if matches!(solver, Factor::Alone) {
            for (i, impulse) in impulses.iter_mut().enumerate() {
                *impulse = system.correction(i, *impulse);
            }
            return;
        }
        vectorized(
            #[inline(always)]
            || {
                for (i, (own, &impulse)) in scratch.iter_mut().zip(impulses.iter()).enumerate() {
                    *own = system.correction(i, impulse);
                }
                for j in 0..system.joints.len() {
                    let q_a = system.frame(j);
                    let change = system.joints[j].from_world(system.constraint_change(j, scratch), q_a);
                    system.joints[j].rhs = Spatial::zero().plus(change, Columns::splat(-1.0));
                }
            },
        );
        match solver {
            Factor::Alone => {}
            Factor::Tree(direct) => {
                direct.solve(system, false, dlambda);
            }
            Factor::Looped(looped) => {
                for (j, dlambda) in dlambda.iter_mut().enumerate() {
                    let q_a = system.frame(j);
                    *dlambda = system.joints[j].to_world(system.joints[j].rhs, q_a);
                }
                scratch.clear();
                scratch.extend_from_slice(dlambda);
                let take = |lane: usize, j: usize, x: Spatial<f64>| {
                    copy_spatial(&mut dlambda[j], lane, &x, 0);
                };
                looped.solve_columns(COLUMNS, |lane, j| pick_spatial(&scratch[j], lane), take);
                for (j, dlambda) in dlambda.iter_mut().enumerate() {
                    let q_a = system.frame(j);
                    *dlambda = system.joints[j].multipliers_from_world(*dlambda, q_a);
                }
                scratch.resize(system.bodies.len(), Spatial::zero());
            }
        }
        vectorized(
            #[inline(always)]
            || {
                for (j, &dlambda) in dlambda.iter().enumerate() {
                    let q_a = system.frame(j);
                    system.add_impulse(j, system.joints[j].multipliers_to_world(dlambda, q_a), impulses);
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

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use rod::{Assembly, InnerDamping, Material, RodSpec, Section, Springs, shape};
    use std::sync::Arc;

    use super::*;
    use crate::component::{Component, split};
    use crate::formulation::Formulation;

    /// The answer is that of one solve in the usual way, where joints have sections with sides, rest rotations and damping, and
    /// a grip has springs.
    #[test]
    fn answers_know_all_of_the_joints() {
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 3e4, density: 300.0 };
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let rod = assembly.rod(&RodSpec {
            sections: vec![Section::Rectangle { width: 0.05, height: 0.02 }],
            inner_damping: InnerDamping { bending: 0.01, twist: 0.02, stretch: 0.0 },
            ..RodSpec::new(shape::helix(Vector3::zeros(), 0.3, 0.5, 1.0, 9), 0.02, material)
        });
        assembly.clamp_start(&rod);
        let (mut model, mut state) = assembly.finish();
        model.measure_from_rest();
        let clamp = model.joints.len() - 1;
        model.soften(clamp, &Springs { force: [300.0, 20.0, 100.0], ..Springs::RIGID });
        state.velocities[7] = Vector3::new(1.0, 2.0, -1.0);
        let (members, topology) = split(&model).swap_remove(0);
        let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
        component.predict(0.0, 0.02, Formulation::XpbdGeometric);
        component.evaluate(Formulation::XpbdGeometric);
        let system = &mut component.system;
        assert!(!system.frames.is_empty() && !system.bend_extra.is_empty() && !system.shear_extra.is_empty());

        let mut impulses = vec![Spatial::zero(); system.bodies.len()];
        impulses[4] = Spatial { linear: Vec3([1.0, -2.0, 0.5]), angular: Vec3([0.1, 0.2, -0.3]) };
        let mut columns: Vec<Spatial<Columns>> = vec![Spatial::zero(); impulses.len()];
        copy_spatial(&mut columns[4], 3, &impulses[4], 0);
        let mut response = Response::new(system, true).unwrap();
        response.prepare(system);
        response.respond(&mut columns);

        let free: Vec<_> = impulses.iter().enumerate().map(|(i, &impulse)| system.correction(i, impulse)).collect();
        for j in 0..system.joints.len() {
            let change = system.joints[j].from_world(system.constraint_change(j, &free), system.frame(j));
            system.joints[j].rhs = Spatial::zero().plus(change, -1.0);
        }
        let mut dlambda = vec![Spatial::zero(); system.joints.len()];
        Direct::new(&system.topology).unwrap().solve(system, false, &mut dlambda);
        for (j, &dlambda) in dlambda.iter().enumerate() {
            system.add_impulse(j, system.joints[j].multipliers_to_world(dlambda, system.frame(j)), &mut impulses);
        }
        for (i, &impulse) in impulses.iter().enumerate() {
            let difference = pick_spatial(&columns[i], 3).plus(system.correction(i, impulse), -1.0);
            assert!(difference.dot(difference).sqrt() < 1e-12, "body {i}: {difference:?}");
            assert_eq!(pick_spatial(&columns[i], 2), Spatial::zero());
        }
    }
}
