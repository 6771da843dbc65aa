//! Rods that lie, and stay, in a plane.

use component::Component;
use kernels::Spatial;
use kernels::math::Vec3;
use nalgebra::Vector3;
use rod::{Model, State};

/// The body axis that is normal to a planar rod's plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normal {
    /// d1.
    D1,
    /// d2.
    D2,
}

impl Normal {
    /// Index of the axis, 0 for d1.
    pub fn axis(self) -> usize {
        match self {
            Self::D1 => 0,
            Self::D2 => 1,
        }
    }
}

/// How far a direction may lean out of the plane, or a place lie above it in units of the model's size.
const TOLERANCE: f64 = 1e-9;

/// The body axis normal to the plane in which all of the model lies and stays, if there is one.
///
/// It must be the same axis in every body, with gravity, forces and velocities in the plane, and rest Darboux vectors,
/// torques and angular velocities along its normal, and air at rest or in a steady wind within the plane. Rods whose material
/// frames are rolled against their plane are not found; their features are as good, only without the exact symmetry. Nor are
/// models in which something is driven or changes over time.
pub fn planar_normal(model: &Model, state: &State) -> Option<Normal> {
    [Normal::D1, Normal::D2].into_iter().find(|&normal| is_planar(model, state, normal))
}

fn is_planar(model: &Model, state: &State, normal: Normal) -> bool {
    if !model.motions.is_empty() || !model.changes.is_empty() || model.has_followers() {
        return false;
    }
    let mut axis = Vector3::zeros();
    axis[normal.axis()] = 1.0;
    let (Some(q), Some(&origin)) = (state.orientations.first(), state.positions.first()) else { return false };
    let n = q * axis;
    let size: f64 = model.segments.iter().map(|segment| segment.length).sum();
    let anchors = || model.anchors.iter();
    let orientations = state.orientations.iter().chain(anchors().map(|anchor| &anchor.orientation));
    let positions = state.positions.iter().chain(anchors().map(|anchor| &anchor.position));
    let loads = || model.loads.iter();
    let is_windy = |air: &rod::Air| {
        !air.wind.is_steady() || {
            let wind = air.wind.velocity(&origin, 0.0);
            wind.dot(&n).abs() > TOLERANCE * wind.norm()
        }
    };
    if model.air.as_ref().is_some_and(is_windy) {
        return false;
    }
    let within = state.velocities.iter().chain([&model.gravity]).chain(loads().map(|load| &load.force));
    let across = state.angular_velocities.iter().chain(loads().map(|load| &load.torque));
    orientations.into_iter().all(|q| (q * axis).cross(&n).norm() <= TOLERANCE)
        && positions.into_iter().all(|x| (x - origin).dot(&n).abs() <= TOLERANCE * size)
        && within.into_iter().all(|v| v.dot(&n).abs() <= TOLERANCE * v.norm())
        && across.into_iter().all(|w| w.cross(&n).norm() <= TOLERANCE * w.norm())
        && model.joints.iter().all(|j| j.rest_darboux.cross(&axis).norm() * j.length <= TOLERANCE)
}

/// Takes out of corrections `dp` (world axes, one entry a node) and multipliers `dlambda` (stretch-shear in world axes,
/// bend-twist in the sender's body frame, one entry an edge) what a planar rod's exact ones do not have: shifts and
/// forces along the normal, turns and moments across it. Either may be empty.
pub fn project_to_plane(
    component: &Component<f64>,
    normal: Normal,
    dp: &mut [Spatial<f64>],
    dlambda: &mut [Spatial<f64>],
) {
    let mut axis = Vec3::zero();
    axis.0[normal.axis()] = 1.0;
    let Some(first) = component.poses.first() else { return };
    // One for all bodies, up to its sign.
    let n = first.q.rotate(axis);
    for dp in dp {
        *dp = Spatial { linear: dp.linear - n * n.dot(dp.linear), angular: n * n.dot(dp.angular) };
    }
    for dlambda in dlambda {
        let angular = axis * axis.dot(dlambda.angular);
        *dlambda = Spatial { linear: dlambda.linear - n * n.dot(dlambda.linear), angular };
    }
}
