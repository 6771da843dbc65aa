//! Constraints, residuals, Jacobians and mass matrices: the linear system of an outer iteration.

use jointed::rotation::RotationRows;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Sym3, Vec3};

use super::turns::gyroscopic;
use super::{Component, Residuals};
use crate::formulation::Formulation;

impl<T: Real> Component<T> {
    /// Evaluates constraints, residuals, Jacobians and mass matrices at the current poses and multipliers: the linear
    /// system of this outer iteration (line 9 of Algorithm 1, its left half).
    #[inline(never)]
    pub fn evaluate(&mut self, formulation: Formulation) -> Residuals<T> {
        T::dispatch(
            #[inline(always)]
            || self.evaluate_kernel(formulation),
        )
    }

    #[inline(always)]
    fn evaluate_kernel(&mut self, formulation: Formulation) -> Residuals<T> {
        if !self.released.is_empty() {
            self.follow_faces();
        }
        self.evaluate_bodies(formulation);
        if !self.released.is_empty() {
            self.free_rows();
        }
        let mut residuals = match self.extras.is_empty() && self.laws.is_empty() && self.broken.is_empty() {
            true => self.evaluate_joints::<false>(),
            false => self.evaluate_joints::<true>(),
        };
        if formulation.momentum() {
            match self.multistep.is_some() {
                true => self.evaluate_momentum::<true>(&mut residuals),
                false => self.evaluate_momentum::<false>(&mut residuals),
            }
        } else if self.torques_wait {
            self.evaluate_torques(&mut residuals);
        }
        residuals
    }

    #[inline(always)]
    fn evaluate_bodies(&mut self, formulation: Formulation) {
        let geometric = formulation.momentum();
        if geometric && !self.pulls_hold {
            self.gather_pulls();
        }
        for (i, terms) in self.system.bodies.iter_mut().enumerate() {
            let constants = &self.bodies[i];
            let q = self.poses[i].q;
            let axis = q.axis();
            terms.orientation = q;
            terms.axis = axis;
            terms.inverse_mass = constants.inverse_mass;
            terms.inverse_inertia = if geometric {
                let mut inertia = constants.world_inertia(axis) + geometric_stiffness(self.pulls[i], axis);
                if let Some(&of_contacts) = self.contact_stiffness.get(i) {
                    inertia += of_contacts;
                }
                inertia.inverse() * constants.free
            } else {
                let (across, along) = (constants.free / constants.transverse, constants.free / constants.axial);
                Sym3::identity(across) + Sym3::outer(axis, along - across)
            };
        }
        if !self.extras.across.is_empty() {
            self.turn_places();
        }
        if !self.rigid.is_empty() {
            self.evaluate_rigid(geometric);
        }
    }

    /// Sums `z lambda_s` (and z F of the loads times dt^2) per body, the force by which its axis is pulled.
    #[inline(always)]
    fn gather_pulls(&mut self) {
        self.pulls.fill(Vec3::zero());
        for ((&[a, b], terms), lambda) in self.system.topology.joints.iter().zip(&self.system.joints).zip(&self.lambda)
        {
            self.pulls[a as usize] += lambda.linear * terms.offsets[0];
            self.pulls[b as usize] -= lambda.linear * terms.offsets[1];
        }
        self.add_loads_pulls();
    }

    /// Adds the loads' share to the pulls.
    #[inline(always)]
    pub(super) fn add_loads_pulls(&mut self) {
        let dt2 = self.effective * self.effective;
        for load in &self.loads {
            self.pulls[load.body] += load.force * (load.offset * dt2);
        }
        if !self.rigid.is_empty() {
            self.gather_rigid_pulls();
        }
        self.pulls_hold = true;
    }

    /// The pulls with which a step begins: those of the step before, as long as it lasted. Its multipliers
    /// begin with zero, but a taut rod is taut from the start, and a first correction that did not know would break the
    /// balance of momentum for good.
    #[inline(always)]
    pub(super) fn expect_pulls(&mut self) {
        let dt2 = self.effective * self.effective;
        for (pull, held) in self.pulls.iter_mut().zip(&self.held) {
            *pull = *held * dt2;
        }
        self.expect_rigid_pulls();
        self.pulls_hold = true;
    }

    /// The multipliers, if there are any yet, are a guess for the step's end: from here on the pulls are theirs.
    pub fn expect_multipliers(&mut self) {
        self.drop_free_multipliers();
        let is_zero = |x: &Spatial<T>| (0..T::LANES).all(|lane| x.dot(*x).lane(lane) == 0.0);
        self.pulls_hold &= self.lambda.iter().all(is_zero);
    }

    #[inline(always)]
    fn evaluate_joints<const EXTRAS: bool>(&mut self) -> Residuals<T> {
        let zero = T::zero();
        let mut worst = Residuals { stretch: zero, bend: zero, momentum: zero, check: zero };
        if EXTRAS {
            self.laws.missed = 0.0;
        }
        for (k, terms) in self.system.joints.iter_mut().enumerate() {
            let [a, b] = self.system.topology.joints[k].map(|body| body as usize);
            let (first, second) = (&self.poses[a], &self.poses[b]);
            let (axis_a, axis_b) = (self.system.bodies[a].axis, self.system.bodies[b].axis);
            let constants = &self.joints[k];
            let lambda = self.lambda[k];
            let mut gap = first.x - second.x + axis_a * terms.offsets[0] - axis_b * terms.offsets[1];
            let (mut frame, mut other, mut rest) = (first.q, second.q, constants.rest);
            let mut bend_extra = T::zero();
            if EXTRAS {
                if let Some(across) = self.system.across.get(k) {
                    gap = gap + across[0] - across[1];
                }
                if let Some(rests) = self.extras.rests.get(k) {
                    (frame, other) = (first.q * rests[0], second.q * rests[1]);
                    self.system.frames[k] = frame;
                }
                if let Some(damped) = self.extras.damped.get(k) {
                    rest = damped.rest;
                    gap -= first.q.rotate(damped.gap);
                }
                bend_extra = self.system.bend_extra.get(k).map_or(bend_extra, |&extra| extra);
            }
            let relative = (frame.conj() * other).upper();
            let (rows, measured) = RotationRows::new(self.strain_measure, relative);
            (terms.rows, terms.t) = (rows, frame.rotate(relative.v));
            let measured = measured * (T::splat(1.0) / terms.length);
            let strain = measured - rest;
            let mut stretch =
                gap + lambda.linear * terms.shear + axis_a * (terms.stretch_extra * axis_a.dot(lambda.linear));
            let mut bend = strain + lambda.angular * terms.bend;
            if EXTRAS {
                if let Some(&extra) = self.system.shear_extra.get(k) {
                    let d2 = first.q.second_axis();
                    stretch += d2 * (extra * d2.dot(lambda.linear));
                }
                bend.0[1] += lambda.angular.0[1] * bend_extra;
            }
            bend.0[2] += lambda.angular.0[2] * terms.twist_extra;
            let mut bend_measure = bend;
            if EXTRAS {
                let of_rows = (measured - constants.rest, lambda.angular);
                // An open grip holds nothing.
                if self.laws.has(k) && !self.released.iter().any(|one| one.opens(k)) {
                    let rows = self.laws.rows(k, of_rows, terms.length, [self.dt, self.effective.lane(0)]);
                    rows.put(terms, &mut self.system.bend_extra[k], &mut self.system.bend_couplings[k]);
                    (bend, bend_measure) = (rows.residual, rows.measure);
                } else if let Some(couplings) = self.system.bend_couplings.get_mut(k) {
                    *couplings = Vec3::zero();
                }
            }
            if EXTRAS && self.broken.get(k) == Some(&true) {
                // Its bodies go on by themselves.
                terms.rhs = Spatial::zero();
                continue;
            }
            terms.rhs = Spatial { linear: -stretch, angular: -bend };
            let inverse_length = T::splat(1.0) / terms.length;
            let stretch = stretch.norm_squared() * (inverse_length * inverse_length);
            let bend = bend_measure.norm_squared() * (terms.length * terms.length);
            worst.stretch = worst.stretch.max(stretch);
            worst.bend = worst.bend.max(bend);
            worst.check += stretch + bend;
        }
        worst.stretch = worst.stretch.sqrt();
        worst.bend = worst.bend.sqrt();
        worst
    }

    /// Adds the momentum residual `g = M (p - p*) - J^T lambda` (and the loads' torques) to the system: `b += J M^-1 g`. Steps
    /// that build on those before ask for the `GYROSCOPIC` share of second order.
    #[inline(always)]
    fn evaluate_momentum<const GYROSCOPIC: bool>(&mut self, worst: &mut Residuals<T>) {
        self.gather_torques(true);
        for (impulse, &pushed) in self.scratch.iter_mut().zip(&self.pushed) {
            *impulse = impulse.plus(pushed, T::splat(1.0));
        }
        self.eyelets.push(&mut self.scratch);
        let Self { system, scratch, lambda, .. } = self;
        for (j, &lambda) in lambda.iter().enumerate() {
            let q_a = system.frame(j);
            system.add_impulse(j, system.joints[j].multipliers_to_world(lambda, q_a), scratch);
        }
        let two = T::splat(2.0);
        for i in 0..self.segments {
            let (constants, pose, predicted) = (&self.bodies[i], &self.poses[i], &self.predicted[i]);
            let axis = self.system.bodies[i].axis;
            let phi = (pose.q * predicted.q.conj()).upper().v * two;
            let inertia =
                |x: Vec3<T>| x * constants.transverse + axis * (axis.dot(x) * (constants.axial - constants.transverse));
            let mut turning = inertia(phi);
            if GYROSCOPIC {
                let theta = (pose.q * self.start[i].q.conj()).upper().v * two;
                turning += gyroscopic(inertia, theta, phi);
            }
            let impulse = self.scratch[i];
            // The translation's part of M^-1 g, without the detour over the mass.
            let dx = (predicted.x - pose.x) * constants.free + impulse.linear * constants.inverse_mass;
            let dphi = self.system.bodies[i].inverse_inertia.apply(impulse.angular - turning);
            self.momentum[i] = Spatial { linear: dx, angular: dphi };
        }
        if !self.rigid.is_empty() {
            self.momentum_of_rigid();
        }
        self.add_momentum(worst);
    }

    /// Adds the loads' torques to the first system of a step that has no momentum residual.
    #[inline(always)]
    fn evaluate_torques(&mut self, worst: &mut Residuals<T>) {
        self.gather_torques(false);
        for i in 0..self.segments {
            self.momentum[i] = self.system.correction(i, self.scratch[i]);
        }
        self.add_momentum(worst);
    }

    /// Sums the loads' torques times dt^2 per body; of loads that follow, if they are to be turned, also what their forces are beyond the predicted ones.
    #[inline(always)]
    fn gather_torques(&mut self, turns: bool) {
        self.momentum.resize(self.scratch.len(), Spatial::zero());
        self.scratch.fill(Spatial::zero());
        let dt2 = self.effective * self.effective;
        for load in &mut self.loads {
            let own = &mut self.scratch[load.body];
            if turns && load.own.is_some() {
                own.linear += load.turn(&self.poses[load.body].q) * dt2;
            }
            let arm = self.system.bodies[load.body].axis * load.offset;
            own.angular += (load.torque + arm.cross(load.force)) * dt2;
        }
    }

    /// Carries the corrections in `momentum` over to the residuals, and to the right-hand sides if they are not kept apart.
    #[inline(always)]
    fn add_momentum(&mut self, worst: &mut Residuals<T>) {
        let mut largest = T::zero();
        for (constants, dp) in self.bodies.iter().zip(&self.momentum).take(self.segments) {
            let size = dp.linear.norm_squared() / (constants.length * constants.length);
            let turn = dp.angular.norm_squared();
            largest = largest.max(size).max(turn);
            worst.check += size + turn;
        }
        worst.momentum = largest.sqrt();
        if !self.is_apart {
            self.bring_momentum_in();
        }
    }

    /// Carries the corrections in `momentum` over to the right-hand sides: `b += J M^-1 g`.
    #[inline(always)]
    pub fn bring_momentum_in(&mut self) {
        let Self { system, momentum, .. } = self;
        for j in 0..system.joints.len() {
            let q_a = system.frame(j);
            let terms = &system.joints[j];
            let change = terms.from_world(system.constraint_change(j, momentum), q_a);
            system.joints[j].rhs = terms.rhs.plus(change, T::splat(-1.0));
        }
    }
}

/// K+, the geometric stiffness of a pull `f` [N m s^2] on a body's axis d, without its negative part.
///
/// `K = (f.d) I - sym(f d^T)` has the eigenvalues `|f| (cos, (cos + 1) / 2, (cos - 1) / 2)` with cos the cosine of the
/// angle between f and d; the last belongs to f/|f| + d, the second to f/|f| - d.
#[inline(always)]
fn geometric_stiffness<T: Real>(f: Vec3<T>, axis: Vec3<T>) -> Sym3<T> {
    let (zero, one) = (T::zero(), T::splat(1.0));
    let along = f.dot(axis);
    let size = f.norm_squared().sqrt();
    // The square of the inverse, which derivatives take, must be finite.
    let unit = f * (one / size.max(T::splat(1e-150)));
    let sign = along.select(one, -one);
    let pulled = along.select(one, zero);
    let cosine = unit.dot(axis) * sign;
    let bisector = unit + axis * sign;
    let rest = (size - along.abs()).max(zero) / (T::splat(4.0) * (one + cosine));
    Sym3::identity(along * pulled) + Sym3::sym_outer(f * pulled, -axis) + Sym3::outer(bisector, rest)
}
