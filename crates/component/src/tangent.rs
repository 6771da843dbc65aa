//! Newton's equations of a step with the exact tangent, gathered where poses and multipliers are: see [`crate::tangent`].

use jointed::tangent::elimination::Elimination;
use jointed::tangent::{BodyEquation, Equations, JointEquation, Root, curvature};
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Sym3, Vec3};
use nalgebra::{Matrix3, Vector3};

use super::joint_extras::GRADED;
use super::parts::{select, select_pose};
use super::{BodyPose, Component};

#[inline(always)]
pub(super) fn vector(x: Vec3<f64>) -> Vector3<f64> {
    Vector3::from(x.0)
}

#[inline(always)]
pub(super) fn matrix([[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, yx, yy, yz, zx, zy, zz)
}

impl<T: Real> Component<T> {
    /// Whether joints transmit anything yet in a lane: without it the tangent knows of no stiffness but that of the rows.
    pub fn has_multipliers(&self, lane: usize) -> bool {
        self.lambda.iter().any(|lambda| lambda.to_array().iter().any(|x| x.lane(lane) != 0.0))
    }

    /// Gathers the equations at the last evaluation, which must have been of formulation `newton`; K has this `share` of the
    /// inertia.
    pub fn gather(&self, equations: &mut Equations<T>, share: f64) {
        T::dispatch(
            #[inline(always)]
            || self.gather_all(equations, T::splat(share)),
        );
    }

    /// Lets the frames turn in which stretch is measured. With the force f on body a and the compliance `w + e d d^T`, the arm of
    /// body a reaches `e (d.f) d` further, and the energy's second derivative has `-e (d x f)(d x f)^T`. The change of the rows
    /// by the shear force alone, `e d (d x f)^T`, is left out: it is no arm.
    ///
    /// Where shear is so much softer than stretch that the arm would turn back by half the joint's length, the force follows the
    /// axis, as it does in a string: the rows then yield across the axis as they do along it.
    pub fn turn_stretch_frames(&self, Equations { bodies, joints, .. }: &mut Equations<T>) {
        for (j, joint) in joints.iter_mut().enumerate() {
            let a = self.system.topology.joints[j][0] as usize;
            if bodies[a].is_held() {
                continue;
            }
            let (force, extra) = (self.lambda[j].linear, self.system.joints[j].stretch_extra);
            let second = self.system.second_shear(j);
            for (axis, extra) in [(self.system.bodies[a].axis, extra)].into_iter().chain(second) {
                let along = axis.dot(force) * extra;
                if (0..T::LANES).any(|lane| along.lane(lane) < -0.5 * joint.length.lane(lane)) {
                    joint.compliance[0] =
                        Sym3::identity(self.system.joints[j].shear + self.system.joints[j].stretch_extra);
                    break;
                }
                let arm = axis * along;
                joint.arms[0] += arm;
                bodies[a].turning += curvature::of_force(force, arm) + Sym3::outer(axis.cross(force), -extra);
            }
        }
    }

    /// Gathers their right-hand sides alone.
    pub fn gather_right_hand_sides(&self, Equations { bodies, joints, .. }: &mut Equations<T>) {
        T::dispatch(
            #[inline(always)]
            || {
                for (i, body) in bodies.iter_mut().enumerate().filter(|(_, body)| !body.is_held()) {
                    body.defect = self.defect(i);
                }
                for (j, joint) in joints.iter_mut().enumerate() {
                    joint.rhs = self.missed(j);
                }
            },
        );
    }

    #[inline(always)]
    fn gather_all(&self, Equations { bodies, joints, rows, roots, stiffest }: &mut Equations<T>, share: T) {
        bodies.clear();
        rows.clear();
        for i in 0..self.poses.len() {
            bodies.push(self.body_equation(i, share));
        }
        let dt2 = self.effective * self.effective;
        for load in &self.loads {
            let arm = self.system.bodies[load.body].axis * load.offset;
            bodies[load.body].turning += curvature::of_force(load.force * dt2, arm);
        }
        joints.clear();
        *stiffest = T::splat(f64::INFINITY);
        for j in 0..self.system.joints.len() {
            joints.push(self.joint_equation(j, bodies));
            let (length, own) = (self.system.joints[j].length, self.joints[j].bend);
            let squared = length * length;
            let own = own * squared * squared * (T::splat(1.0) / dt2);
            let least = (*stiffest - own).select(own, *stiffest);
            *stiffest = (-own).select(*stiffest, least);
        }
        roots.clear();
        if self.extras.is_graded || !self.released.is_empty() {
            self.gather_roots(roots);
        }
    }

    /// The roots of bend-twist compliances: of joints that yield far more to one moment than to others from their columns.
    #[cold]
    #[inline(never)]
    fn gather_roots(&self, roots: &mut Vec<Root<T>>) {
        let (zero, one) = (T::zero(), T::splat(1.0));
        for j in 0..self.system.joints.len() {
            let c = self.system.bend_twist_compliance(j).0;
            let [largest, smallest] = [c[0].max(c[1]).max(c[2]), -(-c[0]).max(-c[1]).max(-c[2])];
            let plain = Root::new(self.system.bend_compliance(j));
            let graded = Root::of_columns(
                c,
                [[one, zero, zero], [zero, one, zero], [zero, zero, one]].map(|unit| {
                    let row = Spatial { linear: Vec3::zero(), angular: Vec3(unit) };
                    self.system.joints[j].to_world(row, self.system.frame(j)).angular
                }),
            );
            let is_graded = largest - smallest * T::splat(GRADED);
            roots.push(plain.select(is_graded, &graded));
        }
    }

    /// Inertia in world axes of a body that is oriented so, in the step under way [kg m^2].
    #[inline(always)]
    pub(super) fn inertia_of(&self, i: usize, q: Quat<T>) -> Sym3<T> {
        let inertia = self.bodies[i].world_inertia(q.axis());
        if self.rigid.is_empty() { inertia } else { self.inertia_of_rigid(i, q, inertia) }
    }

    /// The same of what may be a rigid body; `otherwise` where it is none.
    fn inertia_of_rigid(&self, i: usize, q: Quat<T>, otherwise: Sym3<T>) -> Sym3<T> {
        let mut inertia = otherwise;
        for rigid in self.rigid.iter().filter(|rigid| rigid.body == i) {
            let own = rigid.world_inertia(q);
            inertia.0.iter_mut().zip(own.0).for_each(|(entry, own)| entry.copy_lane(rigid.lane, own));
        }
        inertia
    }

    /// A `share` of the inertia, and the defect of a body.
    #[inline(always)]
    fn body_equation(&self, i: usize, share: T) -> BodyEquation<T> {
        let terms = &self.system.bodies[i];
        if terms.inverse_mass.lane(0) == 0.0 {
            return BodyEquation::held();
        }
        let mass = share / terms.inverse_mass;
        let turning = self.turning(i, self.inertia_of(i, terms.orientation) * share);
        BodyEquation { mass, turning, defect: self.defect(i) }
    }

    /// The inertia's share of a body's block of K.
    #[inline(always)]
    pub(super) fn turning(&self, i: usize, inertia: Sym3<T>) -> Sym3<T> {
        let turn = (self.poses[i].q * self.predicted[i].q.conj()).upper();
        curvature::of_inertia(inertia, turn.w, turn.v * T::splat(2.0))
    }

    /// Arms of a joint's connectors in world axes.
    #[inline(always)]
    pub(super) fn arms(&self, j: usize) -> [Vec3<T>; 2] {
        let (system, terms) = (&self.system, &self.system.joints[j]);
        let [a, b] = system.topology.joints[j].map(|body| system.bodies[body as usize].axis);
        let arms = [a * terms.offsets[0], b * terms.offsets[1]];
        system.across.get(j).map_or(arms, |across| [arms[0] + across[0], arms[1] + across[1]])
    }

    /// A joint's share; what turns its bodies is added to theirs.
    #[inline(always)]
    fn joint_equation(&self, j: usize, bodies: &mut [BodyEquation<T>]) -> JointEquation<T> {
        let system = &self.system;
        let terms = &system.joints[j];
        let [a, b] = system.topology.joints[j].map(|body| body as usize);
        let frame = system.frame(j);
        let arms = self.arms(j);
        let lambda = self.lambda[j];
        let world = terms.multipliers_to_world(lambda, frame);
        let multiplier = frame.rotate(lambda.angular) * (T::splat(1.0) / terms.length);
        let second = terms.rows.second(self.strain_measure, terms.t, multiplier);
        let (own, coupling) = curvature::of_bend_twist(second, world.angular);
        bodies[a].turning += own + curvature::of_force(world.linear, arms[0]);
        bodies[b].turning += own + curvature::of_force(-world.linear, arms[1]);
        let compliance = [system.stretch_compliance(j), system.bend_compliance(j)];
        JointEquation { length: terms.length, arms, compliance, coupling, rhs: self.missed(j) }
    }

    /// Puts poses and multipliers to where a `share` of a step leads from `poses` and `lambda`, in the lanes where `active` >= 0:
    /// by `dp`, one entry a body, and the component's `dlambda`. Fixed bodies stay.
    pub fn go_on_from(
        &mut self,
        (poses, lambda): (&[BodyPose<T>], &[Spatial<T>]),
        dp: &[Spatial<T>],
        share: T,
        active: T,
    ) {
        T::dispatch(
            #[inline(always)]
            || {
                let mut largest = T::zero();
                for i in (0..self.segments).filter(|&i| self.bodies[i].free.lane(0) != 0.0) {
                    let (from, dp) = (&poses[i], dp[i]);
                    largest = largest.max(self.motion(i, dp));
                    let to = BodyPose { x: from.x + dp.linear * share, q: from.q.turned(dp.angular * share) };
                    self.poses[i] = select_pose(active, to, self.poses[i]);
                }
                self.correction = active.select(largest.sqrt(), self.correction);
                for ((own, &from), &dlambda) in self.lambda.iter_mut().zip(lambda).zip(&self.dlambda) {
                    *own = select(active, from.plus(dlambda, share), *own);
                }
            },
        );
        // The next evaluation gathers those of the new multipliers.
        self.pulls_hold = false;
    }

    /// Puts poses and multipliers to where they have been, in the lanes where `active` >= 0.
    pub fn go_back_to(&mut self, poses: &[BodyPose<T>], lambda: &[Spatial<T>], active: T) {
        for (own, &from) in self.poses.iter_mut().zip(poses) {
            *own = select_pose(active, from, *own);
        }
        for (own, &from) in self.lambda.iter_mut().zip(lambda) {
            *own = select(active, from, *own);
        }
        self.pulls_hold = false;
    }

    /// Takes over an elimination's result, in the lanes where `active` >= 0: corrections to `dp`, multipliers as the solution of
    /// the linear system.
    pub fn take_solution(&mut self, elimination: &Elimination<T>, dp: &mut [Spatial<T>], active: T) {
        T::dispatch(
            #[inline(always)]
            || {
                for (own, &new) in dp.iter_mut().zip(&elimination.corrections) {
                    *own = select(active, new, *own);
                }
                for (j, &world) in elimination.multipliers.iter().enumerate() {
                    let new = self.system.joints[j].multipliers_from_world(world, self.system.frame(j));
                    self.dlambda[j] = select(active, new, self.dlambda[j]);
                }
            },
        );
        self.drop_free();
    }
}

impl Component<f64> {
    /// Mass [kg] and inertia in world axes [kg m^2] of a body where it is, with what air adds to it in a step; `None` where it is
    /// held.
    pub fn mass_and_inertia(&self, i: usize) -> Option<(f64, Matrix3<f64>)> {
        let (constants, q) = (&self.bodies[i], self.poses[i].q);
        (constants.inverse_mass != 0.0).then(|| (1.0 / constants.inverse_mass, matrix(self.inertia_of(i, q).full())))
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
    use crate::formulation::Formulation;
    use crate::split;

    fn random(rng: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| rng.random_range(-size..size))
    }

    /// A helix, its first segment fixed, with a box at its end and a force off the centre of a segment.
    fn component(force: Vector3<f64>) -> Component<f64> {
        let mut assembly = Assembly::new(Vector3::zeros());
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 5e5, density: 500.0 };
        let rod = assembly.rod(&RodSpec::new(shape::helix(Vector3::zeros(), 0.3, 0.4, 1.0, 6), 0.02, material));
        assembly.fix(rod.start).load(Load {
            segment: 3,
            offset: 0.04,
            force,
            torque: Vector3::zeros(),
            follows: false,
        });
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
            component.go_on_from((&poses, lambda), d, share, 0.0);
            component.evaluate(Formulation::Newton);
            let mut equations = Equations::default();
            component.gather(&mut equations, 1.0);
            equations
        };
        let work = |equations: &Equations| -> f64 {
            let of = |(body, d): (&BodyEquation, &Spatial<f64>)| body.defect.dot(*d);
            equations.bodies.iter().zip(d).map(of).sum()
        };
        let [ahead, behind, here] = [step, -step, 0.0].map(&mut at);
        let (mut curvature, mut size) = (0.0, 0.0);
        for (body, d) in here.bodies.iter().zip(d).filter(|(body, _)| !body.is_held()) {
            let turn = d.angular;
            curvature += body.mass * d.linear.norm_squared() + turn.dot(body.turning.apply(turn));
            size += matrix(body.turning.full()).norm() * turn.norm_squared();
        }
        for (joint, ends) in here.joints.iter().zip(&component.system.topology.joints) {
            let [a, b] = ends.map(|body| d[body as usize].angular);
            curvature += 2.0 * a.dot(joint.coupling.apply(b));
        }
        component.go_back_to(&poses, lambda, 0.0);
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
