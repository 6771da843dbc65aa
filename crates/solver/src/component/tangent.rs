//! Newton's equations of a step with the exact tangent, gathered where poses and multipliers are: see [`crate::tangent`].

use nalgebra::{Matrix3, Vector3};

use super::{BodyPose, Component};
use crate::kernel::Spatial;
use crate::kernel::math::{Quat, Sym3, Vec3};
use crate::tangent::{BodyEquation, Equations, JointEquation, curvature};

fn vector(x: Vec3<f64>) -> Vector3<f64> {
    Vector3::from(x.0)
}

fn symmetric(m: Sym3<f64>) -> Matrix3<f64> {
    let rows = m.full();
    Matrix3::from_fn(|r, c| rows[r][c])
}

fn rotation(q: Quat<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| vector(q.rotate(Vec3(axis)))))
}

impl Component<f64> {
    /// Whether joints transmit anything yet: without it the tangent knows of no stiffness but that of the rows.
    pub(crate) fn has_multipliers(&self) -> bool {
        self.lambda.iter().any(|lambda| *lambda != Spatial::zero())
    }

    /// Gathers the equations at the last evaluation, which must have been of formulation `newton`.
    pub(crate) fn gather(&self, equations: &mut Equations) {
        let Equations { bodies, joints } = equations;
        bodies.clear();
        bodies.extend((0..self.poses.len()).map(|i| self.body_equation(i)));
        let dt2 = self.effective * self.effective;
        for load in &self.loads {
            let arm = self.system.bodies[load.body].axis * load.offset;
            bodies[load.body].turning += curvature::of_force(&vector(load.force * dt2), &vector(arm));
        }
        joints.clear();
        for j in 0..self.system.joints.len() {
            let joint = self.joint_equation(j, bodies);
            joints.push(joint);
        }
    }

    /// Mass [kg] and inertia in world axes [kg m^2] of a body; `None` where it is held.
    pub(crate) fn mass_and_inertia(&self, i: usize) -> Option<(f64, Matrix3<f64>)> {
        let inverse_mass = self.system.bodies[i].inverse_mass;
        let axes = rotation(self.poses[i].q);
        let inertia = || axes * Matrix3::from_diagonal(&vector(self.moments(i, 0))) * axes.transpose();
        (inverse_mass != 0.0).then(|| (1.0 / inverse_mass, inertia()))
    }

    /// Inertia and defect of a body.
    fn body_equation(&self, i: usize) -> BodyEquation {
        let Some((mass, inertia)) = self.mass_and_inertia(i) else { return BodyEquation::held() };
        let terms = &self.system.bodies[i];
        let turn = (self.poses[i].q * self.predicted[i].q.conj()).upper();
        let slope = curvature::of_inertia(&inertia, turn.w, &vector(turn.v * 2.0));
        let turning = (slope + slope.transpose()) * 0.5;
        // What the evaluation has multiplied by its M^-1.
        let asked = self.momentum[i];
        let angular = symmetric(terms.inverse_inertia.inverse()) * vector(asked.angular);
        BodyEquation { mass, turning, defect: [vector(asked.linear) * mass, angular] }
    }

    /// A joint's share; what turns its bodies is added to theirs.
    fn joint_equation(&self, j: usize, bodies: &mut [BodyEquation]) -> JointEquation {
        let system = &self.system;
        let terms = &system.joints[j];
        let ends = system.topology.joints[j].map(|body| body as usize);
        let frame = system.frame(j);
        let mut arms = [0, 1].map(|end| system.bodies[ends[end]].axis * terms.offsets[end]);
        if let Some(across) = system.across.get(j) {
            arms = [arms[0] + across[0], arms[1] + across[1]];
        }
        let arms = arms.map(vector);
        let lambda = self.lambda[j];
        let world = terms.multipliers_to_world(lambda, frame);
        let (force, torque) = (vector(world.linear), vector(world.angular));
        let kappa = frame.rotate(lambda.angular).dot(terms.t) / (2.0 * terms.length);
        let (own, coupling) = curvature::of_bend_twist(kappa, &torque);
        for (end, sign) in [(0, 1.0), (1, -1.0)] {
            bodies[ends[end]].turning += own + curvature::of_force(&(force * sign), &arms[end]);
        }
        // The right-hand side of the dual system has J M^-1 g in it.
        let rhs = terms.to_world(terms.rhs, frame).plus(system.constraint_change(j, &self.momentum), 1.0);
        JointEquation {
            length: terms.length,
            arms,
            compliance: [
                symmetric(terms.stretch_compliance(system.bodies[ends[0]].axis)),
                symmetric(system.bend_compliance(j)),
            ],
            coupling,
            rhs: [vector(rhs.linear), vector(rhs.angular)],
        }
    }

    /// Puts poses and multipliers to where a `share` of a step leads from `poses` and `lambda`: by `dp`, one entry a body, and
    /// the component's `dlambda`. Fixed bodies stay.
    pub(crate) fn go_on_from(
        &mut self,
        poses: &[BodyPose<f64>],
        lambda: &[Spatial<f64>],
        dp: &[Spatial<f64>],
        share: f64,
    ) {
        for i in (0..self.segments).filter(|&i| self.bodies[i].free != 0.0) {
            let (from, dp) = (&poses[i], dp[i]);
            self.poses[i] = BodyPose { x: from.x + dp.linear * share, q: from.q.turned(dp.angular * share) };
        }
        for ((own, &from), &dlambda) in self.lambda.iter_mut().zip(lambda).zip(&self.dlambda) {
            *own = from.plus(dlambda, share);
        }
        // The next evaluation gathers those of the new multipliers.
        self.pulls_hold = false;
    }

    /// Puts poses and multipliers back to where a step began.
    pub(crate) fn go_back_to(&mut self, poses: &[BodyPose<f64>], lambda: &[Spatial<f64>]) {
        self.poses.copy_from_slice(poses);
        self.lambda.copy_from_slice(lambda);
        self.pulls_hold = false;
    }

    /// Takes over multipliers of world rows as the solution of the linear system.
    pub(crate) fn take_solution(&mut self, j: usize, world: Spatial<f64>) {
        self.dlambda[j] = self.system.joints[j].multipliers_from_world(world, self.system.frame(j));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::UnitQuaternion;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rod::{Assembly, BodyShape, Load, Material, Pose, RigidBody, RodSpec, shape};

    use super::*;
    use crate::component::split;
    use crate::formulation::Formulation;

    fn random(rng: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| rng.random_range(-size..size))
    }

    /// A helix, its first segment fixed, with a box at its end and a force off the centre of a segment.
    fn component(force: Vector3<f64>) -> Component<f64> {
        let mut assembly = Assembly::new(Vector3::zeros());
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 5e5, density: 500.0 };
        let rod = assembly.rod(&RodSpec::new(shape::helix(Vector3::zeros(), 0.3, 0.4, 1.0, 6), 0.02, material));
        assembly.fix(rod.start).load(Load { segment: 3, offset: 0.04, force, torque: Vector3::zeros() });
        let sides = Vector3::new(0.1, 0.2, 0.3);
        let body = assembly.body(
            RigidBody::new(BodyShape::Box { sides }, 0.5),
            Pose { position: Vector3::zeros(), orientation: UnitQuaternion::identity() },
        );
        assembly.join_body(rod.end - 1, 1.0, body, &Vector3::new(0.05, 0.1, -0.15));
        let (model, state) = assembly.finish();
        let (members, topology) = split(&model).remove(0);
        Component::new(&model, &state, Arc::new(topology), &[&members])
    }

    /// By how much `d.defect` changes beyond `-d.(K d)` along d, and what that is of the sizes of K's blocks.
    fn remainder(component: &mut Component<f64>, lambda: &[Spatial<f64>], d: &[Spatial<f64>], step: f64) -> f64 {
        let poses = component.poses.clone();
        let mut at = |share: f64| {
            component.go_on_from(&poses, lambda, d, share);
            component.evaluate(Formulation::Newton);
            let mut equations = Equations::default();
            component.gather(&mut equations);
            equations
        };
        let work = |equations: &Equations| -> f64 {
            let of = |(body, d): (&BodyEquation, &Spatial<f64>)| {
                body.defect[0].dot(&vector(d.linear)) + body.defect[1].dot(&vector(d.angular))
            };
            equations.bodies.iter().zip(d).map(of).sum()
        };
        let [ahead, behind, here] = [step, -step, 0.0].map(&mut at);
        let (mut curvature, mut size) = (0.0, 0.0);
        for (body, d) in here.bodies.iter().zip(d).filter(|(body, _)| !body.is_held()) {
            let turn = vector(d.angular);
            curvature += body.mass * d.linear.norm_squared() + turn.dot(&(body.turning * turn));
            size += body.turning.norm() * turn.norm_squared();
        }
        for (joint, ends) in here.joints.iter().zip(&component.system.topology.joints) {
            let [a, b] = ends.map(|body| vector(d[body as usize].angular));
            curvature += 2.0 * a.dot(&(joint.coupling * b));
        }
        component.go_back_to(&poses, lambda);
        (0.5 * (work(&ahead) - work(&behind)) + step * curvature) / size
    }

    /// One kind at a time, as what is stiff would hide what is soft.
    #[test]
    fn the_tangent_is_the_derivative_of_the_residual() {
        let rng = &mut ChaCha8Rng::seed_from_u64(7);
        for kind in ["inertia", "load", "stretch-shear", "bend-twist"] {
            for _ in 0..5 {
                let mut component = component(random(rng, if kind == "load" { 1e6 } else { 1e-9 }));
                component.predict(0.0, 0.01, Formulation::Newton);
                let [stretch, bend] = [("stretch-shear", 1e2), ("bend-twist", 1e2)]
                    .map(|(name, size)| if kind == name { size } else { 1e-9 });
                let joints = component.lambda.len();
                let multiplier =
                    |rng: &mut ChaCha8Rng| [random(rng, stretch), random(rng, bend)].map(|x| Vec3(x.into()));
                let lambda: Vec<_> = (0..joints).map(|_| multiplier(rng)).collect();
                let lambda: Vec<_> = lambda.into_iter().map(|[linear, angular]| Spatial { linear, angular }).collect();
                for i in 1..component.segments() {
                    let q = component.poses[i].q;
                    component.poses[i].q = q.turned(Vec3(random(rng, 0.3).into()));
                }
                let mut d: Vec<_> = (0..component.poses.len())
                    .map(|_| Spatial { linear: Vec3::zero(), angular: Vec3(random(rng, 1.0).into()) })
                    .collect();
                d[0] = Spatial::zero();
                for step in [3e-2, 1e-2, 3e-3] {
                    let remainder = remainder(&mut component, &lambda, &d, step);
                    assert!(remainder.abs() < 2.0 * step.powi(3), "{kind} {step}: {remainder:e}");
                }
            }
        }
    }
}
