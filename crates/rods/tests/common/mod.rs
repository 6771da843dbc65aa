//! Models and states that are changed a little.

use rods::derivative::Variation;
use rods::prelude::*;

/// Numbers that look random.
fn number(seed: usize) -> f64 {
    (12.9898 * (seed as f64 + 1.0)).sin() * 43.758_545_3 % 1.0
}

pub(crate) fn vector(seed: usize) -> Vector3<f64> {
    Vector3::from_fn(|k, _| number(3 * seed + k))
}

/// The model and the state, moved along a variation.
#[allow(dead_code)]
pub(crate) fn moved(model: &Model, state: &State, by: &Variation, share: f64) -> (Model, State) {
    let (mut model, mut state) = (model.clone(), state.clone());
    for (joint, by) in model.joints.iter_mut().zip(&by.joints) {
        joint.rest_darboux += by.rest_darboux * share;
        joint.stretch_compliance += by.stretch_compliance * share;
        joint.shear_compliance += by.shear_compliance * share;
        joint.shear_extra += by.shear_extra * share;
        joint.bend_compliance += by.bend_compliance * share;
        joint.bend_extra += by.bend_extra * share;
        joint.twist_compliance += by.twist_compliance * share;
    }
    for (segment, by) in model.segments.iter_mut().zip(&by.segments) {
        let factor = 1.0 + by.mass / segment.own_mass() * share;
        segment.density *= factor;
        if let Some(body) = &mut segment.body {
            body.mass *= factor;
        }
        if let Some(inertia) = &mut segment.line_inertia {
            inertia.mass *= factor;
            inertia.polar *= factor;
        }
    }
    for (load, [force, torque]) in model.loads.iter_mut().zip(&by.loads) {
        load.force += force * share;
        load.torque += torque * share;
    }
    if let Some(air) = &mut model.air {
        air.density += by.air.density * share;
        air.normal_drag += by.air.normal_drag * share;
        air.tangential_drag += by.air.tangential_drag * share;
        air.wind = Wind::steady(air.wind.velocity(&Vector3::zeros(), 0.0) + by.air.wind * share);
    }
    model.gravity += by.gravity * share;
    model.damping.linear += by.damping[0] * share;
    model.damping.angular += by.damping[1] * share;
    for i in 0..state.positions.len() {
        state.positions[i] += by.start.positions[i] * share;
        state.orientations[i] = UnitQuaternion::from_scaled_axis(by.start.turns[i] * share) * state.orientations[i];
        state.velocities[i] += by.start.velocities[i] * share;
        state.angular_velocities[i] += by.start.angular_velocities[i] * share;
    }
    for held in &by.held {
        let [shift, turn] = held.poses[0].map(|x| x * share);
        let turn = UnitQuaternion::from_scaled_axis(turn);
        match held.body {
            Body::Segment(i) => {
                state.positions[i] += shift;
                state.orientations[i] = turn * state.orientations[i];
            }
            Body::Anchor(i) => {
                model.anchors[i].position += shift;
                model.anchors[i].orientation = turn * model.anchors[i].orientation;
            }
        }
    }
    (model, state)
}
