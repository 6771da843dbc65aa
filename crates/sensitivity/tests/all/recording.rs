//! The way back through a run: checkpoints, threads, and what forward sensitivities do not know.

use std::sync::Arc;

use dynamics::formulation::Formulation;
use dynamics::simulation::Settings;
use dynamics::step::{Status, StepParams};
use jointed::linear::solvers::SolverKind;
use nalgebra::{UnitQuaternion, Vector3};
use rod::Integrator;
use rod::{
    Air, Assembly, Body, BodyShape, Driven, InnerDamping, Interpolation, JointForce, Load, Model, Motion, Pose,
    RigidBody, RodSpec, State, Wind, shape,
};
use sensitivity::{Forward, Parameter, Recording, Rods, SegmentVariation, StateVariation, Variation, Wanted};

use crate::common::*;

const STEPS: usize = 11;
const STEP: f64 = 0.01;

fn solved(integrator: Integrator) -> Settings {
    let step = StepParams {
        formulation: Formulation::Newton,
        integrator,
        relative_tolerance: 1e-13,
        motion_tolerance: 1e-13,
        absolute_tolerance: 1e-14,
        max_iterations: 60,
        ..StepParams::DEFAULT
    };
    Settings { step, solver: SolverKind::Direct }
}

/// Numbers of the size of one, all different.
fn numbers(seed: usize, i: usize) -> Vector3<f64> {
    Vector3::from_fn(|k, _| ((1 + 7 * i + 3 * k + 13 * seed) as f64).sin())
}

fn weights(segments: usize, seed: usize) -> StateVariation {
    let list = |of: usize, size: f64| (0..segments).map(|i| numbers(seed + of, i) * size).collect();
    StateVariation {
        positions: list(0, 1.0),
        turns: list(1, 0.3),
        velocities: list(2, 0.03),
        angular_velocities: list(3, 0.01),
        ..StateVariation::default()
    }
}

/// Two rods that move by themselves, one of them damped inside.
fn two_rods() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for (height, segments) in [(0.0, 8), (1.0, 5)] {
        let from = Vector3::new(0.0, 0.0, height);
        let rod =
            assembly.rod(&RodSpec::new(shape::straight(from, Vector3::x(), 1.0, segments), 0.01, material(1e7, 1e3)));
        assembly.fix(rod.start);
    }
    let (mut model, mut state) = assembly.finish();
    for i in (0..13).filter(|&i| !model.segments[i].fixed) {
        state.angular_velocities[i] = Vector3::new(0.0, 10.0 + i as f64, 0.0);
    }
    for joint in model.joints.iter_mut().take(7) {
        joint.inner_damping = InnerDamping { bending: 0.02, twist: 0.03, stretch: 0.01 };
    }
    (model, state)
}

/// The gradient, and whether a step was halved.
fn gradient((model, state): &(Model, State), settings: &Settings, (stretch, dt): (usize, f64)) -> (Variation, bool) {
    let mut recording = Recording::with_checkpoints(model, state, settings, stretch).unwrap();
    let mut objective = Vec::new();
    let mut is_halved = false;
    for step in 1..=STEPS {
        // Steps of different lengths.
        let report = recording.step(dt * (1.0 + 0.1 * (step % 3) as f64)).unwrap();
        is_halved |= report.status == Status::ConvergedInSubsteps;
        if step % 4 == 0 || step == STEPS {
            let joint = |j| JointForce { force: numbers(step, j) * 0.1, moment: numbers(step + 4, j) };
            let forces = (0..model.joints.len()).map(joint).collect();
            objective.push((step, StateVariation { forces, ..weights(model.segments.len(), step) }));
        }
    }
    let first = recording.backward(&objective, Wanted::ALL).unwrap();
    let again = recording.backward(&objective, Wanted::ALL).unwrap();
    assert_eq!(first, again, "going back changes nothing");
    let mut ends = [state.clone(), state.clone()];
    recording.store(&mut ends[0]);
    let mut plain = Recording::new(model, state, settings).unwrap();
    for step in 1..=STEPS {
        plain.step(dt * (1.0 + 0.1 * (step % 3) as f64)).unwrap();
    }
    plain.store(&mut ends[1]);
    assert_eq!(ends[0], ends[1], "the simulation is where it was");
    (first, is_halved)
}

#[test]
fn checkpoints_give_the_same_bits() {
    let scene = two_rods();
    for integrator in Integrator::ALL {
        let all = solved(integrator);
        let few = Settings { step: StepParams { max_iterations: 6, ..all.step }, ..all };
        for (settings, dt) in [(all, STEP), (few, 0.08)] {
            let (kept, is_halved) = gradient(&scene, &settings, (usize::MAX, dt));
            assert_eq!(is_halved, dt > STEP, "{integrator:?} {dt}");
            for stretch in [1, 3, STEPS] {
                assert_eq!(gradient(&scene, &settings, (stretch, dt)).0, kept, "{integrator:?} {stretch}");
            }
        }
    }
}

/// The `k`-th of some chains that differ in all but their connectivity.
fn add_chain(assembly: &mut Assembly, k: usize) {
    let from = Vector3::new(0.0, 0.3 * k as f64, 0.0);
    let towards = Vector3::new(1.0, 0.1 * k as f64, 0.2);
    let line = shape::straight(from, towards, 1.0 + 0.1 * k as f64, 7);
    let rod = assembly.rod(&RodSpec::new(line, 0.01, material(1e7 * (1 + k) as f64, 1e3)));
    assembly.fix(rod.start);
}

fn chains(which: std::ops::Range<usize>) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    which.clone().for_each(|k| add_chain(&mut assembly, k));
    let (mut model, mut state) = assembly.finish();
    for (i, segment) in model.segments.iter().enumerate().filter(|(_, segment)| !segment.fixed) {
        // One of them turns so fast that its steps are halved.
        let k = which.start + i / 7;
        let rate = if k == 2 { 60.0 } else { 3.0 };
        state.angular_velocities[i] = Vector3::new(0.0, rate + segment.length * (i % 7) as f64, 0.0);
    }
    for joint in &mut model.joints {
        joint.inner_damping = InnerDamping { bending: 0.02, twist: 0.03, stretch: 0.01 };
    }
    (model, state)
}

#[test]
fn rods_in_lanes_have_the_gradients_of_rods_alone() {
    const RODS: usize = 5;
    for integrator in Integrator::ALL {
        let all = solved(integrator);
        let settings = Settings { step: StepParams { max_iterations: 5, ..all.step }, ..all };
        let of = |(model, state): &(Model, State)| {
            let mut recording = Recording::new(model, state, &settings).unwrap();
            let halved =
                (0..STEPS).filter(|_| recording.step(5.0 * STEP).unwrap().status == Status::ConvergedInSubsteps);
            let halved = halved.count();
            let mut end = weights(7, 1);
            let repeat = |list: &mut Vec<Vector3<f64>>| *list = list.repeat(model.segments.len() / 7);
            let lists = [&mut end.positions, &mut end.turns, &mut end.velocities, &mut end.angular_velocities];
            lists.into_iter().for_each(repeat);
            (recording.backward(&[(STEPS, end)], Wanted::ALL).unwrap(), halved)
        };
        let (together, halved) = of(&chains(0..RODS));
        assert!(halved > 0, "none was halved");
        for k in 0..RODS {
            let (alone, _) = of(&chains(k..k + 1));
            let (segments, joints) = (7 * k..7 * k + 7, 6 * k..6 * k + 6);
            assert_eq!(together.segments[segments.clone()], alone.segments, "{integrator:?} {k}");
            assert_eq!(together.joints[joints], alone.joints, "{integrator:?} {k}");
            assert_eq!(together.start.positions[segments.clone()], alone.start.positions, "{integrator:?} {k}");
            assert_eq!(together.start.turns[segments.clone()], alone.start.turns);
            assert_eq!(together.start.velocities[segments.clone()], alone.start.velocities);
            assert_eq!(together.start.angular_velocities[segments], alone.start.angular_velocities);
        }
    }
}

/// Cables between two grips, a hinge at the first, while the second moves: loops through what is held. Each has 8 segments, 9
/// joints and 2 anchors.
fn cables(which: std::ops::Range<usize>, in_air: bool) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for k in which.clone() {
        let line = shape::helix(Vector3::y() * k as f64, 0.3, 0.2 + 0.05 * k as f64, 1.0, 8);
        let rod = assembly.rod(&RodSpec::new(line, 0.02, material(1e7 * (1 + k) as f64, 500.0)));
        assembly.clamp_start(&rod).clamp_end(&rod);
        let (force, torque) = (numbers(k, 0), numbers(k, 1) * 0.01);
        assembly.load(Load { segment: rod.start + 3, offset: 0.02, force, torque, follows: false });
    }
    let (mut model, mut state) = assembly.finish();
    for (own, k) in which.enumerate() {
        model.hinge(model.joints_of(&(8 * own..8 * own + 8))[0], &Vector3::new(0.3, 1.0, 0.2));
        let Pose { position, orientation } = model.anchors[2 * own + 1];
        let shift = Vector3::new(0.0, 0.02, 0.01) * (1 + k) as f64;
        let frames = [(0.0, Pose { position, orientation }), (0.2, Pose { position: position + shift, orientation })];
        let motion = Motion::through(&frames, Interpolation::Linear).unwrap();
        model.motions.push(Driven::new(Body::Anchor(2 * own + 1), Arc::new(motion)));
        (0..8).for_each(|i| state.angular_velocities[8 * own + i] = numbers(k, i));
    }
    if in_air {
        let wind = Wind::steady(Vector3::new(4.0, 3.0, 0.3));
        model.air = Some(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
    }
    (model, state)
}

#[test]
fn cables_in_lanes_have_the_gradients_of_cables_alone() {
    const CABLES: usize = 4;
    for (integrator, in_air) in [(Integrator::Euler, false), (Integrator::Bdf2, false), (Integrator::Bdf2, true)] {
        let of = |(model, state): &(Model, State), stretch: usize| {
            let mut recording = Recording::with_checkpoints(model, state, &solved(integrator), stretch).unwrap();
            let mut objective = Vec::new();
            for step in 1..=STEPS {
                assert_eq!(recording.step(STEP).unwrap().status, Status::Converged);
                let mut weights = StateVariation::with_forces(model);
                for i in 0..model.segments.len() {
                    (weights.positions[i], weights.turns[i]) = (numbers(step, i % 8), numbers(step + 1, i % 8) * 0.3);
                    weights.velocities[i] = numbers(step + 2, i % 8) * 0.01;
                }
                for (j, own) in weights.forces.iter_mut().enumerate() {
                    *own = JointForce { force: numbers(step, j % 9) * 0.1, moment: numbers(step + 4, j % 9) };
                }
                objective.push((step, weights));
            }
            recording.backward(&objective, Wanted::ALL).unwrap()
        };
        let together = of(&cables(0..CABLES, in_air), usize::MAX);
        assert_eq!(of(&cables(0..CABLES, in_air), 4), together);
        let mut gravity = Vector3::zeros();
        for k in 0..CABLES {
            let alone = of(&cables(k..k + 1, in_air), usize::MAX);
            let (segments, joints) = (8 * k..8 * k + 8, 9 * k..9 * k + 9);
            assert_eq!(together.segments[segments.clone()], alone.segments, "{integrator:?} {in_air} {k}");
            assert_eq!(together.joints[joints], alone.joints, "{integrator:?} {in_air} {k}");
            assert_eq!(together.loads[k..k + 1], alone.loads, "{integrator:?} {in_air} {k}");
            assert_eq!(together.start.positions[segments.clone()], alone.start.positions);
            assert_eq!(together.start.angular_velocities[segments], alone.start.angular_velocities);
            for held in &alone.held {
                let Body::Anchor(anchor) = held.body else { unreachable!() };
                let body = Body::Anchor(2 * k + anchor);
                let same = together.held.iter().find(|other| other.body == body).unwrap();
                assert_eq!(same.poses, held.poses, "{integrator:?} {in_air} {k}");
            }
            gravity += alone.gravity;
        }
        assert_eq!(together.gravity, gravity);
    }
}

#[test]
fn threads_give_the_same_bits() {
    let scene = two_rods();
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| gradient(&scene, &solved(Integrator::Bdf2), (4, STEP)).0)
    };
    assert_eq!(of(1), of(2));
    assert_eq!(of(1), of(4));
}

#[test]
fn threads_give_forward_sensitivities_the_same_bits() {
    let (model, state) = two_rods();
    let directions = [Parameter::Bending(Rods::One(0)), Parameter::Density(Rods::All)].map(|of| of.variation(&model));
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut forward = Forward::new(&model, &state, &solved(Integrator::Bdf2), &directions).unwrap();
            (0..STEPS).for_each(|_| forward.step(STEP).map(drop).unwrap());
            [0, 1].map(|direction| {
                let mut change = StateVariation::zero(model.segments.len());
                forward.store_change(direction, &mut change);
                change
            })
        })
    };
    assert_eq!(of(1), of(3));
}

#[test]
fn a_stretch_has_a_step() {
    let (model, state) = helix(8);
    let error = Recording::with_checkpoints(&model, &state, &solved(Integrator::Euler), 0).err().unwrap();
    assert_eq!(error.to_string(), "checkpoints must be a step apart at least");
}

/// A rod with a box at its end, on which a force acts off its centre.
fn with_body() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::helix(Vector3::zeros(), 0.3, 0.4, 1.0, 6);
    let end = nodes[6];
    let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e7, 500.0)));
    let (sides, place) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.05, 0.1, -0.15));
    let orientation = UnitQuaternion::from_euler_angles(0.2, -0.3, 0.5);
    let pose = Pose { position: end - orientation * place, orientation };
    let body = assembly.body(RigidBody::new(BodyShape::Box { sides }, 0.5), pose);
    assembly.fix(rod.start).join_body(rod.end - 1, 1.0, body, &place);
    let (model, mut state) = assembly.finish();
    for i in 1..model.segments.len() {
        state.velocities[i] = numbers(1, i) * 0.3;
        state.angular_velocities[i] = numbers(2, i) * 2.0;
    }
    (model, state)
}

/// The weights' sum over the last state, turns counted from another.
fn reading(state: &State, weights: &StateVariation, about: &State) -> f64 {
    let of = |i: usize| {
        let turn = state.orientations[i] * about.orientations[i].inverse();
        weights.positions[i].dot(&state.positions[i])
            + weights.turns[i].dot(&turn.scaled_axis())
            + weights.velocities[i].dot(&state.velocities[i])
            + weights.angular_velocities[i].dot(&state.angular_velocities[i])
    };
    (0..state.positions.len()).map(of).sum()
}

#[test]
fn the_way_back_knows_rigid_bodies() {
    let (model, state) = with_body();
    let count = model.segments.len();
    let mut wrong = Vec::new();
    for settings in Integrator::ALL.map(solved) {
        let run = |model: &Model, state: &State| {
            let mut recording = Recording::new(model, state, &settings).unwrap();
            (0..STEPS).for_each(|_| assert!(recording.step(STEP).is_ok()));
            let mut end = state.clone();
            recording.store(&mut end);
            (recording, end)
        };
        let (mut recording, end) = run(&model, &state);
        let weights = weights(count, 5);
        let gradient = recording.backward(&[(STEPS, weights.clone())], Wanted::ALL).unwrap();
        // Of the body and of the segments: states, compliances, gravity, the body's inertia.
        let share = 1e-4;
        let mut changes: Vec<(&str, Variation)> = Vec::new();
        for (name, bodies) in [("body", count - 1..count), ("segments", 1..count - 1)] {
            for part in 0..4 {
                let mut variation = Variation::zero(&model);
                let start = &mut variation.start;
                for i in bodies.clone() {
                    let list =
                        [&mut start.positions, &mut start.turns, &mut start.velocities, &mut start.angular_velocities];
                    let size = [1e-2, 1e-2, 1.0, 1.0][part];
                    for (k, list) in list.into_iter().enumerate().filter(|(k, _)| *k == part) {
                        list[i] = numbers(k, i) * size;
                    }
                }
                changes.push((name, variation));
            }
        }
        let mut gravity = Variation::zero(&model);
        gravity.gravity = Vector3::new(0.3, -0.2, 1.0);
        changes.push(("gravity", gravity));
        let mut inertia = Variation::zero(&model);
        inertia.segments[count - 1] = SegmentVariation { mass: 0.1, inertia: Vector3::new(1e-3, -5e-4, 8e-4) };
        changes.push(("inertia", inertia));
        let mut bending = Variation::zero(&model);
        for (own, joint) in bending.joints.iter_mut().zip(&model.joints) {
            own.bend_compliance = joint.bend_compliance;
            own.rest_darboux = Vector3::new(0.3, -0.2, 0.1);
        }
        changes.push(("joints", bending));
        for (name, by) in changes {
            let at = |share: f64| {
                let (mut model, mut state) = (model.clone(), state.clone());
                model.gravity += by.gravity * share;
                if let Some(body) = &mut model.segments[count - 1].body {
                    body.mass += by.segments[count - 1].mass * share;
                    body.inertia += by.segments[count - 1].inertia * share;
                }
                for (joint, by) in model.joints.iter_mut().zip(&by.joints) {
                    joint.bend_compliance += by.bend_compliance * share;
                    joint.rest_darboux += by.rest_darboux * share;
                }
                for i in 0..count {
                    state.positions[i] += by.start.positions[i] * share;
                    let turn = UnitQuaternion::from_scaled_axis(by.start.turns[i] * share);
                    state.orientations[i] = turn * state.orientations[i];
                    state.velocities[i] += by.start.velocities[i] * share;
                    state.angular_velocities[i] += by.start.angular_velocities[i] * share;
                }
                reading(&run(&model, &state).1, &weights, &end)
            };
            let expected = (8.0 * (at(share) - at(-share)) - (at(2.0 * share) - at(-2.0 * share))) / (12.0 * share);
            let found = gradient.dot(&by);
            let error = (found - expected).abs() / expected.abs().max(1e-4);
            if error >= 1e-6 {
                wrong.push(format!("{:?} {name}: {found:e}, differences say {expected:e}", settings.step.integrator));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
