//! Copies in a batch move like each of them alone, to the last bit.

use std::sync::Arc;

use dynamics::batch::Batch;
use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::Status;
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::{
    Air, Assembly, Body, Contacts, Driven, Friction, Interpolation, JointForce, Keyframe, Load, Model, Motion,
    Obstacle, ObstacleShape, RodSpec, State, Surface, Wind, shape,
};

use crate::common::*;

/// What one reads off a copy.
type Seen = (State, Vec<JointForce>);

/// A rod and a shorter one, which differ from copy to copy in all but their connectivity; their grip moves.
fn copy(k: usize) -> (Model, State) {
    let t = k as f64;
    let mut assembly = Assembly::new(GRAVITY);
    let along = Vector3::new(1.0, 0.1 * t, 0.0).normalize();
    for (segments, height) in [(12, 0.0), (7, 0.5)] {
        let nodes = shape::straight(Vector3::z() * height, along, 1.0 + 0.1 * t, segments);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6 * (1.0 + t), 800.0 + t)));
        assembly.clamp_start(&rod);
        let torque = Vector3::x() * 0.01 * (k % 2) as f64;
        assembly.load(Load { segment: rod.end - 2, offset: 0.0, force: Vector3::y() * t, torque, follows: false });
    }
    let (mut model, mut state) = assembly.finish();
    state.velocities[5] = Vector3::new(0.0, 0.3 * t, 0.1);
    state.angular_velocities[3] = Vector3::x() * t;
    model.motions.push(driven(&model, 0.1 * t));
    (model, state)
}

/// The grip of the first rod goes up by `height` [m].
fn driven(model: &Model, height: f64) -> Driven {
    let anchor = model.anchors[0];
    let frame =
        |time, shift| Keyframe { time, position: anchor.position + Vector3::z() * shift, turn: Vector3::zeros() };
    let frames = [frame(0.0, 0.0), frame(0.5, height)];
    Driven::new(Body::Anchor(0), Arc::new(Motion::new(anchor.orientation, &frames, Interpolation::Smooth).unwrap()))
}

fn alone(model: &Model, state: &State, simulation: &Simulation) -> Seen {
    let mut seen = (state.clone(), vec![JointForce::default(); model.joints.len()]);
    simulation.store(&mut seen.0);
    simulation.store_joint_forces(&mut seen.1);
    seen
}

fn in_batch(batch: &mut Batch, copy: usize) -> Seen {
    let mut seen = (State::default(), Vec::new());
    batch.store(copy, &mut seen.0);
    batch.store_joint_forces(copy, &mut seen.1);
    seen
}

/// Steps a batch and each copy alone, and compares.
fn compare(copies: &[(Model, State)], settings: &Settings, what: &str) -> Batch {
    let all: Vec<_> = copies.iter().map(|(model, state)| (model, state)).collect();
    let mut batch = Batch::new(&all, settings, None).unwrap();
    for _ in 0..30 {
        batch.step(DT).unwrap();
    }
    for (k, (model, state)) in copies.iter().enumerate() {
        let mut simulation = Simulation::new(model, state, settings, None).unwrap();
        for _ in 0..30 {
            simulation.step(DT).unwrap();
        }
        assert_eq!(simulation.time(), batch.time());
        assert_eq!(in_batch(&mut batch, k), alone(model, state, &simulation), "{what}, copy {k}");
        let [mut own, mut other] = [Vec::new(), Vec::new()];
        simulation.store_contact_forces(&mut own);
        batch.store_contact_forces(k, &mut other);
        assert_eq!(own, other, "{what}, copy {k}");
    }
    batch
}

#[test]
fn copies_that_differ_in_numbers_states_motions_and_loads() {
    let copies: Vec<_> = (0..11).map(copy).collect();
    for formulation in Formulation::ALL {
        let batch = compare(&copies, &settings(formulation, SolverKind::Direct), formulation.name());
        assert_eq!((batch.len(), batch.in_lanes()), (11, 22), "all in lanes");
    }
}

#[test]
fn copies_in_other_worlds_and_of_other_models() {
    let mut copies: Vec<_> = (0..6).map(copy).collect();
    copies[1].0.gravity = Vector3::zeros();
    copies[2].0.damping.linear = 0.5;
    let wind = Wind::new(Vector3::y() * 5.0, None, None);
    copies[3].0.air = Some(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
    copies[4] = tree();
    copies.push(ring());
    compare(&copies, &Settings::default(), "worlds");
}

/// A rod that falls on the ground, from another height in each copy.
fn falling(k: usize) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(Vector3::z() * (0.02 + 0.01 * k as f64), Vector3::new(1.0, 0.0, 0.2), 0.4, 8);
    assembly.rod(&RodSpec::new(nodes, 0.01, material(1e6, 1000.0)));
    let surface = Surface { friction: Friction::new(0.4), restitution: 0.0 };
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    assembly.model_mut().contacts = Contacts {
        between_segments: Some(surface),
        obstacles: vec![Obstacle::new(ground, surface)],
        allow_overlap: false,
        sheaths: Vec::new(),
    };
    assembly.finish()
}

#[test]
fn copies_with_contacts_do_not_touch_each_other() {
    let mut copies: Vec<_> = (0..3).map(falling).collect();
    copies.push(copy(0));
    compare(&copies, &Settings::default(), "contacts");
}

#[test]
fn what_is_done_to_a_copy_is_done_to_it_alone_and_taken_back() {
    let copies: Vec<_> = (0..9).map(|_| copy(1)).collect();
    let all: Vec<_> = copies.iter().map(|(model, state)| (model, state)).collect();
    let mut batch = Batch::new(&all, &Settings::default(), None).unwrap();
    let mut simulation = Simulation::new(all[0].0, all[0].1, &Settings::default(), None).unwrap();
    let steps = |batch: &mut Batch| (0..20).for_each(|_| assert!(batch.step(DT).is_ok()));
    let snapshot = batch.snapshot();
    steps(&mut batch);
    let first: Vec<_> = (0..9).map(|k| in_batch(&mut batch, k)).collect();
    assert!(first.iter().all(|seen| *seen == first[0]));

    batch.restore(&snapshot).unwrap();
    let (force, torque) = (Vector3::z() * 3.0, Vector3::y() * 0.1);
    let mut state = all[0].1.clone();
    state.velocities[9] = Vector3::x();
    let motion = driven(all[0].0, -0.3);
    batch.set_load(4, 1, force, torque).unwrap();
    batch.drive(4, &motion).unwrap();
    batch.set_velocities(4, &state);
    simulation.set_load(1, force, torque).unwrap();
    simulation.drive(&motion).unwrap();
    simulation.set_velocities(&state);
    steps(&mut batch);
    (0..20).for_each(|_| assert!(simulation.step(DT).is_ok()));
    for (k, first) in first.iter().enumerate() {
        let seen = in_batch(&mut batch, k);
        match k {
            4 => assert_eq!(seen, alone(all[0].0, all[0].1, &simulation)),
            _ => assert_eq!(seen, *first, "copy {k}"),
        }
    }

    batch.restore(&snapshot).unwrap();
    steps(&mut batch);
    assert!((0..9).all(|k| in_batch(&mut batch, k) == first[0]));
    assert!(matches!(batch.restore(&[]), Err(SimulationError::Snapshot)));
}

#[test]
fn a_copy_that_fails_is_named_and_the_others_go_on() {
    for copies in [2, 5] {
        let (model, state) = copy(0);
        let mut batch = Batch::new(&vec![(&model, &state); copies], &Settings::default(), None).unwrap();
        let mut calm = Batch::new(&vec![(&model, &state); copies], &Settings::default(), None).unwrap();
        batch.set_load(1, 0, Vector3::x() * 1e300, Vector3::zeros()).unwrap();
        for _ in 0..3 {
            assert_eq!(batch.step(DT).unwrap().status, Status::NonFinite);
            calm.step(DT).unwrap();
        }
        for k in 0..copies {
            let expected = if k == 1 { Status::NonFinite } else { Status::Converged };
            assert_eq!(batch.status(k), expected, "copy {k} of {copies}");
            if k != 1 {
                assert_eq!(in_batch(&mut batch, k), in_batch(&mut calm, k), "copy {k} of {copies}");
            }
        }
    }
}

#[test]
fn a_copy_that_is_released_and_attached_again_moves_like_it_alone() {
    let copies: Vec<_> = (0..4).map(copy).collect();
    let all: Vec<_> = copies.iter().map(|(model, state)| (model, state)).collect();
    let mut batch = Batch::new(&all, &Settings::default(), None).unwrap();
    let mut simulations: Vec<_> =
        all.iter().map(|(model, state)| Simulation::new(model, state, &Settings::default(), None).unwrap()).collect();
    // The first rod's clamp opens and closes, and the second rod's end is held and let go again.
    let (clamp, end) = (Body::Anchor(0), Body::Segment(18));
    for step in 0..40 {
        match step {
            10 => {
                batch.release(2, clamp).unwrap();
                simulations[2].release(clamp).unwrap();
                batch.attach(1, end, None).unwrap();
                simulations[1].attach(end, None).unwrap();
            }
            20 => {
                batch.attach(2, clamp, None).unwrap();
                simulations[2].attach(clamp, None).unwrap();
                batch.release(1, end).unwrap();
                simulations[1].release(end).unwrap();
            }
            _ => {}
        }
        let held = [0, 1, 2, 3].map(|k| [clamp, end].map(|body| batch.is_held(k, body) == Some(true)));
        let changed = (10..20).contains(&step);
        assert_eq!(held, [[true, false], [true, changed], [!changed, false], [true, false]], "{step}");
        batch.step(DT).unwrap();
        simulations.iter_mut().for_each(|simulation| assert!(simulation.step(DT).is_ok()));
    }
    for (k, (model, state)) in copies.iter().enumerate() {
        assert_eq!(in_batch(&mut batch, k), alone(model, state, &simulations[k]), "copy {k}");
    }
    let refused = batch.attach(1, clamp, None).unwrap_err();
    assert!(matches!(refused, SimulationError::NothingToAttach(Body::Anchor(0))), "{refused}");
    let refused = batch.release(1, Body::Segment(19)).unwrap_err();
    assert!(matches!(refused, SimulationError::NothingToRelease(Body::Segment(19))), "{refused}");
    assert_eq!(batch.is_held(0, Body::Anchor(2)), None);
}

#[test]
fn mistakes_name_the_copy() {
    let (model, state) = copy(0);
    let mut wrong = model.clone();
    wrong.segments[2].density = -1.0;
    let error = Batch::new(&[(&model, &state), (&wrong, &state)], &Settings::default(), None).err().unwrap();
    assert_eq!(error.to_string(), "copy 1: segment 2: density = -1, but it must be finite and > 0");
    let mut batch = Batch::new(&[(&model, &state), (&model, &state)], &Settings::default(), None).unwrap();
    let free = Driven { body: Body::Segment(1), ..driven(&model, 0.0) };
    for (copy, body) in [(0, Body::Anchor(2)), (1, Body::Anchor(2)), (0, Body::Segment(1)), (0, Body::Segment(19))] {
        let error = batch.drive(copy, &Driven { body, ..free.clone() }).unwrap_err();
        assert!(matches!(error, SimulationError::NotHeld(found) if found == body), "{error}");
    }
    let error = batch.set_load(0, 2, Vector3::x(), Vector3::x()).unwrap_err();
    assert_eq!(error.to_string(), "load 2 does not exist (the model has 2)");
}
