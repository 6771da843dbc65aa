//! Fixed segments and anchors that a motion drives are where it says, and rods follow them.

use std::f64::consts::TAU;
use std::sync::Arc;

use component::Members;
use dynamics::formulation::Formulation;
use dynamics::guess::GuessKind;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::{Status, StepParams};
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use nalgebra::{UnitQuaternion, Vector3};
use rod::Integrator;
use rod::{
    Assembly, Body, Change, Changing, Driven, Interpolation, JointForce, Keyframe, Model, Motion, Pose, Reaction,
    RodSpec, State, Track, shape,
};
use statics::{StaticParams, equilibrium};

use crate::common::{GRAVITY, integrated, material, settings, ways};

const DT: f64 = 0.01;
const SEGMENTS: usize = 20;

/// A way that starts late, turns about two axes, rests, and comes back.
fn way(from: &Pose, interpolation: Interpolation) -> Motion {
    let frame = |time: f64, shift: [f64; 3], turn: [f64; 3]| Keyframe {
        time,
        position: from.position + Vector3::from(shift),
        turn: Vector3::from(turn),
    };
    let frames = [
        frame(0.1, [0.0; 3], [0.0; 3]),
        frame(0.4, [0.1, 0.05, 0.1], [0.0, 1.5, 0.0]),
        frame(0.7, [0.1, 0.05, 0.1], [0.0; 3]),
        frame(1.4, [0.0, 0.0, -0.1], [2.0, -1.0, 1.0]),
        frame(2.0, [0.0; 3], [0.0, 0.0, -0.5 * TAU]),
    ];
    Motion::new(from.orientation, &frames, interpolation).unwrap()
}

/// Rods, the first segment of each driven, its end face held in the ground and driven, too.
fn driven(rods: usize, interpolation: Interpolation) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..rods {
        let start = Vector3::new(0.0, 3.0 * k as f64, 0.0);
        let nodes = shape::helix(start, 0.3, 0.8, 1.5, SEGMENTS);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
        assembly.fix(rod.start).clamp_end(&rod);
    }
    let (mut model, state) = assembly.finish();
    for k in 0..rods {
        for body in [Body::Segment(k * SEGMENTS), Body::Anchor(k)] {
            let motion = Arc::new(way(&model.pose(body, &state), interpolation));
            model.motions.push(Driven::new(body, motion));
        }
    }
    (model, state)
}

/// Steps and compares each driven segment with its motion, in pose and velocities.
fn follow(model: &Model, state: &State, settings: &Settings, kind: GuessKind, what: &str) -> Simulation {
    let build = |model: &Model, members: &Members, topology: &Topology| kind.build(model, members, topology);
    let mut simulation = Simulation::new(model, state, settings, Some(&build)).unwrap();
    let mut now = state.clone();
    for step in 1..=220 {
        simulation.step(DT).unwrap();
        simulation.store(&mut now);
        let there = simulation.time();
        assert!((there - f64::from(step) * DT).abs() < 1e-14);
        for driven in &model.motions {
            let Body::Segment(i) = driven.body else { continue };
            let expected = driven.at(there);
            let gap = (now.positions[i] - expected.pose.position).norm();
            let angle = now.orientations[i].angle_to(&expected.pose.orientation);
            assert!(gap <= 1e-12 && angle <= 1e-7, "{what}, step {step}: {gap:e} m, {angle:e} rad");
            let apart = now.orientations[i].coords - expected.pose.orientation.coords;
            assert!(apart.norm() <= 1e-12, "{what}, step {step}");
            let (v, w) = (now.velocities[i] - expected.velocity, now.angular_velocities[i] - expected.angular_velocity);
            assert!(v.norm() <= 1e-12 && w.norm() <= 1e-12, "{what}, step {step}: {v} {w}");
        }
        for component in simulation.singles() {
            let anchor = component.poses[component.segments()];
            let expected = model.motions[1].carried.motion.at(there).pose;
            let gap = Vector3::from(anchor.x.0) - expected.position;
            assert!(model.motions.len() > 2 || gap.norm() <= 1e-12, "{what}, step {step}");
        }
    }
    assert!(now.positions.iter().all(|x| x.norm() < 100.0), "{what}");
    simulation
}

#[test]
fn with_every_formulation_and_guess() {
    for interpolation in [Interpolation::Linear, Interpolation::Smooth] {
        let (model, state) = driven(1, interpolation);
        for (formulation, kind, solver) in ways() {
            let what = format!("{formulation}, {kind}, {interpolation:?}");
            follow(&model, &state, &settings(formulation, solver), kind, &what);
        }
    }
}

#[test]
fn in_substeps_and_in_lanes() {
    for rods in [1, 3] {
        let (model, state) = driven(rods, Interpolation::Smooth);
        for (formulation, integrator) in integrated() {
            let mut settings = settings(formulation, SolverKind::Direct);
            settings.step.integrator = integrator;
            (settings.step.max_iterations, settings.step.max_halvings) = (1, 2);
            (settings.step.relative_tolerance, settings.step.absolute_tolerance, settings.step.motion_tolerance) =
                (1e-13, 1e-13, 1e-13);
            let what = format!("{formulation}, {integrator}, {rods} rods");
            let simulation = follow(&model, &state, &settings, GuessKind::Zero, &what);
            assert!(simulation.counters().retries > 10, "{what}: {} retries", simulation.counters().retries);
        }
    }
}

#[test]
fn the_same_bits_whatever_the_lanes() {
    let (one, state) = driven(1, Interpolation::Smooth);
    let (three, states) = driven(3, Interpolation::Smooth);
    let settings = settings(Formulation::Newton, SolverKind::Direct);
    let mut alone = Simulation::new(&one, &state, &settings, None).unwrap();
    let mut together = Simulation::new(&three, &states, &settings, None).unwrap();
    let (mut now, mut all) = (state.clone(), states.clone());
    for _ in 0..50 {
        alone.step(DT).unwrap();
        together.step(DT).unwrap();
    }
    alone.store(&mut now);
    together.store(&mut all);
    assert!(together.in_lanes() > 0);
    assert_eq!(now.positions, all.positions[..SEGMENTS]);
}

/// A straight rod along x without weight, its start clamped; the end face is turned by `turn` [rad] in a second.
fn twisted(turn: f64) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&RodSpec::new(
        shape::straight(Vector3::zeros(), Vector3::x(), 1.0, SEGMENTS),
        0.01,
        material(1e7, 1000.0),
    ));
    assembly.clamp_start(&rod).clamp_end(&rod);
    assembly.damping(rod::Damping { linear: 1.0, angular: 20.0 });
    let (mut model, state) = assembly.finish();
    let anchor = model.anchors[1];
    let frame = |time, turn| Keyframe { time, position: anchor.position, turn };
    let frames = [frame(0.0, Vector3::zeros()), frame(1.0, Vector3::x() * turn)];
    let motion = Arc::new(Motion::new(anchor.orientation, &frames, Interpolation::Smooth).unwrap());
    model.motions.push(Driven::new(Body::Anchor(1), motion));
    (model, state)
}

#[test]
fn twist_alone_is_held_by_the_moment_of_theory() {
    // Half a turn and more than a whole one; a straight rod stays straight below Greenhill's 8.99 EI/GJ.
    for turn in [0.5 * TAU, 1.2 * TAU] {
        let (model, state) = twisted(turn);
        let settings = settings(Formulation::Newton, SolverKind::Direct);
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        for _ in 0..400 {
            assert_eq!(simulation.step(DT).unwrap().status, Status::Converged);
        }
        let mut now = state.clone();
        simulation.store(&mut now);
        let mut forces = vec![JointForce::default(); model.joints.len()];
        simulation.store_joint_forces(&mut forces);
        let stiffness = 1e7 * 0.5 * std::f64::consts::PI * 0.01_f64.powi(4);
        let mut then = model.clone();
        then.set_time(simulation.time());
        let reactions = Reaction::all(&then, [&now, &now], [0.0, DT], &forces, &[]);
        let expected = stiffness * turn;
        assert_eq!(reactions[1].body, Body::Anchor(1));
        let found = reactions[1].moment;
        assert!((found - Vector3::x() * expected).norm() < 1e-3 * expected, "{turn}: {found} {expected}");
        let left = (reactions[0].moment + found).norm() / expected;
        assert!(left < 1e-3, "{turn}: {left}");
    }
}

#[test]
fn fast_turns_lose_no_twist() {
    // 20 segments, turned about their axis by up to a third of a turn a step: the settled end holds what theory says.
    let (turns, stiffness) = (3.0 * TAU, 1e7 * 0.5 * std::f64::consts::PI * 0.01_f64.powi(4));
    for degrees_a_step in [85.0_f64, 127.0, 170.0, 400.0] {
        let formulation = Formulation::Newton;
        let (mut model, state) = twisted(turns);
        let anchor = model.anchors[1];
        let seconds = turns / degrees_a_step.to_radians() * DT;
        let frame = |time, turn| Keyframe { time, position: anchor.position, turn };
        let frames = [frame(0.0, Vector3::zeros()), frame(seconds, Vector3::x() * turns)];
        let motion = Arc::new(Motion::new(anchor.orientation, &frames, Interpolation::Linear).unwrap());
        model.motions = vec![Driven::new(Body::Anchor(1), motion)];
        let mut simulation = Simulation::new(&model, &state, &settings(formulation, SolverKind::Direct), None).unwrap();
        for _ in 0..400 {
            assert!(simulation.step(DT).unwrap().status <= Status::ConvergedInSubsteps);
        }
        assert_eq!(simulation.counters().retries > 0, degrees_a_step > 57.3, "{degrees_a_step}");
        let mut now = state.clone();
        simulation.store(&mut now);
        let mut forces = vec![JointForce::default(); model.joints.len()];
        simulation.store_joint_forces(&mut forces);
        model.set_time(simulation.time());
        let found = Reaction::all(&model, [&now, &now], [0.0, DT], &forces, &[])[1].moment.x;
        let expected = stiffness * turns;
        assert!((found / expected - 1.0).abs() < 0.02, "{formulation}, {degrees_a_step}: {found} of {expected}");
    }
}

#[test]
fn reactions_balance_weight_and_inertia() {
    let (mut model, state) = driven(1, Interpolation::Smooth);
    let weight: f64 = model.segments.iter().map(|segment| 9.81 * segment.mass()).sum();
    let step = StepParams {
        relative_tolerance: 1e-10,
        motion_tolerance: 1e-10,
        absolute_tolerance: 1e-10,
        max_iterations: 60,
        formulation: Formulation::Newton,
        integrator: Integrator::Euler,
        ..StepParams::DEFAULT
    };
    let settings = Settings { step, solver: SolverKind::Direct };
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let mut forces = vec![JointForce::default(); model.joints.len()];
    let (mut before, mut after) = (state.clone(), state.clone());
    simulation.store(&mut after);
    for step in 0..150 {
        std::mem::swap(&mut before, &mut after);
        // The helix is turned by more than a turn: one of its joints past half of one.
        let status = simulation.step(DT).unwrap().status;
        assert!(matches!(status, Status::Converged | Status::PastHalfTurn), "step {step}: {status:?}");
        simulation.store(&mut after);
        simulation.store_joint_forces(&mut forces);
        model.set_time(simulation.time());
        let given: Vector3<f64> = Reaction::all(&model, [&before, &after], [0.0, DT], &forces, &[])
            .iter()
            .map(|reaction| reaction.force)
            .sum();
        let change = |i: usize| (after.velocities[i] - before.velocities[i]) / DT - GRAVITY;
        let needed: Vector3<f64> =
            model.segments.iter().enumerate().map(|(i, segment)| change(i) * segment.mass()).sum();
        let apart = (given - needed).norm() / weight;
        assert!(apart < 1e-8, "step {step}: {apart:e} of the weight");
    }
}

#[test]
fn loads_and_gravity_change_as_they_are_told() {
    // A free segment alone: its velocity is the sum of what pushed it, at the end of each step.
    let up = Track::new(&[(0.1, Vector3::zeros()), (0.2, Vector3::z() * 3.0)], Interpolation::Linear).unwrap();
    let side = Track::new(&[(0.0, Vector3::x()), (0.25, -Vector3::x() * 2.0)], Interpolation::Held).unwrap();
    for rods in [1, 9] {
        let mut assembly = Assembly::new(Vector3::zeros());
        for k in 0..rods {
            let start = Vector3::y() * f64::from(k);
            assembly.rod(&RodSpec::new(shape::straight(start, Vector3::x(), 1.0, 2), 0.02, material(1e6, 1000.0)));
        }
        let last = 2 * rods as usize - 2;
        for segment in [last, last + 1] {
            let zero = Vector3::zeros();
            assembly.load(rod::Load { segment, offset: 0.0, force: zero, torque: zero, follows: false });
        }
        let (mut model, state) = assembly.finish();
        let (up, side) = (Arc::new(up.clone()), Arc::new(side.clone()));
        let of = [Changing::Force(0), Changing::Force(1)];
        model.changes.extend(of.map(|of| Change { of, track: up.clone() }));
        model.changes.push(Change { of: Changing::Gravity, track: side.clone() });
        for formulation in Formulation::ALL {
            let mut simulation =
                Simulation::new(&model, &state, &settings(formulation, SolverKind::Direct), None).unwrap();
            let (mut now, mut expected) = (state.clone(), Vector3::zeros());
            for step in 1..=40 {
                assert_eq!(simulation.step(DT).unwrap().status, Status::Converged);
                let time = f64::from(step) * DT;
                expected += (up.at(time) / model.segments[last].mass() + side.at(time)) * DT;
                simulation.store(&mut now);
                let apart = (now.velocities[last] - expected).norm();
                assert!(apart < 1e-9, "{formulation}, {rods} rods, step {step}: {apart:e}");
            }
        }
    }
}

#[test]
fn a_motion_may_be_given_on_the_way() {
    for rods in [1, 3] {
        let (mut model, state) = driven(rods, Interpolation::Linear);
        model.motions.clear();
        let settings = settings(Formulation::Newton, SolverKind::Direct);
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        let body = Body::Segment((rods - 1) * SEGMENTS);
        let Body::Segment(i) = body else { unreachable!() };
        let mut now = state.clone();
        for _ in 0..20 {
            simulation.step(DT).unwrap();
        }
        let velocity = Vector3::new(0.0, 0.1, 0.3);
        let steady = Motion::at_velocities(&model.pose(body, &state), &[(simulation.time(), velocity, Vector3::z())]);
        simulation.drive(&Driven::new(body, Arc::new(steady.unwrap()))).unwrap();
        for _ in 0..30 {
            simulation.step(DT).unwrap();
        }
        simulation.store(&mut now);
        assert!((now.positions[i] - state.positions[i] - velocity * 0.3).norm() < 1e-12);
        let turned = UnitQuaternion::from_scaled_axis(Vector3::z() * 0.3) * state.orientations[i];
        assert!((now.orientations[i].coords - turned.coords).norm() < 1e-12);
        // Velocities that are set from outside do not stop what is driven.
        now.velocities.fill(Vector3::zeros());
        simulation.set_velocities(&now);
        simulation.step(DT).unwrap();
        simulation.store(&mut now);
        assert!((now.positions[i] - state.positions[i] - velocity * 0.31).norm() < 1e-12);
    }
}

#[test]
fn what_is_not_held_is_not_driven() {
    let (mut model, state) = driven(1, Interpolation::Linear);
    let motion = model.motions[0].carried.motion.clone();
    let settings = settings(Formulation::Newton, SolverKind::Direct);
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    for body in [Body::Segment(3), Body::Segment(SEGMENTS), Body::Anchor(1)] {
        let refused = simulation.drive(&Driven::new(body, motion.clone()));
        assert!(matches!(refused, Err(SimulationError::NotHeld(named)) if named == body));
    }
    model.motions[0].body = Body::Segment(1);
    let error = Simulation::new(&model, &state, &settings, None).err().unwrap().to_string();
    assert_eq!(error, "motion 0: segment 1 is not fixed, but only what is held can be driven");
}

#[test]
fn a_static_analysis_leaves_what_is_driven_where_it_begins() {
    let (mut model, mut state) = driven(1, Interpolation::Linear);
    let under_way = [(0.0, Vector3::x(), Vector3::z())];
    let motion = Motion::at_velocities(&model.pose(Body::Segment(0), &state), &under_way).unwrap();
    model.motions[0] = Driven::new(Body::Segment(0), Arc::new(motion));
    let first = state.clone();
    let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
    assert!(report.converged);
    assert_eq!((state.positions[0], state.orientations[0]), (first.positions[0], first.orientations[0]));
    assert_eq!((state.velocities[0], state.angular_velocities[0]), (Vector3::zeros(), Vector3::zeros()));
}
