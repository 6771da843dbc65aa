//! What joints transmit: how it changes with poses and multipliers, and the way back.
//!
//! Over the square of the step of implicit Euler that a step amounts to, the force of a joint is `lambda_s` and its moment
//! `-F^T lambda_b / l` in the frame of body a, with F of [`RotationRows`] (see [`rod::JointForce::of_multipliers`]). As the bodies are turned, with w the
//! turn of b less that of a in that frame, `F^T lambda_b` changes by `A w + w x F^T lambda_b / 2`, with A of [`RotationRows::second`].

use jointed::rotation::RotationRows;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};
use nalgebra::Vector3;
use rod::JointForce;

use super::Component;
use super::tangent::vector;

/// A joint between two bodies as they are turned.
struct Turned<T> {
    /// Frame of body a, with what a rest frame turns it by, and that alone.
    frame: Quat<T>,
    rest: Quat<T>,
    /// The relative rotation.
    between: Quat<T>,
    /// `-1 / (l h^2)` and `1 / h^2`; zero before the first step.
    scale: T,
    per: T,
}

impl<T: Real> Component<T> {
    fn turned_joint(&self, j: usize) -> Turned<T> {
        let [a, b] = self.system.topology.joints[j].map(|body| self.poses[body as usize].q);
        let [rest, of_b] = self.extras.rests.get(j).copied().unwrap_or([Quat::identity(); 2]);
        let frame = a * rest;
        let (zero, one) = (T::zero(), T::splat(1.0));
        let per = (-self.effective).select(zero, one / (self.effective * self.effective));
        let scale = -per / self.system.joints[j].length;
        Turned { frame, rest, between: (frame.conj() * (b * of_b)).upper(), scale, per }
    }

    /// From derivatives with respect to what a joint transmits, force and moment, to those with respect to `y`, which is
    /// `-dlambda` in world rows, and with respect to the turn of body b in world axes, less which is that of body a.
    pub fn transmitted_back(&self, j: usize, of: Spatial<T>) -> (Spatial<T>, Vec3<T>) {
        let Turned { frame, rest, between, scale, per } = self.turned_joint(j);
        let (rows_of, u) = (RotationRows::new(self.strain_measure, between).0, between.v);
        let lambda = self.lambda[j].angular;
        let moment = rest.rotate_back(of.angular);
        let rows = Spatial { linear: of.linear * -per, angular: rows_of.forward(u, moment) * -scale };
        let torque = rows_of.forward_transposed(u, lambda);
        let second = rows_of.second(self.strain_measure, u, lambda);
        let turn = (second.apply(moment) + torque.cross(moment) * T::splat(0.5)) * scale;
        let system = &self.system;
        let world = system.joints[j].to_world(self.without_free_rows(j, rows), system.frame(j));
        (world, frame.rotate(turn))
    }
}

impl Component<f64> {
    /// What a joint transmits more at the end of the step that is solved, where its bodies are turned by so much in world axes
    /// [rad], and its multipliers change by `rows`.
    pub fn transmitted_along(&self, j: usize, turns: [Vector3<f64>; 2], rows: [Vector3<f64>; 2]) -> JointForce {
        let Turned { frame, rest, between, scale, per } = self.turned_joint(j);
        let (rows_of, u) = (RotationRows::new(self.strain_measure, between).0, between.v);
        let lambda = self.lambda[j].angular;
        let turn = frame.rotate_back(Vec3((turns[1] - turns[0]).into()));
        let by = Vec3(rows[1].into());
        let torque = rows_of.forward_transposed(u, lambda);
        let second = rows_of.second(self.strain_measure, u, lambda);
        let moment = (rows_of.forward_transposed(u, by) + second.apply(turn) + turn.cross(torque) * 0.5) * scale;
        JointForce { force: rows[0] * per, moment: vector(rest.rotate(moment)) }
    }

    /// What the multipliers of a joint change by, in their rows, with the answer `y`, which is `-dlambda` in world rows.
    pub fn answered(&self, j: usize, y: Spatial<f64>) -> [Vector3<f64>; 2] {
        let rows = self.system.joints[j].multipliers_from_world(-y, self.system.frame(j));
        let Spatial { linear, angular } = self.without_free_rows(j, rows);
        [vector(linear), vector(angular)]
    }
}
