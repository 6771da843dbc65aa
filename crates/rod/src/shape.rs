//! Centrelines and the material frames along them.

use std::f64::consts::TAU;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::Pose;

mod curve;
mod hung;
mod knot;

pub use curve::resample;
pub use hung::{HUNG_SEGMENTS, Hung};
pub use knot::{KNOT_CLEARANCE, KNOT_ROPE, KNOT_SEGMENTS, knot};

/// `segments + 1` nodes [m] on a line from `start` [m] along `direction` (any length but zero), `length` [m] long.
pub fn straight(start: Vector3<f64>, direction: Vector3<f64>, length: f64, segments: usize) -> Vec<Vector3<f64>> {
    let step = direction.normalize() * (length / segments as f64);
    (0..=segments).map(|i| start + step * i as f64).collect()
}

/// `segments + 1` nodes [m] on a helix that winds down from `start` about a vertical axis (world -z).
///
/// `radius` HR, `height` HH [m] and `winding` HW, the number of turns, are the paper's (Table 1).
pub fn helix(start: Vector3<f64>, radius: f64, height: f64, winding: f64, segments: usize) -> Vec<Vector3<f64>> {
    let node = |i: usize| {
        let t = i as f64 / segments as f64;
        let angle = TAU * winding * t;
        start + Vector3::new(radius * (angle.cos() - 1.0), radius * angle.sin(), -height * t)
    };
    (0..=segments).map(node).collect()
}

/// `segments` nodes [m] of a circle of `radius` [m] about `centre` in the plane of world x and y; the last joins the first.
///
/// The circle goes through the nodes, so that the polygon's perimeter is a little shorter than 2 pi radius.
pub fn ring(centre: Vector3<f64>, radius: f64, segments: usize) -> Vec<Vector3<f64>> {
    let node = |i: usize| {
        let angle = TAU * i as f64 / segments as f64;
        centre + radius * Vector3::new(angle.cos(), angle.sin(), 0.0)
    };
    (0..segments).map(node).collect()
}

/// Poses of the segments between consecutive nodes [m]: centre, and a frame without twist (parallel transport).
///
/// `twist` [rad] turns the frames about the centreline, from 0 at the first segment to `twist` at the last.
/// Consecutive nodes must not coincide.
pub fn frames(nodes: &[Vector3<f64>], twist: f64) -> Vec<Pose> {
    let count = nodes.len().saturating_sub(1);
    let mut poses: Vec<Pose> = Vec::with_capacity(count);
    let mut untwisted = UnitQuaternion::identity();
    for (i, pair) in nodes.windows(2).enumerate() {
        let tangent = (pair[1] - pair[0]).normalize();
        let axis = untwisted * Vector3::z();
        untwisted = rotation_between(&axis, &tangent) * untwisted;
        let share = if count > 1 { i as f64 / (count - 1) as f64 } else { 0.0 };
        let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), twist * share);
        poses.push(Pose { position: 0.5 * (pair[0] + pair[1]), orientation: untwisted * roll });
    }
    poses
}

/// The smallest rotation that takes unit vector `from` to unit vector `to`; a half turn about any normal if opposite.
fn rotation_between(from: &Vector3<f64>, to: &Vector3<f64>) -> UnitQuaternion<f64> {
    // (1 + cos, sin axis) is twice cos(angle / 2) times the rotation: no arc cosine, which rounding takes beyond 1.
    let scalar = 1.0 + from.dot(to);
    if scalar > 1e-12 {
        return UnitQuaternion::from_quaternion(Quaternion::from_parts(scalar, from.cross(to)));
    }
    let helper = if from.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let normal = nalgebra::Unit::new_normalize(from.cross(&helper));
    UnitQuaternion::from_axis_angle(&normal, std::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_follow_the_tangent_and_do_not_twist() {
        let nodes = helix(Vector3::zeros(), 0.5, 0.4, 2.5, 60);
        let poses = frames(&nodes, 0.0);
        for (pose, pair) in poses.iter().zip(nodes.windows(2)) {
            assert!((pose.orientation * Vector3::z() - (pair[1] - pair[0]).normalize()).norm() < 1e-12);
        }
        for pair in poses.windows(2) {
            assert!(crate::darboux::darboux(&pair[0].orientation, &pair[1].orientation, 1.0).z.abs() < 1e-12);
        }
    }

    #[test]
    fn a_hairpin_turn_gives_finite_frames() {
        let nodes = [Vector3::zeros(), Vector3::z(), Vector3::zeros()];
        let poses = frames(&nodes, 0.0);
        assert!((poses[1].orientation * Vector3::z() + Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn straight_rods_in_any_direction_have_finite_frames() {
        for i in 0..2000 {
            let (sin, cos) = (i as f64 * 0.01).sin_cos();
            let nodes = straight(Vector3::new(0.1, 0.2, 0.3), Vector3::new(cos, 0.3 * sin, sin), 1.0, 40);
            let poses = frames(&nodes, 0.0);
            for (pose, pair) in poses.iter().zip(nodes.windows(2)) {
                assert!((pose.orientation * Vector3::z() - (pair[1] - pair[0]).normalize()).norm() < 1e-12);
            }
        }
    }
}
