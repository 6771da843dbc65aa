//! Runs that are read, models and states that are changed a little, and differences of what is read.

use cosserat::derivative::{Forward, Recording, StateVariation, Variation};
use cosserat::prelude::*;

/// A state, and what joints transmit in it.
pub(crate) type Seen = (State, Vec<JointForce>);

/// Weights of states and of what joints transmit, each after so many steps.
pub(crate) type Weights = [(usize, StateVariation)];

/// Steps that are solved to rounding errors, and halved after so many iterations.
pub(crate) fn settings(integrator: Integrator, max_iterations: usize) -> Settings {
    let step = StepParams {
        formulation: Formulation::Newton,
        integrator,
        relative_tolerance: 1e-12,
        motion_tolerance: 1e-12,
        absolute_tolerance: 1e-14,
        contact_tolerance: 1e-9,
        max_iterations,
        ..StepParams::default()
    };
    Settings { step, ..Settings::default() }
}

/// Takes steps of a model and reads it after some of them, in ascending order; `check` sees every step.
pub(crate) fn read(
    recording: &mut Recording,
    (model, state): (&Model, &State),
    (dt, read): (f64, &[usize]),
    mut check: impl FnMut(&Recording, usize, StepReport),
) -> Vec<Seen> {
    let mut seen = Vec::new();
    for step in 1..=read.last().copied().unwrap_or(0) {
        let report = recording.step(dt).unwrap();
        check(recording, step, report);
        if read.contains(&step) {
            let mut now = (state.clone(), vec![JointForce::default(); model.joints.len()]);
            recording.store(&mut now.0);
            recording.simulation().store_joint_forces(&mut now.1);
            seen.push(now);
        }
    }
    seen
}

/// What weights say of states and of what joints transmit, counted from others.
pub(crate) fn reading(of: &[Seen], weights: &Weights, about: &[Seen]) -> f64 {
    let mut sum = 0.0;
    for (((state, forces), (_, weights)), (about, forces_about)) in of.iter().zip(weights).zip(about) {
        for ((own, weight), about) in forces.iter().zip(&weights.forces).zip(forces_about) {
            sum += weight.force.dot(&(own.force - about.force)) + weight.moment.dot(&(own.moment - about.moment));
        }
        for i in 0..state.positions.len() {
            let turn = (state.orientations[i] * about.orientations[i].inverse()).scaled_axis();
            sum += weights.positions[i].dot(&(state.positions[i] - about.positions[i]))
                + weights.turns[i].dot(&turn)
                + weights.velocities[i].dot(&(state.velocities[i] - about.velocities[i]))
                + weights.angular_velocities[i].dot(&(state.angular_velocities[i] - about.angular_velocities[i]));
        }
    }
    sum
}

/// What forward sensitivities say of weights, a number a direction, and the sum of the sizes of what that is made of.
pub(crate) fn carried(forward: &mut Forward, model: &Model, dt: f64, weights: &Weights) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 2]; forward.directions()];
    let mut change = StateVariation::with_forces(model);
    for step in 1..=weights.last().map_or(0, |(step, _)| *step) {
        forward.step(dt).unwrap();
        for (_, weights) in weights.iter().filter(|(own, _)| *own == step) {
            for (k, [sum, size]) in sums.iter_mut().enumerate() {
                forward.store_change(k, &mut change);
                *sum += weights.dot(&change);
                *size += parts(weights, &change);
            }
        }
    }
    sums
}

/// Sum of the sizes of what the product of positions and of what joints transmit is made of.
pub(crate) fn parts(weights: &StateVariation, change: &StateVariation) -> f64 {
    let force = |(a, b): (&JointForce, &JointForce)| (a.force.dot(&b.force)).abs() + a.moment.dot(&b.moment).abs();
    let place = |(a, b): (&Vector3<f64>, &Vector3<f64>)| a.dot(b).abs();
    weights.forces.iter().zip(&change.forces).map(force).sum::<f64>()
        + weights.positions.iter().zip(&change.positions).map(place).sum::<f64>()
}

/// A central difference of second order.
pub(crate) fn of_second_order(step: f64, at: impl Fn(f64) -> f64) -> f64 {
    (at(step) - at(-step)) / (2.0 * step)
}

/// One of fourth order.
pub(crate) fn of_fourth_order(step: f64, at: impl Fn(f64) -> f64) -> f64 {
    (8.0 * (at(step) - at(-step)) - (at(2.0 * step) - at(-2.0 * step))) / (12.0 * step)
}

/// Gradients, forward sensitivities with the sum of the sizes of what they are made of, and differences through contacts along one direction.
pub(crate) fn assert_agree(what: &str, found: f64, [carried, size]: [f64; 2], expected: f64) {
    println!("{what}: {found:e} {carried:e} {expected:e}");
    assert!((found - carried).abs() <= 1e-8 * found.abs() + 1e-13, "{what}: {found:e} {carried:e}");
    assert!((found - expected).abs() <= 1e-4 * expected.abs() + 1e-7 * size + 1e-9, "{what}: {found:e} {expected:e}");
}

/// Numbers that look random.
fn number(seed: usize) -> f64 {
    (12.9898 * (seed as f64 + 1.0)).sin() * 43.758_545_3 % 1.0
}

pub(crate) fn vector(seed: usize) -> Vector3<f64> {
    Vector3::from_fn(|k, _| number(3 * seed + k))
}

/// The model and the state, moved along a variation.
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
            body.inertia += by.inertia * share;
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
