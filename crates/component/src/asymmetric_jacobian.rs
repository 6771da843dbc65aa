//! What the exact tangent leaves out of the Jacobian of a step's equations: the parts that are not symmetric.
//!
//! The derivative of a torque T by the turn of its own body is `-H - [T]x / 2` where T is the gradient of an energy with the
//! second derivative H in rotation vectors: two turns do not commute. Tangents need H alone, as at a solution the T sum to
//! zero; the torque of the inertia, which is no gradient, has a derivative of its own.

use jointed::tangent::Equations;
use jointed::tangent::jacobian::Whole;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Sym3, Vec3, cross_matrix, map_rows, sum, transposed};

use super::Component;
use super::turns::gyroscopic;

/// The matrix with the columns `f(e_k)`, row by row.
#[inline(always)]
fn columns<T: Real>(f: impl Fn(Vec3<T>) -> Vec3<T>) -> [[T; 3]; 3] {
    let (zero, one) = (T::zero(), T::splat(1.0));
    transposed([f(Vec3([one, zero, zero])).0, f(Vec3([zero, one, zero])).0, f(Vec3([zero, zero, one])).0])
}

/// The turn since an orientation: its cosine and `2 sin(angle / 2)` times its axis.
#[inline(always)]
pub(super) fn turn_since<T: Real>(q: Quat<T>, before: Quat<T>) -> (T, Vec3<T>) {
    let turn = (q * before.conj()).upper();
    (turn.w, turn.v * T::splat(2.0))
}

impl<T: Real> Component<T> {
    /// What the Jacobian has beyond `equations` that have a `share` of the inertia.
    pub fn whole_blocks(&self, equations: &Equations<T>, share: f64, out: &mut Whole<T>) {
        T::dispatch(
            #[inline(always)]
            || self.all_whole_blocks(equations, T::splat(share), out),
        );
    }

    #[inline(always)]
    fn all_whole_blocks(&self, equations: &Equations<T>, share: T, Whole { bodies, joints }: &mut Whole<T>) {
        bodies.clear();
        for (i, body) in equations.bodies.iter().enumerate() {
            bodies.push(match self.is_still(i) {
                true => [[T::zero(); 3]; 3],
                false => {
                    let lopsided = columns(|by| self.lopsided_inertia(i, by)[1]);
                    sum(body.turning.full(), map_rows(lopsided, |row| row * share))
                }
            });
        }
        let half = T::splat(0.5);
        let dt2 = self.effective * self.effective;
        for load in &self.loads {
            let arm = self.system.bodies[load.body].axis * load.offset;
            self.add_torque(bodies, load.body, arm.cross(load.force * dt2) * half);
        }
        joints.clear();
        for (j, ends) in self.system.topology.joints.iter().enumerate() {
            let [a, b] = [ends[0] as usize, ends[1] as usize];
            let arms = self.arms(j);
            let world = self.system.joints[j].multipliers_to_world(self.lambda[j], self.system.frame(j));
            self.add_torque(bodies, a, (arms[0].cross(world.linear) - world.angular) * half);
            self.add_torque(bodies, b, (world.angular - arms[1].cross(world.linear)) * half);
            joints.push(self.tilted(j, arms[0]));
        }
    }

    /// Adds what half a torque does with a body's block of turns.
    #[inline(always)]
    fn add_torque(&self, bodies: &mut [[[T; 3]; 3]], body: usize, half: Vec3<T>) {
        if !self.is_still(body) {
            bodies[body] = sum(bodies[body], cross_matrix(half));
        }
    }

    /// How a joint's stretch-shear rows change as body a, with the connector's `arm`, turns and takes the frame along that its
    /// compliance and its damping are measured in.
    #[inline(always)]
    fn tilted(&self, j: usize, arm: Vec3<T>) -> [[T; 3]; 3] {
        let (terms, force) = (&self.system.joints[j], self.lambda[j].linear);
        let a = self.system.topology.joints[j][0] as usize;
        let body = &self.system.bodies[a];
        let mut fixed = -arm;
        if let Some(damped) = self.extras.damped.get(j) {
            fixed += body.orientation.rotate(damped.gap);
        }
        let mut out = along(cross_matrix(fixed), body.axis, force, terms.stretch_extra);
        if let Some(&extra) = self.system.shear_extra.get(j) {
            out = along(out, body.orientation.second_axis(), force, extra);
        }
        out
    }
}

/// Adds how a compliance `extra` along an axis answers a force as the axis turns.
#[inline(always)]
fn along<T: Real>(out: [[T; 3]; 3], axis: Vec3<T>, force: Vec3<T>, extra: T) -> [[T; 3]; 3] {
    let turned = cross_matrix(axis * -(axis.dot(force) * extra));
    let crossed = axis.cross(force) * extra;
    let [x, y, z] = axis.0;
    sum(out, sum(turned, [(crossed * x).0, (crossed * y).0, (crossed * z).0]))
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
    pub fn left_out(&self, equations: &Equations<T>, dp: &[Spatial<T>], torques: &mut Vec<Vec3<T>>) -> T {
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
        T::dispatch(
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
