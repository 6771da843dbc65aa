//! Single lanes, and slopes, of vectors, poses and turns.

use kernels::Spatial;
use kernels::dual::Dual;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::pose::BodyPose;

#[inline(always)]
pub(super) fn vec3(v: &Vector3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z]
}

#[inline(always)]
pub(super) fn put<T: Real>(target: &mut Vec3<T>, lane: usize, v: [f64; 3]) {
    for (t, x) in target.0.iter_mut().zip(v) {
        t.set_lane(lane, x);
    }
}

/// Takes one lane over from another vector, with all that it carries.
#[inline(always)]
pub(super) fn copy_lane<T: Real>(target: &mut Vec3<T>, lane: usize, from: Vec3<T>) {
    for (t, x) in target.0.iter_mut().zip(from.0) {
        t.copy_lane(lane, x);
    }
}

pub(super) fn pick<T: Real>(v: Vec3<T>, lane: usize) -> Vec3<f64> {
    Vec3(v.0.map(|x| x.lane(lane)))
}

/// A spatial vector of one lane.
pub fn pick_spatial<T: Real>(x: &Spatial<T>, lane: usize) -> Spatial<f64> {
    Spatial { linear: pick(x.linear, lane), angular: pick(x.angular, lane) }
}

/// A pose of one lane.
pub fn pick_pose<T: Real>(pose: &BodyPose<T>, lane: usize) -> BodyPose<f64> {
    BodyPose { x: pick(pose.x, lane), q: Quat { v: pick(pose.q.v, lane), w: pose.q.w.lane(lane) } }
}

pub(super) fn copy_pose<T: Real, U: Real>(to: &mut BodyPose<T>, lane: usize, from: &BodyPose<U>, from_lane: usize) {
    let from = pick_pose(from, from_lane);
    put(&mut to.x, lane, from.x.0);
    put(&mut to.q.v, lane, from.q.v.0);
    to.q.w.set_lane(lane, from.q.w);
}

/// Copies a spatial vector from lane to lane.
pub fn copy_spatial<T: Real, U: Real>(to: &mut Spatial<T>, lane: usize, from: &Spatial<U>, from_lane: usize) {
    let from = pick_spatial(from, from_lane);
    put(&mut to.linear, lane, from.linear.0);
    put(&mut to.angular, lane, from.angular.0);
}

#[inline(always)]
pub(super) fn get<T: Real>(v: Vec3<T>, lane: usize) -> Vector3<f64> {
    Vector3::new(v.0[0].lane(lane), v.0[1].lane(lane), v.0[2].lane(lane))
}

pub(super) fn get_quat<T: Real>(q: Quat<T>, lane: usize) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::from_parts(q.w.lane(lane), get(q.v, lane)))
}

/// `then` in the lanes where `condition` >= 0, else `otherwise`.
#[inline(always)]
pub(super) fn select<T: Real>(condition: T, then: Spatial<T>, otherwise: Spatial<T>) -> Spatial<T> {
    let (a, b) = (then.to_array(), otherwise.to_array());
    let mut out = b;
    for k in 0..6 {
        out[k] = condition.select(a[k], b[k]);
    }
    Spatial::from_array(out)
}

/// `then` in the lanes where `condition` >= 0, else `otherwise`.
#[inline(always)]
pub(super) fn select_pose<T: Real>(condition: T, then: BodyPose<T>, otherwise: BodyPose<T>) -> BodyPose<T> {
    let of = |pose: BodyPose<T>| Spatial { linear: pose.x, angular: pose.q.v };
    let kept = select(condition, of(then), of(otherwise));
    BodyPose { x: kept.linear, q: Quat { v: kept.angular, w: condition.select(then.q.w, otherwise.q.w) } }
}

/// Sets the slope of a vector along a direction.
pub(crate) fn set_slope<const D: usize>(x: &mut Vec3<Dual<D>>, k: usize, by: &Vector3<f64>) {
    for (own, by) in x.0.iter_mut().zip(by) {
        own.slope[k] = *by;
    }
}
