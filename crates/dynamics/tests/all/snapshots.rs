//! From a snapshot a simulation goes on with the bits with which it went on then.

use std::sync::Arc;

use component::Members;
use dynamics::formulation::Formulation;
use dynamics::guess::GuessKind;
use dynamics::simulation::{ContactForce, Settings, Simulation, SimulationError};
use dynamics::snapshot::Snapshot;
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use nalgebra::{UnitQuaternion, Vector3};
use rod::{
    Air, Assembly, Body, BodyShape, Contacts, Driven, Friction, Gusts, Interpolation, JointForce, Keyframe, Load,
    Model, Motion, Obstacle, ObstacleShape, Pose, RigidBody, RodSpec, Springs, State, Surface, Wind, shape,
};

use crate::common::*;

/// All that one reads off a simulation.
#[derive(Clone, Debug, PartialEq)]
struct Seen {
    state: State,
    forces: Vec<JointForce>,
    contacts: Vec<ContactForce>,
    time: f64,
}

impl Seen {
    fn of(model: &Model, state: &State, simulation: &Simulation) -> Self {
        let mut seen = Self {
            state: state.clone(),
            forces: vec![JointForce::default(); model.joints.len()],
            contacts: Vec::new(),
            time: simulation.time(),
        };
        simulation.store(&mut seen.state);
        simulation.store_joint_forces(&mut seen.forces);
        simulation.store_contact_forces(&mut seen.contacts);
        seen
    }
}

fn simulation(model: &Model, state: &State, settings: &Settings, kind: GuessKind) -> Simulation {
    let build = |model: &Model, members: &Members, topology: &Topology| kind.build(model, members, topology);
    Simulation::new(model, state, settings, Some(&build)).unwrap()
}

fn steps(simulation: &mut Simulation, count: usize) {
    for _ in 0..count {
        simulation.step(DT).unwrap();
    }
}

/// Runs to a snapshot and on, back and on again, and on from it in a simulation of its own.
fn goes_on((model, state): (&Model, &State), settings: &Settings, kind: GuessKind, count: usize, what: &str) {
    let mut first = simulation(model, state, settings, kind);
    steps(&mut first, count);
    let there = Seen::of(model, state, &first);
    let snapshot = first.snapshot();
    assert_eq!(snapshot.time(), there.time, "{what}");
    steps(&mut first, count);
    let end = Seen::of(model, state, &first);
    assert_ne!(end.state, there.state, "{what}: nothing moves");
    first.restore(&snapshot).unwrap();
    assert_eq!(Seen::of(model, state, &first), there, "{what}");
    steps(&mut first, count);
    assert_eq!(Seen::of(model, state, &first), end, "{what}");

    let mut second = simulation(model, state, settings, kind);
    second.restore(&snapshot).unwrap();
    steps(&mut second, count);
    assert_eq!(Seen::of(model, state, &second), end, "{what}, in another simulation");

    // As a file has it, without motions.
    let mut third = simulation(model, state, settings, kind);
    third.restore(&Snapshot::from_words(snapshot.words().to_vec())).unwrap();
    steps(&mut third, count);
    assert_eq!(Seen::of(model, state, &third), end, "{what}, from words");
}

#[test]
fn with_every_formulation_and_guess() {
    for (model, state) in [tree(), ring()] {
        for (formulation, kind, solver) in ways() {
            let what = format!("{formulation}, {kind}, {} segments", state.len());
            goes_on((&model, &state), &settings(formulation, solver), kind, 50, &what);
        }
    }
}

/// Rods in the wind whose end moves and whose middle is pulled; the first of each rod's segments turns. Springs hold every second
/// end.
fn driven(rods: usize) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..rods {
        let nodes = shape::helix(Vector3::y() * 3.0 * k as f64, 0.3, 0.8, 1.5, 12);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6 * (1.0 + k as f64), 1000.0)));
        assembly.fix(rod.start).clamp_end(&rod);
        let model = assembly.model_mut();
        if k % 2 == 0 {
            model.soften(model.joints.len() - 1, &Springs { force: [300.0, 100.0, 200.0], ..Springs::RIGID });
        }
        assembly.load(Load {
            segment: rod.start + 6,
            offset: 0.0,
            force: Vector3::x() * k as f64,
            torque: Vector3::zeros(),
            follows: false,
        });
        assembly.state_mut().angular_velocities[rod.start] = Vector3::z() * 0.3;
    }
    let gusts = Gusts { strength: 0.3, length: 1.0, time: 0.5, seed: 4 };
    let wind = Wind::new(Vector3::new(6.0, 2.0, 0.0), Some(gusts), None);
    assembly.air(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
    let (mut model, state) = assembly.finish();
    for k in 0..rods {
        let anchor = model.anchors[k];
        let frame = |time: f64, shift: Vector3<f64>| Keyframe {
            time,
            position: anchor.position + shift,
            turn: Vector3::x() * time,
        };
        let frames = [frame(0.0, Vector3::zeros()), frame(0.8, Vector3::x() * 0.1), frame(3.0, Vector3::z() * -0.2)];
        let motion = Arc::new(Motion::new(anchor.orientation, &frames, Interpolation::Smooth).unwrap());
        model.motions.push(Driven::new(Body::Anchor(k), motion));
    }
    (model, state)
}

#[test]
fn alone_and_in_lanes_with_motions_and_wind_whole_and_in_halves() {
    for rods in [1, 3] {
        let (model, state) = driven(rods);
        for formulation in Formulation::ALL {
            let mut settings = settings(formulation, SolverKind::Direct);
            goes_on((&model, &state), &settings, GuessKind::Zero, 50, &format!("{formulation}, {rods} rods"));
            (settings.step.max_iterations, settings.step.max_halvings) = (1, 2);
            (settings.step.relative_tolerance, settings.step.absolute_tolerance, settings.step.motion_tolerance) =
                (1e-13, 1e-13, 1e-13);
            goes_on(
                (&model, &state),
                &settings,
                GuessKind::Zero,
                50,
                &format!("{formulation}, {rods} rods, in halves"),
            );
        }
    }
}

/// Rods that fall on the ground and on each other, and rub.
fn heap() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..3 {
        let height = 0.03 + 0.03 * k as f64;
        let direction = if k % 2 == 0 { Vector3::x() } else { Vector3::y() };
        let nodes = shape::straight(direction * -0.2 + Vector3::z() * height, direction, 0.4, 5);
        assembly.rod(&RodSpec::new(nodes, 0.01, material(1e6, 1000.0)));
    }
    let surface = Surface { friction: Friction { at_rest: 0.5, sliding: 0.3 }, restitution: 0.2 };
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    assembly.model_mut().contacts = Contacts {
        between_segments: Some(surface),
        obstacles: vec![Obstacle::new(ground, surface)],
        allow_overlap: false,
        sheaths: Vec::new(),
    };
    let (model, mut state) = assembly.finish();
    state.velocities.iter_mut().for_each(|v| *v = Vector3::new(0.5, 0.2, 0.0));
    (model, state)
}

/// A box that falls askew on the ground beside a rod on a box: contacts of corners, edges and faces.
fn with_faces() -> (Model, State) {
    let (mut model, mut state) = heap();
    let mut assembly = Assembly::new(GRAVITY);
    let sides = Vector3::new(0.2, 0.1, 0.06);
    let orientation = UnitQuaternion::from_scaled_axis(Vector3::new(0.35, 0.17, 0.0));
    assembly.body(
        RigidBody::new(BodyShape::Box { sides }, 1.0),
        Pose { position: Vector3::new(1.0, 0.0, 0.08), orientation },
    );
    let block = ObstacleShape::Box {
        pose: Pose { position: Vector3::new(0.1, 0.0, -0.02), orientation: UnitQuaternion::identity() },
        sides: Vector3::new(0.3, 1.0, 0.045),
    };
    model.contacts.obstacles.push(Obstacle::new(block, model.contacts.obstacles[0].surface));
    let (other, others) = assembly.finish();
    model.append(&other);
    state.append(&others, 0);
    (model, state)
}

#[test]
fn with_contacts_that_press_and_rub() {
    for (what, (model, state)) in [("capsules", heap()), ("faces", with_faces())] {
        with_contacts(what, &model, &state);
    }
}

fn with_contacts(what: &str, model: &Model, state: &State) {
    for (formulation, kind) in [(Formulation::Newton, GuessKind::Zero), (Formulation::Newton, GuessKind::StepAdaptive)]
    {
        let mut settings = settings(formulation, SolverKind::Direct);
        settings.step.max_halvings = 1;
        let mut first = simulation(model, state, &settings, kind);
        steps(&mut first, 15);
        assert!(!Seen::of(model, state, &first).contacts.is_empty(), "{formulation}: nothing touches");
        goes_on((model, state), &settings, kind, 15, &format!("{what}, {formulation}, {kind}"));
    }
}

#[test]
fn what_was_done_to_it_meanwhile_is_taken_back() {
    let (model, state) = driven(3);
    let settings = Settings::default();
    let mut first = simulation(&model, &state, &settings, GuessKind::Zero);
    steps(&mut first, 10);
    let snapshot = first.snapshot();
    steps(&mut first, 10);
    let end = Seen::of(&model, &state, &first);

    first.restore(&snapshot).unwrap();
    let frames = [Keyframe { time: 0.0, position: Vector3::z(), turn: Vector3::zeros() }];
    let motion = Motion::new(model.anchors[1].orientation, &frames, Interpolation::Linear).unwrap();
    first.drive(&Driven::new(Body::Anchor(1), Arc::new(motion))).unwrap();
    first.set_load(0, Vector3::x() * 50.0, Vector3::z()).unwrap();
    first.set_gravity(Vector3::zeros()).unwrap();
    first.set_velocities(&state);
    steps(&mut first, 10);
    assert_ne!(Seen::of(&model, &state, &first).state, end.state);
    first.restore(&snapshot).unwrap();
    steps(&mut first, 10);
    assert_eq!(Seen::of(&model, &state, &first), end);
}

#[test]
fn velocities_given_just_before_are_kept() {
    let (model, mut state) = tree();
    let mut first = simulation(&model, &state, &Settings::default(), GuessKind::Zero);
    steps(&mut first, 5);
    first.store(&mut state);
    state.angular_velocities.iter_mut().for_each(|w| *w += Vector3::y() * 3.0);
    first.set_velocities(&state);
    let snapshot = first.snapshot();
    steps(&mut first, 5);
    let end = Seen::of(&model, &state, &first);
    first.restore(&snapshot).unwrap();
    steps(&mut first, 5);
    assert_eq!(Seen::of(&model, &state, &first), end);
}

#[test]
fn a_snapshot_of_something_else_is_refused_and_changes_nothing() {
    let (model, state) = tree();
    let newton = settings(Formulation::Newton, SolverKind::Direct);
    let mut own = simulation(&model, &state, &newton, GuessKind::StepLinear);
    steps(&mut own, 3);
    let before = Seen::of(&model, &state, &own);
    let (other_model, other_state) = driven(3);
    let mut others = [
        Snapshot::default(),
        simulation(&other_model, &other_state, &newton, GuessKind::Zero).snapshot(),
        simulation(&model, &state, &newton, GuessKind::Zero).snapshot(),
        simulation(&model, &state, &newton, GuessKind::StepQuadratic).snapshot(),
    ];
    for other in &mut others {
        assert!(matches!(own.restore(other), Err(SimulationError::Snapshot)));
        assert_eq!(Seen::of(&model, &state, &own), before);
        // An older snapshot of anything gives its memory.
        own.snapshot_into(other);
        own.restore(other).unwrap();
    }
    assert_eq!(Seen::of(&model, &state, &own), before);
}

#[test]
fn after_pins_and_hinges_have_let_go() {
    for pin in [true, false] {
        let mut assembly = Assembly::new(GRAVITY);
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 5);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
        assembly.clamp_start(&rod);
        let (mut model, state) = assembly.finish();
        let joint = model.joints.len() - 1;
        if pin {
            model.pin(joint);
        } else {
            model.hinge(joint, &Vector3::y());
        }
        let resting = Arc::new(Motion::resting(&model.anchors[0]));
        model.motions.push(Driven::new(Body::Anchor(0), resting).between(0.0, 10.0 * DT));
        let settings = settings(Formulation::Newton, SolverKind::Direct);
        goes_on((&model, &state), &settings, GuessKind::Zero, 40, if pin { "a pin" } else { "a hinge" });
    }
}
