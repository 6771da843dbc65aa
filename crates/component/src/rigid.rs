//! Rigid bodies: three moments of inertia of their own, and joints that hold them off their axes.
//!
//! The stages go over all bodies as over symmetric tops that are held on their axes; what is here then sets right what is not
//! so, in the body's lane. Without a rigid body the lists are empty.

mod step;

use kernels::lane::Real;
use kernels::math::{Quat, Sym3, Vec3};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::parts::pick;
use crate::snapshot::StateVisitor;

/// A rigid body, in one lane; while it is held its inertia counts nothing.
#[derive(Clone, Debug)]
pub(super) struct Rigid<T> {
    pub(super) lane: usize,
    pub(super) body: usize,
    pub(super) mass: f64,
    /// Drag coefficient times area [m^2].
    pub(super) drag_area: f64,
    /// Moments of inertia about its own axes [kg m^2], the same in all lanes.
    pub(super) inertia: Vec3<T>,
    /// Joints that hold it, each with the sign of its multiplier and the connector's place in the body's frame [m].
    held_by: Vec<(usize, f64, Vec3<f64>)>,
    /// `sum f r^T` over all that pulls it, f [N s^2] in world axes and r in the body's frame: one vector an axis of the
    /// body. Of a force on the axis alone the third is the pull of a segment.
    pull: [Vec3<f64>; 3],
    /// The same as forces at the end of the last step [N m].
    held: [Vec3<f64>; 3],
}

impl<T: Real> Rigid<T> {
    /// Shows a visitor with which pulls the next step begins.
    pub(super) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.held.iter_mut().for_each(|held| visitor.vector(held));
    }

    /// Inertia times `x`, both in the body's frame.
    fn times_inertia(&self, x: Vec3<T>) -> Vec3<T> {
        Vec3([0, 1, 2].map(|k| self.inertia.0[k] * x.0[k]))
    }

    /// The inertia in world axes.
    pub(super) fn world_inertia(&self, q: Quat<T>) -> Sym3<T> {
        let parts = axes(q).into_iter().zip(self.inertia.0).map(|(axis, moment)| Sym3::outer(axis, moment));
        parts.fold(Sym3::zero(), |sum, part| sum + part)
    }

    /// W, the inverse of the inertia with the geometric stiffness of its pulls, if that counts.
    fn inverse_inertia(&self, q: Quat<T>, geometric: bool) -> Sym3<T> {
        let mut inertia = self.world_inertia(q);
        if geometric && self.pull != [Vec3::zero(); 3] {
            // K = sum (f.r) I - sym(f r^T), without its negative part.
            let mut stiffness = Sym3::zero();
            let own = Quat { v: pick(q.v, self.lane), w: q.w.lane(self.lane) };
            for (pull, axis) in self.pull.into_iter().zip(axes(own)) {
                stiffness = stiffness + Sym3::identity(pull.dot(axis)) + Sym3::sym_outer(pull, -axis);
            }
            inertia += Sym3(positive_part(stiffness).0.map(T::splat));
        }
        inertia.inverse()
    }

    /// Relative rotation, in the body's frame, of the free motion with angular momentum `m` over the time `2 half`, which goes
    /// on with `u` (about the sine of half the angle) where there is none: `s I u + u x I u = half m`, as of a symmetric top
    /// (`Component::predict`).
    fn free_turn(&self, m: Vec3<T>, u: Vec3<T>, half: T) -> Quat<T> {
        let scalar = |u: Vec3<T>| (T::splat(1.0) - u.norm_squared()).max(T::zero()).sqrt();
        let target = m * half;
        let [inertia, goal, start] = [self.inertia, target, u].map(|x| Vector3::from(pick(x, self.lane).0));
        let Some((found, inverse)) = solved_turn(&inertia, &goal, &start) else { return Quat { v: u, w: scalar(u) } };
        // What a last iteration changes is taken of the derivatives alone.
        let mut u = Vec3::splat(Vec3(found.into()));
        let turning = self.times_inertia(u);
        let defect = turning * scalar(u) + u.cross(turning) - target;
        for (row, own) in u.0.iter_mut().enumerate() {
            let parts = defect.0.into_iter().enumerate().map(|(k, x)| x * T::splat(inverse[(row, k)]));
            let change = parts.fold(T::zero(), |sum, part| sum + part);
            *own += T::splat(change.lane(self.lane)) - change;
        }
        Quat { v: u, w: scalar(u) }
    }
}

/// The axes of a body's frame in the world.
fn axes<T: Real>(q: Quat<T>) -> [Vec3<T>; 3] {
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| q.rotate(Vec3::splat(Vec3(axis))))
}
/// A symmetric matrix without its negative eigenvalues; zero where it is not finite.
fn positive_part(m: Sym3<f64>) -> Sym3<f64> {
    let full = m.full();
    let matrix = Matrix3::from_fn(|r, c| full[r][c]);
    let mut positive = Sym3::zero();
    if let Some(eigen) = SymmetricEigen::try_new(matrix, f64::EPSILON, 100) {
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            positive += Sym3::outer(Vec3([vector[0], vector[1], vector[2]]), value.max(0.0));
        }
    }
    positive
}

/// Most iterations of Newton's method for a free turn.
const ITERATIONS: usize = 30;

/// The solution u of `s I u + u x I u = target`, and the inverse of the left side's slope near it; none where none is found.
fn solved_turn(
    inertia: &Vector3<f64>,
    target: &Vector3<f64>,
    start: &Vector3<f64>,
) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let scalar = |u: &Vector3<f64>| (1.0 - u.norm_squared()).max(0.0).sqrt();
    let mut u = start * (0.99 / start.norm()).min(1.0);
    let size = inertia.max();
    for _ in 0..ITERATIONS {
        let s = scalar(&u);
        let turning = u.component_mul(inertia);
        let defect = turning * s + u.cross(&turning) - target;
        let slope = Matrix3::from_diagonal(&(inertia * s)) - turning * u.transpose() / s
            + u.cross_matrix() * Matrix3::from_diagonal(inertia)
            - turning.cross_matrix();
        let inverse = slope.try_inverse()?;
        if defect.norm() <= 4.0 * f64::EPSILON * size * u.norm() {
            return Some((u, inverse));
        }
        let next = u - inverse * defect;
        let change = (next - u).norm();
        u = next * (0.999 / next.norm()).min(1.0);
        if change <= 4.0 * f64::EPSILON * u.norm() && u.norm() < 0.99 {
            return Some((u, inverse));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(inertia: [f64; 3]) -> Rigid<f64> {
        let none = [Vec3::zero(); 3];
        let (inertia, held_by) = (Vec3(inertia), Vec::new());
        Rigid { lane: 0, body: 0, mass: 1.0, drag_area: 0.0, inertia, held_by, pull: none, held: none }
    }

    #[test]
    fn a_general_top_turns_with_the_momentum_that_it_was_made_of() {
        for inertia in [[1.0, 2.0, 2.5], [0.3, 0.31, 0.01], [1.0, 1.0, 1.0]] {
            let body = body(inertia);
            for axis in [Vec3([0.6, 0.8, 0.0]), Vec3([0.48, -0.6, 0.64])] {
                for angle in [0.0_f64, 1e-8, 0.1, 0.7, 1.2] {
                    let u = axis * (0.5 * angle).sin();
                    let turning = body.times_inertia(u);
                    let s = (1.0 - u.norm_squared()).sqrt();
                    let m = turning * s - u.cross(turning);
                    let turn = body.free_turn(m, u, 1.0);
                    let turning = body.times_inertia(turn.v);
                    let found = turning * turn.w + turn.v.cross(turning);
                    assert!((found - m).norm_squared().sqrt() <= 1e-15, "{inertia:?} {axis:?} {angle}");
                    assert!((turn.v.norm_squared() + turn.w * turn.w - 1.0).abs() < 1e-15);
                }
            }
        }
    }

    /// A pull along the z axis alone gives the stiffness of a segment.
    #[test]
    fn the_stiffness_of_a_pull_has_no_negative_part() {
        let q = Quat { v: Vec3([0.1, -0.3, 0.2]), w: 0.9 }.normalized();
        let mut rigid = body([1.0, 2.0, 2.5]);
        let bare = rigid.inverse_inertia(q, false).inverse();
        for f in [Vec3([0.3, -0.2, 5.0]), Vec3([1.0, 2.0, -3.0]), Vec3([0.0, 1.0, 0.0])] {
            for place in [Vec3([0.0, 0.0, 0.4]), Vec3([0.5, -0.2, 0.1])] {
                rigid.pull = place.0.map(|along| f * along);
                let stiffness = rigid.inverse_inertia(q, true).inverse() + bare * -1.0;
                // K has the eigenvalues f.r and (f.r +- |f| |r|) / 2; what is left are those above 0.
                let arm = q.rotate(place);
                let (along, size) = (f.dot(arm), (f.norm_squared() * arm.norm_squared()).sqrt());
                let trace: f64 = [along, 0.5 * (along + size), 0.5 * (along - size)].map(|x| x.max(0.0)).iter().sum();
                let [xx, yy, zz, ..] = stiffness.0;
                assert!((xx + yy + zz - trace).abs() < 1e-12 * size.max(1.0), "{f:?} {place:?}");
                // The bisector of f and r keeps its own.
                let bisector = f * (1.0 / f.norm_squared().sqrt()) - arm * (1.0 / arm.norm_squared().sqrt());
                let image = stiffness.apply(bisector) - bisector * (0.5 * (along + size));
                assert!(image.norm_squared().sqrt() < 1e-12 * size.max(1.0), "{f:?} {place:?}");
            }
        }
    }
}
