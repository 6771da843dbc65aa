//! What the exact tangent leaves out of the Jacobian of a step's equations: the parts that are not symmetric.
//!
//! The derivative of a torque T by the turn of its own body is `-H - [T]x / 2` where T is the gradient of an energy with the
//! second derivative H in rotation vectors: two turns do not commute. Tangents need H alone, as at a solution the T sum to
//! zero; the torque of the inertia, which is no gradient, has a derivative of its own.

use nalgebra::Matrix3;

use super::Component;
use super::multistep::gyroscopic;
use super::tangent::{matrix, vector};
use crate::kernel::Spatial;
use crate::kernel::dispatch::vectorized;
use crate::kernel::lane::Real;
use crate::kernel::math::{Quat, Sym3, Vec3};
use crate::tangent::Equations;

/// The columns of `f(e_k)`.
fn columns(f: impl Fn(Vec3<f64>) -> Vec3<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| vector(f(Vec3(e)))))
}

/// The turn since an orientation: its cosine and `2 sin(angle / 2)` times its axis.
#[inline(always)]
pub(super) fn turn_since<T: Real>(q: Quat<T>, before: Quat<T>) -> (T, Vec3<T>) {
    let turn = (q * before.conj()).upper();
    (turn.w, turn.v * T::splat(2.0))
}

impl Component<f64> {
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
            false => matrix(equations.bodies[i].turning.full()) + columns(|by| self.lopsided_inertia(i, by)[1]) * share,
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

impl<T: Real> Component<T> {
    /// The inertia's torque T on a body times dt^2 [kg m^2], and what its derivative along a turn has beyond the symmetric part of
    /// that of `I phi`.
    ///
    /// I turns along: all is as it is, and phi less by as much. So the derivative of `I phi` is `s I + I [phi]x / 2 - [I phi]x`
    /// with the cosine s of half the angle, and `I [phi]x + [phi]x I = [tr(I) phi - I phi]x`.
    #[inline(always)]
    fn lopsided_inertia(&self, i: usize, by: Vec3<T>) -> [Vec3<T>; 2] {
        let q = self.poses[i].q;
        let (cosine, phi) = turn_since(q, self.predicted[i].q);
        let inertia = self.inertia_of(i, q);
        let of = |x: Vec3<T>| inertia.apply(x);
        let torque = of(phi);
        let Sym3([xx, yy, zz, ..]) = inertia;
        let beyond = (phi * (T::splat(0.25) * (xx + yy + zz)) - torque * T::splat(1.25)).cross(by);
        if self.multistep.is_none() {
            return [torque, beyond];
        }
        let half = T::splat(0.5);
        let turned = |cosine: T, turn: Vec3<T>| by * cosine - by.cross(turn) * half;
        let (cosine_since, theta) = turn_since(q, self.start[i].q);
        let extra = gyroscopic(of, theta, phi);
        let change = gyroscopic(of, turned(cosine_since, theta), phi) + gyroscopic(of, theta, turned(cosine, phi));
        [torque + extra, beyond + by.cross(extra) + change]
    }

    /// What the exact tangent leaves out of the torques on bodies as they move by `dp`, with its sign turned, one entry a body
    /// [kg m^2]; returns the largest residual [rad] that it would leave. Equations are those of [`Self::gather`].
    pub(crate) fn left_out(&self, equations: &Equations<T>, dp: &[Spatial<T>], torques: &mut Vec<Vec3<T>>) -> T {
        torques.clear();
        torques.resize(self.poses.len(), Vec3::zero());
        let dt2 = self.effective * self.effective;
        // Torques that do not turn along with the body.
        for load in &self.loads {
            torques[load.body] += load.torque * dt2;
        }
        for (own, pushed) in torques.iter_mut().zip(&self.pushed) {
            *own += pushed.angular;
        }
        let bodies = equations.bodies.iter().zip(dp);
        vectorized(
            #[inline(always)]
            || {
                let mut largest = T::zero();
                for (i, (own, (body, dp))) in torques.iter_mut().zip(bodies).enumerate() {
                    let constant = std::mem::replace(own, Vec3::zero());
                    if body.is_held() {
                        continue;
                    }
                    let [of_inertia, beyond] = self.lopsided_inertia(i, dp.angular);
                    // What turns along with the body balances the inertia's torque but for the defect.
                    let turning_along = of_inertia + body.defect.angular - constant;
                    *own = -(beyond + turning_along.cross(dp.angular) * T::splat(0.5));
                    let left = self.system.bodies[i].inverse_inertia.apply(*own);
                    largest = largest.max(left.norm_squared());
                }
                largest.sqrt()
            },
        )
    }
}
