//! What the exact tangent leaves out of the Jacobian of a step's equations: the parts that are not symmetric.
//!
//! The derivative of a torque T by the turn of its own body is `-H - [T]x / 2` where T is the gradient of an energy with the
//! second derivative H in rotation vectors: two turns do not commute. Tangents need H alone, as at a solution the T sum to
//! zero; the torque of the inertia, which is no gradient, has a derivative of its own.

use nalgebra::Matrix3;

use super::Component;
use super::multistep::gyroscopic;
use super::tangent::{matrix, vector};
use crate::kernel::math::{Quat, Sym3, Vec3};
use crate::tangent::Equations;

/// The columns of `f(e_k)`.
fn columns(f: impl Fn(Vec3<f64>) -> Vec3<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| vector(f(Vec3(e)))))
}

/// The turn since an orientation: its cosine and `2 sin(angle / 2)` times its axis.
#[inline(always)]
pub(super) fn turn_since(q: Quat<f64>, before: Quat<f64>) -> (f64, Vec3<f64>) {
    let turn = (q * before.conj()).upper();
    (turn.w, turn.v * 2.0)
}

impl Component<f64> {
    /// Inertia in world axes of a body that is oriented so, in the step under way [kg m^2].
    #[inline(always)]
    pub(super) fn inertia_of(&self, i: usize, q: Quat<f64>) -> Sym3<f64> {
        let rigid = if self.rigid.is_empty() { None } else { self.rigid.iter().find(|rigid| rigid.body == i) };
        rigid.map_or(self.bodies[i].world_inertia(q.axis()), |rigid| rigid.world_inertia(q))
    }

    /// How `-g` of each body's turns falls as the body turns (zero where it is held), and how each joint's stretch-shear rows
    /// grow as body a turns, for `equations` that have a `share` of the inertia: the exact blocks.
    pub(crate) fn whole_blocks(
        &self,
        equations: &Equations,
        share: f64,
        bodies: &mut Vec<Matrix3<f64>>,
        joints: &mut Vec<Matrix3<f64>>,
    ) {
        bodies.clear();
        bodies.extend((0..self.poses.len()).map(|i| match self.is_still(i) {
            true => Matrix3::zeros(),
            false => equations.bodies[i].turning + self.lopsided_inertia(i) * share,
        }));
        let mut add = |body: usize, torque: Vec3<f64>| {
            if !self.is_still(body) {
                bodies[body] += vector(torque).cross_matrix() * 0.5;
            }
        };
        let dt2 = self.effective * self.effective;
        for load in &self.loads {
            let arm = self.system.bodies[load.body].axis * load.offset;
            add(load.body, arm.cross(load.force * dt2));
        }
        joints.clear();
        for (j, ends) in self.system.topology.joints.iter().enumerate() {
            let [a, b] = ends.map(|body| body as usize);
            let arms = self.arms(j);
            let world = self.system.joints[j].multipliers_to_world(self.lambda[j], self.system.frame(j));
            add(a, arms[0].cross(world.linear) - world.angular);
            add(b, world.angular - arms[1].cross(world.linear));
            joints.push(self.tilted(j, arms[0]));
        }
    }

    /// Arms of a joint's connectors in world axes.
    #[inline(always)]
    pub(super) fn arms(&self, j: usize) -> [Vec3<f64>; 2] {
        let (system, terms) = (&self.system, &self.system.joints[j]);
        let [a, b] = system.topology.joints[j].map(|body| system.bodies[body as usize].axis);
        let arms = [a * terms.offsets[0], b * terms.offsets[1]];
        system.across.get(j).map_or(arms, |across| [arms[0] + across[0], arms[1] + across[1]])
    }

    /// What the derivative of the inertia's torque has beyond the symmetric part of `I phi`.
    fn lopsided_inertia(&self, i: usize) -> Matrix3<f64> {
        let q = self.poses[i].q;
        let (cosine, phi) = turn_since(q, self.predicted[i].q);
        let inertia = self.inertia_of(i, q);
        let of = |x: Vec3<f64>| inertia.apply(x);
        let turned = |cosine: f64, turn: Vec3<f64>, by: Vec3<f64>| by * cosine - by.cross(turn) * 0.5;
        let symmetric = matrix(self.turning(i, inertia).full());
        let torque = of(phi);
        // The inertia turns along: all as it is, and phi less by as much.
        if self.multistep.is_none() {
            return columns(|by| by.cross(torque) + of(turned(cosine, phi, by))) - symmetric;
        }
        let (cosine_since, theta) = turn_since(q, self.start[i].q);
        let torque = torque + gyroscopic(of, theta, phi);
        let slope = |by: Vec3<f64>| {
            let (on_theta, on_phi) = (turned(cosine_since, theta, by), turned(cosine, phi, by));
            by.cross(torque) + of(on_phi) + gyroscopic(of, on_theta, phi) + gyroscopic(of, theta, on_phi)
        };
        columns(slope) - symmetric
    }

    /// How a joint's stretch-shear rows change as body a, with the connector's `arm`, turns and takes the frame along that its
    /// compliance and its damping are measured in.
    #[inline(always)]
    fn tilted(&self, j: usize, arm: Vec3<f64>) -> Matrix3<f64> {
        let (terms, force) = (&self.system.joints[j], self.lambda[j].linear);
        let a = self.system.topology.joints[j][0] as usize;
        let body = &self.system.bodies[a];
        let mut fixed = -arm;
        if let Some(damped) = self.beyond.damped.get(j) {
            fixed += body.orientation.rotate(damped.gap);
        }
        let mut out = vector(fixed).cross_matrix();
        let mut along = |axis: Vec3<f64>, extra: f64| {
            let turning = vector(axis).cross_matrix() * -axis.dot(force);
            out += (turning + vector(axis) * vector(axis.cross(force)).transpose()) * extra;
        };
        along(body.axis, terms.stretch_extra);
        if let Some(&extra) = self.system.shear_extra.get(j) {
            along(body.orientation.second_axis(), extra);
        }
        out
    }
}
