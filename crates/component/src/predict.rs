//! Prediction (lines 1 to 5 of Algorithm 1) and the free rotation of a segment.

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};

use super::constants::BodyConstants;
use super::parts::select;
use super::turns::angular_momentum;
use super::{BodyPose, Component};
use crate::formulation::Formulation;

impl<T: Real> Component<T> {
    /// Lines 1 to 5 of Algorithm 1: symplectic Euler for velocities and poses, and lambda = 0. In air it adds the drag
    /// that `Component::evaluate_drag` has evaluated for this step.
    ///
    /// The rotation is the discrete free motion of a symmetric top (the gyroscopic term included): with the relative
    /// rotation (s, u) of a step in the body's frame, `s I u + u x I u = (dt / 2) m`, where m is the body's angular
    /// momentum, `(2 / dt)(s I u - u x I u)` of the step before. It keeps the angular momentum to rounding and gives
    /// back `w = 2 Im(q' conj(q)) / dt` (Moser and Veselov 1991). After a step of another length the rate goes on instead, with
    /// Euler's rule: the momentum of a shorter step may be that of no turn of a longer one. Torques of loads come in with the first
    /// linear system, which holds the joints' answer: alone they could turn a light segment about many times in a step. Where there is
    /// no solution (towards half a turn a step) the rotation goes on as it was; beyond half a turn no pose shows it, and
    /// the step is not converged. Nor is it beyond a right angle where loads alone turn a segment, as a larger turn has less momentum. What moves by itself is placed where it is to be at `time + dt` [s]. Where the integrator
    /// builds on several steps, velocity and momentum are those that the `multistep` module says.
    #[inline(never)]
    pub fn predict(&mut self, time: f64, dt: f64, formulation: Formulation) {
        T::dispatch(
            #[inline(always)]
            || self.predict_kernel(time, dt, formulation),
        )
    }

    #[inline(always)]
    fn predict_kernel(&mut self, time: f64, dt: f64, formulation: Formulation) {
        self.begin_step(time, dt);
        self.take_momenta_of_rates();
        if formulation.momentum() {
            self.expect_pulls();
        } else {
            self.pulls_hold = false;
        }
        let h = T::splat(dt);
        let half = T::splat(0.5 * dt);
        let last_half = self.last_half();
        let is_other = self.has_given || last_half != half;
        let one = T::splat(1.0);
        let decay = self.damping.map(|rate| if rate == T::zero() { one } else { (-rate * h).exp() });
        // Forces act for this long on the velocity over the step; dt with Euler's rule.
        let share = self.multistep.as_ref().map_or(one, |steps| steps.share());
        let pushed = self.effective * share;
        let mut unsolved = T::zero();
        // The square of the sine of half a turn.
        let most = T::splat(1.0 + 1e-9) - self.turned_by_loads() * T::splat(0.5 + 1e-9);
        if !self.loads.is_empty() {
            self.scratch.fill(Spatial::zero());
            for load in &mut self.loads {
                load.begin(&self.poses[load.body].q);
                self.scratch[load.body].linear += load.force;
            }
        }
        self.torques_wait = self.loads.iter().any(|load| load.turns);
        for i in 0..self.segments {
            let constants = &self.bodies[i];
            let pose = self.poses[i];
            self.start[i] = pose;
            let old = self.velocities[i];
            let free = constants.free;
            let kept = [one + (decay[0] - one) * free, one + (decay[1] - one) * free];
            let (rate, last_half) = if is_other { self.variable(i, last_half) } else { (old.angular, last_half) };
            let w = pose.q.rotate_back(rate);
            let euler = |kept: [T; 2]| Spatial {
                linear: old.linear * kept[0],
                angular: angular_momentum(constants.inertia(w), w * last_half) * kept[1],
            };
            let start = match &self.multistep {
                None => euler(kept),
                Some(steps) => {
                    let Spatial { linear, angular } = steps.predicted(i, old.linear);
                    let Vec3([x, y, z]) = pose.q.rotate_back(angular);
                    // What air adds to the inertia takes part in the motion from here on.
                    let heavier = constants.transverse / steps.transverse(i);
                    let free_motion = Spatial { linear, angular: Vec3([x * heavier, y * heavier, z]) };
                    // What is held goes on at its own velocity.
                    if free == one { free_motion } else { select(free - one, free_motion, euler(kept)) }
                }
            };
            let (mut v, mut m) = (start.linear, start.angular);
            v += self.gravity * (pushed * free);
            if !self.loads.is_empty() {
                v += self.scratch[i].linear * (pushed * constants.inverse_mass);
            }
            if let Some(drag) = &self.drag {
                v += drag.impulses[i].linear * share;
                m += drag.impulses[i].angular * share;
            }
            let (turn, solved) = free_turn(constants, m, w, half);
            let within = most - (w * last_half).norm_squared();
            let not_solved = unsolved.max(free);
            unsolved = solved.select(within.select(unsolved, not_solved), not_solved);
            self.predicted[i] = BodyPose { x: pose.x + v * h, q: (pose.q * turn).normalized() };
        }
        self.carry_stored(pushed);
        self.unsolved = unsolved;
        if !self.rigid.is_empty() {
            self.turn_rigid(last_half, decay[1]);
        }
        // Open grips begin where their faces are, whether they have been looked at between steps or not.
        if !self.released.is_empty() {
            self.follow_faces();
        }
        for i in self.segments..self.poses.len() {
            self.predicted[i] = self.poses[i];
            self.start[i] = self.poses[i];
        }
        if !self.moved.is_empty() {
            self.follow_motions();
        }
        self.poses.copy_from_slice(&self.predicted);
        self.lambda.fill(Spatial::zero());
        self.set_compliances();
        self.begin_beyond();
        self.begin_laws();
        self.stiffen_stored();
    }

    /// 1 in the lanes where loads turn a segment that no joint holds, else 0. What joints hold is solved with them, and forces that are out of balance show.
    pub(crate) fn turned_by_loads(&self) -> T {
        let mut turned = T::zero();
        if self.system.joints.is_empty() {
            self.loads.iter().filter(|load| load.turns).for_each(|load| turned.set_lane(load.lane, 1.0));
        }
        turned
    }

    fn set_compliances(&mut self) {
        let k = T::splat(1.0) / (self.effective * self.effective);
        for (terms, joint) in self.system.joints.iter_mut().zip(&self.joints) {
            terms.shear = joint.shear * k;
            terms.stretch_extra = (joint.stretch - joint.shear) * k;
            terms.bend = joint.bend * k;
            terms.twist_extra = (joint.twist - joint.bend) * k;
        }
    }
}

/// Relative rotation, in the body's frame, of the free motion with angular momentum `m`; where there is none (more than
/// about a half turn a step) the rotation goes on with `w`. With it, a number that is < 0 where that is more than half a
/// turn. See [`Component::predict`].
#[inline(always)]
fn free_turn<T: Real>(body: &BodyConstants<T>, m: Vec3<T>, w: Vec3<T>, half_dt: T) -> (Quat<T>, T) {
    let one = T::splat(1.0);
    let [hx, hy, hz] = (m * half_dt).0;
    let difference = body.axial - body.transverse;
    // With y = s^2 and u_z = h_z / (s I_a): y + a / y + b / (c y + d / y) = 1.
    let uz = hz / body.axial;
    let (a, b, c) = (uz * uz, hx * hx + hy * hy, body.transverse * body.transverse);
    let d = difference * difference * a;
    // Two turns have the same momentum: less and more than a right angle. The one nearer to the last step's counts.
    let u = w * half_dt;
    let mut y = (one - u.norm_squared()).max(T::splat(0.01));
    for _ in 0..4 {
        let inverse = one / y;
        let across = one / (c * y + d * inverse);
        let value = y + a * inverse + b * across - one;
        let slope = one - a * inverse * inverse - b * (c - d * inverse * inverse) * across * across;
        y = (y - value / slope).max(T::splat(0.01));
    }
    let s = y.sqrt();
    let z = uz / s;
    // s I_t u_x + (I_a - I_t) u_y u_z = h_x, s I_t u_y - (I_a - I_t) u_x u_z = h_y.
    let (p, r) = (s * body.transverse, difference * z);
    let inverse = one / (p * p + r * r);
    let top = Quat { v: Vec3([(p * hx - r * hy) * inverse, (p * hy + r * hx) * inverse, z]), w: s };
    let defect = (top.v.norm_squared() + s * s - one).abs();
    let solved = T::splat(1e-9) - defect;
    let scalar = (one - u.norm_squared()).max(T::zero()).sqrt();
    let plain = Quat { v: u, w: scalar };
    let pick = |x: T, y: T| solved.select(x, y);
    let v = Vec3([pick(top.v.0[0], plain.v.0[0]), pick(top.v.0[1], plain.v.0[1]), pick(top.v.0[2], plain.v.0[2])]);
    let within_half_a_turn = T::splat(1.0 + 1e-9) - u.norm_squared();
    (Quat { v, w: pick(s, plain.w) }, solved.max(within_half_a_turn))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn top(transverse: f64, axial: f64) -> BodyConstants<f64> {
        BodyConstants { inverse_mass: 1.0, transverse, axial, free: 1.0, length: 1.0, radius: 1.0 }
    }

    /// The solver's variable of a turn by `angle` about `axis` in a step of 2 s: its sine.
    fn variable(axis: Vec3<f64>, angle: f64) -> Vec3<f64> {
        axis * ((0.5 * angle).sin() / axis.norm_squared().sqrt())
    }

    #[test]
    fn a_free_turn_has_the_momentum_that_it_was_made_of() {
        // A needle, a ball and a disc; s I u + u x I u = (dt / 2) m.
        for body in [top(1.0, 0.01), top(1.0, 1.0), top(1.0, 1.9)] {
            for axis in [Vec3([1.0, 0.0, 0.0]), Vec3([0.0, 0.0, 1.0]), Vec3([0.3, -1.0, 0.5])] {
                for angle in [0.0, 1e-8, 0.1, 0.7, 1.2] {
                    let w = variable(axis, angle);
                    let m = angular_momentum(body.inertia(w), w);
                    let (turn, solved) = free_turn(&body, m, w, 1.0);
                    assert!(solved >= 0.0, "{body:?} {axis:?} {angle}");
                    let inertia =
                        |u: Vec3<f64>| Vec3([u.0[0] * body.transverse, u.0[1] * body.transverse, u.0[2] * body.axial]);
                    let found = inertia(turn.v) * turn.w + turn.v.cross(inertia(turn.v));
                    assert!((found - m).norm_squared().sqrt() <= 1e-9, "{body:?} {axis:?} {angle}: {found:?} {m:?}");
                    assert!((turn.v.norm_squared() + turn.w * turn.w - 1.0).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn about_a_main_axis_a_free_turn_goes_on_as_it_was() {
        for body in [top(1.0, 0.01), top(1.0, 1.9)] {
            for axis in [Vec3([0.6, 0.8, 0.0]), Vec3([0.0, 0.0, 1.0])] {
                // Both sides of the right angle, where two turns have the same momentum.
                for angle in [0.3, 1.5, 2.0, 2.8] {
                    let w = variable(axis, angle);
                    let (turn, _) = free_turn(&body, angular_momentum(body.inertia(w), w), w, 1.0);
                    assert!((turn.v - w).norm_squared().sqrt() < 1e-9, "{body:?} {axis:?} {angle}: {turn:?}");
                    assert!((turn.w - (0.5 * angle).cos()).abs() < 1e-9);
                }
            }
        }
    }
}
