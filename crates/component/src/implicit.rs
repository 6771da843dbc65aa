//! What the equations of an equilibrium change by with the model, at the poses and multipliers where they are solved.

use kernels::Spatial;
use kernels::dual::Dual;
use kernels::math::Vec3;
use nalgebra::{Matrix6, Vector3, Vector6};
use rod::Model;

use super::tangent::vector;
use super::{BodyPose, Component, Group, Members, slope_of};
use crate::variation::JointVariation;

impl Component<f64> {
    /// Gravity as it is now [m/s^2].
    pub fn gravity(&self) -> Vector3<f64> {
        vector(self.gravity)
    }

    /// The least stiffness against bending of all joints that are not free to turn, EI [N m^2]; infinite where there is none.
    pub fn softest_bending(&self) -> f64 {
        let joints = (0..self.joints.len()).filter(|&j| !self.is_loose(j, 0));
        let bending = joints.map(|j| 1.0 / (self.joints[j].bend * self.system.joints[j].length));
        bending.fold(f64::INFINITY, f64::min)
    }

    /// Loads: their indices in the model, the bodies that they act on, and from whose centres to where [m].
    pub fn load_arms(&self) -> impl Iterator<Item = (usize, usize, Vector3<f64>)> {
        let arm = |load: &super::BodyLoad<f64>| vector(self.system.bodies[load.body].axis * load.offset);
        self.loads.iter().map(move |load| (load.index, load.body, arm(load)))
    }

    /// By how much more a joint misses, in world rows, where it changes; inner damping does not count. Compliances are over the
    /// square of the step.
    pub fn missed_along(&self, j: usize, by: &JointVariation) -> [Vector3<f64>; 2] {
        let (system, lambda) = (&self.system, self.lambda[j]);
        let k = 1.0 / (self.effective * self.effective);
        let body = &system.bodies[system.topology.joints[j][0] as usize];
        let (axis, second) = (body.axis, body.orientation.second_axis());
        let force = lambda.linear * by.shear_compliance
            + axis * ((by.stretch_compliance - by.shear_compliance) * axis.dot(lambda.linear))
            + second * (by.shear_extra * second.dot(lambda.linear));
        let Vec3([x, y, z]) = lambda.angular;
        let bent = [x * by.bend_compliance, y * (by.bend_compliance + by.bend_extra), z * by.twist_compliance];
        let length = system.joints[j].length;
        let at = vector(self.joints[j].darboux);
        let rest = Vec3((self.strain_measure.slope_at_rest(&at, length) * by.rest_darboux).into());
        let rows = Spatial { linear: force * -k, angular: rest - Vec3(bent) * k };
        let world = system.joints[j].to_world(rows, system.frame(j));
        [vector(world.linear), vector(world.angular)]
    }

    /// Takes over the answer of the whole Jacobian: multipliers from `-dlambda` in world rows.
    pub fn take_multipliers(&mut self, y: &[Spatial<f64>]) {
        for (j, &y) in y.iter().enumerate() {
            self.dlambda[j] = self.system.joints[j].multipliers_from_world(-y, self.system.frame(j));
        }
        self.drop_free();
    }
}

impl Component<Dual<6>> {
    /// What the drag of each segment, force and torque, changes by with its pose (columns: shift and turn), and with the air:
    /// its density, the coefficients across and along the axes, its velocity.
    pub fn drag_slopes(&mut self, poses: &[BodyPose<f64>], members: &Members, model: &Model) -> Vec<[Matrix6<f64>; 2]> {
        let mut forces = Vec::new();
        let mut slopes = |component: &mut Self| -> Vec<Matrix6<f64>> {
            component.weigh(&mut forces, true);
            let column = |force: &Spatial<Dual<6>>, k: usize| -> Vector6<f64> {
                let [force, torque] = slope_of(force, k);
                Vector6::from_iterator(force.iter().chain(torque.iter()).copied())
            };
            forces.iter().map(|force| Matrix6::from_columns(&[0, 1, 2, 3, 4, 5].map(|k| column(force, k)))).collect()
        };
        self.place_constant(poses, &[]);
        self.seed_group(Group::Pose, 1.0);
        let of_poses = slopes(self);
        self.place_constant(poses, &[]);
        let Some(air) = &model.air else { return Vec::new() };
        self.seed_air(members, model, air, 1.0);
        let of_air = slopes(self);
        self.seed_air(members, model, air, 0.0);
        of_poses.into_iter().zip(of_air).map(|(pose, air)| [pose, air]).collect()
    }
}
