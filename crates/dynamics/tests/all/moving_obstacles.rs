//! Obstacles that move: friction and restitution see the motion of their surfaces, and rods never come to their other side.

use std::f64::consts::PI;
use std::sync::Arc;

use component::Members;
use dynamics::formulation::Formulation;
use dynamics::guess::GuessKind;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::Status;
use jointed::topology::Topology;
use nalgebra::{Unit, UnitQuaternion, Vector3};
use rod::{
    Assembly, Body, Carried, Change, Changing, Damping, Friction, Interpolation, Joint, JointForce, Keyframe, Load,
    Model, Motion, Obstacle, ObstacleShape, Pose, RestShape, RodSpec, State, Surface, Track, shape,
};

use crate::common::material;

const GRAVITY: f64 = 9.81;
const DT: f64 = 0.01;
const RADIUS: f64 = 0.01;

/// An obstacle that goes on with these velocities from the start.
fn steady(shape: ObstacleShape, surface: Surface, v: Vector3<f64>, w: Vector3<f64>) -> Obstacle {
    let still = Obstacle::new(shape, surface);
    let motion = Motion::at_velocities(&still.at(0.0).pose, &[(0.0, v, w)]).unwrap();
    Obstacle { motion: Some(Carried::new(Arc::new(motion))), ..still }
}

fn rough(friction: f64) -> Surface {
    Surface { friction: Friction::new(friction), restitution: 0.0 }
}

fn ground() -> ObstacleShape {
    ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Unit::new_normalize(Vector3::z()) }
}

/// A belt along x from rest at `acceleration` [m/s^2]: through parabolas, of which a smooth motion is exact but for the last.
fn belt(acceleration: f64, friction: f64) -> Obstacle {
    let frame = |k: i32| {
        let time = 0.25 * f64::from(k);
        let position = Vector3::x() * (0.5 * acceleration * time * time);
        Keyframe { time, position, turn: Vector3::zeros() }
    };
    let frames: Vec<Keyframe> = (0..9).map(frame).collect();
    let motion = Motion::new(UnitQuaternion::identity(), &frames, Interpolation::Smooth).unwrap();
    Obstacle { motion: Some(Carried::new(Arc::new(motion))), ..Obstacle::new(ground(), rough(friction)) }
}

/// A single segment along x that lies on the ground.
fn block() -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::z() * -GRAVITY);
    let nodes = shape::straight(Vector3::z() * RADIUS, Vector3::x(), 0.2, 1);
    assembly.rod(&RodSpec::new(nodes, RADIUS, material(1e7, 1000.0)));
    assembly.finish()
}

fn sharp() -> Settings {
    let mut settings = Settings::default();
    settings.step.contact_tolerance = 1e-8;
    settings
}

/// Steps; every step converges, and `look` sees each state.
fn run(
    model: &Model,
    state: &State,
    settings: &Settings,
    steps: usize,
    mut look: impl FnMut(f64, &State),
) -> Simulation {
    let mut simulation = Simulation::new(model, state, settings, None).unwrap();
    let mut now = state.clone();
    for step in 0..steps {
        let report = simulation.step(DT).unwrap();
        assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
        simulation.store(&mut now);
        look(simulation.time(), &now);
    }
    let deepest = simulation.counters().deepest_penetration;
    assert!(deepest < 0.02, "{deepest}");
    simulation
}

#[test]
fn a_belt_carries_what_lies_on_it_as_fast_as_friction_can() {
    let friction = 0.5;
    let (mut model, state) = block();
    for acceleration in [0.4 * friction * GRAVITY, 1.6 * friction * GRAVITY] {
        model.contacts.obstacles = vec![belt(acceleration, friction)];
        run(&model, &state, &sharp(), 150, |time, now| {
            let (way, speed) = ((now.positions[0] - state.positions[0]).x, now.velocities[0].x);
            if acceleration < friction * GRAVITY {
                let belt = model.contacts.obstacles[0].at(time).pose.position.x;
                assert!((belt - 0.5 * acceleration * time * time).abs() < 1e-12);
                // A contact may slip by its tolerance in each step.
                assert!((way - belt).abs() < 150.0 * 1e-8 * RADIUS, "{time} s: {way} {belt}");
            } else {
                // In its first step the belt has the mean acceleration a / 2, with which the block keeps up.
                let expected = 0.5 * acceleration * DT + friction * GRAVITY * (time - DT);
                assert!((speed / expected - 1.0).abs() < 1e-4, "{time} s: {speed} {expected}");
            }
            assert!(
                (now.positions[0] - Vector3::new(0.0, 0.0, RADIUS)).z.abs() < 1e-6 && now.axis(0).x.abs() > 1.0 - 1e-9
            );
        });
    }
}

/// A rope over a drum of radius 0.1 m through half a turn, a constant pull at its start, its end held.
fn rope_over_drum() -> (Model, State, f64) {
    const DRUM: f64 = 0.1;
    let (radius, arc, tail) = (0.001, 24, 8);
    let step = PI / f64::from(arc);
    let reach = (DRUM + radius) / (0.5 * step).cos();
    let node = |k: f64| Vector3::new(reach * (step * k).cos(), 0.0, reach * (step * k).sin());
    let (first, last) = (node(-0.5), node(f64::from(arc) + 0.5));
    let (start, end) = (first - node(0.5), last - node(f64::from(arc) - 0.5));
    let mut nodes: Vec<_> = (1..=tail).rev().map(|k| first + start * f64::from(k)).collect();
    nodes.extend((0..=arc + 1).map(|k| node(f64::from(k) - 0.5)));
    nodes.extend((1..=tail).map(|k| last + end * f64::from(k)));
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.damping(Damping { linear: 5.0, angular: 5.0 });
    let rope = RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, radius, material(1e4, 1000.0)) };
    let rope = assembly.rod(&rope);
    assembly.clamp_end(&rope);
    let pull = 640.0 * PI * radius * radius;
    let (offset, force) = (-0.5 * start.norm(), start.normalize() * pull);
    assembly.load(Load { segment: rope.start, offset, force, torque: Vector3::zeros(), follows: false });
    let (model, state) = assembly.finish();
    (model, state, pull)
}

/// Euler and Eytelwein's formula holds exactly while a drum turns below a rope that stays: friction is all that it can be.
#[test]
fn a_turning_drum_pulls_by_the_exponential_of_the_angle() {
    let (mut model, state, pull) = rope_over_drum();
    let friction = 0.3;
    // Friction acts at the rope's surface: about the drum's axis its lever arm is R, that of the tension R + r.
    let exponent = friction * PI * 0.1 / 0.101;
    let (start, end, radius) = (-Vector3::y(), Vector3::y(), 0.1);
    let round = ObstacleShape::Capsule { start, end, radius };
    let many_sided = ObstacleShape::Cylinder { start, end, radius };
    let cases = [(&round, 1.0), (&round, -1.0), (&many_sided, 1.0), (&many_sided, -1.0)];
    for (drum, rate) in cases.map(|(drum, rate)| (drum.clone(), rate)) {
        let ratio = (exponent * rate).exp();
        model.contacts.obstacles = vec![steady(drum, rough(friction), Vector3::zeros(), Vector3::y() * rate)];
        let mut settings = Settings::default();
        settings.step.formulation = Formulation::Newton;
        settings.step.contact_tolerance = 1e-5;
        let build = |m: &Model, s: &Members, t: &Topology| GuessKind::StepAdaptive.build(m, s, t);
        let mut simulation = Simulation::new(&model, &state, &settings, Some(&build)).unwrap();
        let held = model
            .joints
            .iter()
            .position(|joint| matches!(joint.b, Body::Anchor(_)) || matches!(joint.a, Body::Anchor(_)));
        let mut forces = vec![JointForce::default(); model.joints.len()];
        let mut mean = 0.0;
        for step in 0..200 {
            let report = simulation.step(DT).unwrap();
            assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
            if step >= 150 {
                simulation.store_joint_forces(&mut forces);
                mean += forces[held.unwrap()].force.norm() / 50.0;
            }
        }
        println!("{rate} rad/s: {:.4} of the pull, theory {ratio:.4}", mean / pull);
        assert!((mean / pull / ratio - 1.0).abs() < 0.02, "{} {ratio}", mean / pull);
    }
}

/// Distance [m] of each segment's axis from a centre.
fn distances(model: &Model, state: &State, centre: Vector3<f64>) -> Vec<f64> {
    let distance = |(i, segment): (usize, &rod::Segment)| {
        let half = state.axis(i) * (0.5 * segment.length);
        let ends = [state.positions[i] - half, state.positions[i] + half];
        collision::closest::segments(&ends, &[centre; 2]).distance
    };
    model.segments.iter().enumerate().map(distance).collect()
}

#[test]
fn a_sphere_pushes_a_hanging_rope_aside() {
    let mut assembly = Assembly::new(Vector3::z() * -GRAVITY);
    let nodes = shape::straight(Vector3::zeros(), -Vector3::z(), 1.0, 30);
    let rope = assembly.rod(&RodSpec::new(nodes, RADIUS, material(1e6, 1000.0)));
    assembly.clamp_start(&rope);
    let (mut model, state) = assembly.finish();
    let sphere = ObstacleShape::Sphere { centre: Vector3::new(-0.3, 0.0, -0.7), radius: 0.1 };
    let frame = |time: f64, x: f64| Keyframe { time, position: Vector3::new(x, 0.0, -0.7), turn: Vector3::zeros() };
    let frames = [frame(0.0, -0.3), frame(0.5, 0.2), frame(1.0, 0.2)];
    let motion = Motion::new(UnitQuaternion::identity(), &frames, Interpolation::Smooth).unwrap();
    let motion = Some(Carried::new(Arc::new(motion)));
    model.contacts.obstacles = vec![Obstacle { motion, ..Obstacle::new(sphere, rough(0.2)) }];
    let mut ahead = 0.0;
    run(&model, &state, &Settings::default(), 100, |time, now| {
        let centre = model.contacts.obstacles[0].at(time).pose.position;
        let nearest = distances(&model, now, centre).into_iter().fold(f64::INFINITY, f64::min);
        assert!(nearest > 0.1 + 0.98 * RADIUS, "{time} s: {nearest} m");
        let level = now.positions.iter().min_by(|a, b| (a.z + 0.7).abs().total_cmp(&(b.z + 0.7).abs())).unwrap();
        ahead = level.x - centre.x;
    });
    assert!(ahead > 0.1, "{ahead}");
}

/// The sphere goes three diameters a step. What it hits off its middle may slide off to a side, but is never behind it.
#[test]
fn a_fast_sphere_does_not_pass_through_a_rod() {
    for aside in [0.0, 0.02, -0.05] {
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes = shape::straight(Vector3::new(0.0, -0.5, 0.0), Vector3::y(), 1.0, 20);
        assembly.rod(&RodSpec::new(nodes, RADIUS, material(1e7, 1000.0)));
        let (mut model, state) = assembly.finish();
        let centre = Vector3::new(-0.4, 0.01, aside);
        let sphere = ObstacleShape::Sphere { centre, radius: 0.08 };
        let motion = Motion::at_velocities(
            &Pose { position: centre, orientation: UnitQuaternion::identity() },
            &[(0.0, Vector3::x() * 50.0, Vector3::zeros()), (0.03, Vector3::zeros(), Vector3::zeros())],
        );
        let motion = Some(Carried::new(Arc::new(motion.unwrap())));
        model.contacts.obstacles = vec![Obstacle { motion, ..Obstacle::new(sphere, rough(0.3)) }];
        run(&model, &state, &Settings::default(), 3, |time, now| {
            let centre = model.contacts.obstacles[0].at(time).pose.position;
            let nearest = distances(&model, now, centre).into_iter().fold(f64::INFINITY, f64::min);
            assert!(nearest > 0.08 + 0.98 * RADIUS, "{aside} m, {time} s: {nearest} m");
            let middle = 0.5 * (now.positions[9] + now.positions[10]);
            let is_beside = aside != 0.0 && (middle.z - aside).abs() > 0.08;
            assert!(time < 0.015 || middle.x > centre.x || is_beside, "{aside} m, {time} s: {middle}");
        });
    }
}

#[test]
fn a_plane_that_rises_throws_what_it_meets() {
    let (mut model, state) = block();
    model.gravity = Vector3::zeros();
    for restitution in [0.0, 0.5, 1.0] {
        let below =
            ObstacleShape::HalfSpace { point: Vector3::z() * -0.045, normal: Unit::new_normalize(Vector3::z()) };
        let surface = Surface { restitution, ..rough(0.3) };
        model.contacts.obstacles = vec![steady(below, surface, Vector3::z(), Vector3::zeros())];
        let mut speed = 0.0;
        run(&model, &state, &sharp(), 10, |_, now| speed = now.velocities[0].z);
        assert!((speed - (1.0 + restitution)).abs() < 1e-6, "{restitution}: {speed}");
    }
}

/// What moves on together is what stands still together.
#[test]
fn all_that_moves_on_alike_is_at_rest() {
    let surface = Surface { friction: Friction::new(0.4), restitution: 0.3 };
    let drum =
        ObstacleShape::Capsule { start: Vector3::new(0.1, -0.5, 0.0), end: Vector3::new(0.1, 0.5, 0.05), radius: 0.08 };
    let plane = ObstacleShape::HalfSpace {
        point: Vector3::z() * -0.1,
        normal: Unit::new_normalize(Vector3::new(-0.1, 0.05, 1.0)),
    };
    let ball = ObstacleShape::Sphere { centre: Vector3::new(-0.35, 0.0, -0.05), radius: 0.1 };
    let moving = |v: Vector3<f64>| {
        let mut assembly = Assembly::new(Vector3::z() * -GRAVITY);
        let nodes = shape::straight(Vector3::new(-0.5, 0.0, 0.12), Vector3::x(), 1.0, 12);
        assembly.rod(&RodSpec::new(nodes, RADIUS, material(1e6, 1000.0)));
        let (mut model, mut state) = assembly.finish();
        let shapes = [&drum, &plane, &ball].map(Clone::clone);
        model.contacts.obstacles = shapes.map(|shape| steady(shape, surface, v, Vector3::zeros())).into();
        state.velocities.iter_mut().for_each(|own| *own += v + Vector3::new(0.5, 0.2, -0.45));
        (model, state)
    };
    let mut settings = sharp();
    (settings.step.relative_tolerance, settings.step.motion_tolerance) = (1e-10, 1e-10);
    settings.step.absolute_tolerance = 1e-13;
    let v = Vector3::new(0.7, -0.4, 0.5);
    let (model, state) = moving(Vector3::zeros());
    let mut still = Vec::new();
    run(&model, &state, &settings, 40, |_, now| still.push(now.clone()));
    let mut all = still.iter();
    let (model, state) = moving(v);
    run(&model, &state, &settings, 40, |time, now| {
        let still = all.next().unwrap();
        for i in 0..now.len() {
            let apart = now.positions[i] - v * time - still.positions[i];
            assert!(apart.norm() < 1e-6, "{time} s, segment {i}: {apart}");
        }
    });
    // Obstacles without a motion are those that stay.
    let mut model = moving(Vector3::zeros()).0;
    model.contacts.obstacles.iter_mut().for_each(|obstacle| obstacle.motion = None);
    let (_, state) = moving(Vector3::zeros());
    let mut all = still.iter();
    run(&model, &state, &settings, 40, |time, now| {
        let still = all.next().unwrap();
        for i in 0..now.len() {
            let apart = now.positions[i] - still.positions[i];
            assert!(apart.norm() < 1e-6, "{time} s, segment {i}: {apart}");
        }
    });
}

/// What turns by more than a radian a step is stepped in halves, in each of which all obstacles are where they are then. Every whole step is
/// tried.
#[test]
fn halves_follow_the_motions() {
    let (mut model, state) = block();
    let ball = ObstacleShape::Sphere { centre: Vector3::z() * 9.0, radius: 0.5 };
    let spin = steady(ball, rough(0.0), Vector3::zeros(), Vector3::y() * (1.5 / DT));
    let acceleration = 2.0;
    model.contacts.obstacles = vec![belt(acceleration, 0.5), spin];
    let mut settings = sharp();
    settings.step.formulation = Formulation::Newton;
    let simulation = run(&model, &state, &settings, 50, |time, now| {
        // The mean speed of the second half.
        let expected = acceleration * (time - 0.25 * DT);
        assert!((now.velocities[0].x - expected).abs() < 1e-6, "{time} s: {} {expected}", now.velocities[0].x);
    });
    assert_eq!(simulation.counters().retries, 50);
}

#[test]
fn a_program_drives_obstacles() {
    let (mut model, state) = block();
    model.contacts.obstacles = vec![Obstacle::new(ground(), rough(1.0))];
    let mut simulation = Simulation::new(&model, &state, &sharp(), None).unwrap();
    let mut now = state.clone();
    let mut speed_after = |simulation: &mut Simulation| {
        (0..20).for_each(|_| assert_eq!(simulation.step(DT).unwrap().status, Status::Converged));
        simulation.store(&mut now);
        now.velocities[0]
    };
    assert!(speed_after(&mut simulation).norm() < 1e-6);
    let pose = model.contacts.obstacles[0].at(simulation.time()).pose;
    let away = Motion::at_velocities(&pose, &[(0.0, Vector3::x() * 0.5, Vector3::zeros())]).unwrap();
    let motion = Carried::gripped(Arc::new(away), &pose, simulation.time());
    simulation.drive_obstacle(0, &motion).unwrap();
    assert!((speed_after(&mut simulation) - Vector3::x() * 0.5).norm() < 1e-6);
    let refused = simulation.drive_obstacle(1, &motion);
    assert!(matches!(refused, Err(SimulationError::NoObstacle(1))), "{refused:?}");
}

#[test]
fn a_motion_that_begins_elsewhere_is_refused() {
    let (mut model, state) = block();
    let away = Pose { position: Vector3::x(), orientation: UnitQuaternion::identity() };
    let motion = Motion::through(&[(0.0, away)], Interpolation::Held).unwrap();
    let motion = Some(Carried::new(Arc::new(motion)));
    model.contacts.obstacles = vec![Obstacle { motion, ..Obstacle::new(ground(), rough(0.0)) }];
    let error = model.validate(&state).unwrap_err().to_string();
    assert_eq!(error, "the motion of obstacle 0: it begins 1 m and 0 rad away from where the body is");
}

/// What is fixed goes into obstacles, but the end of the next segment, which moves freely, does not: it is pushed out against its joint,
/// whose compliance says with which force, until that gapes.
#[test]
fn the_segment_after_a_fixed_one_stays_out_of_what_comes_over_them() {
    let below = Vector3::z() * -0.05;
    let plane = ObstacleShape::HalfSpace { point: below, normal: Unit::new_normalize(Vector3::z()) };
    let pose = Pose { position: below - Vector3::z() * 0.1, orientation: UnitQuaternion::identity() };
    let block = ObstacleShape::Box { pose, sides: Vector3::new(1.0, 1.0, 0.2) };
    let (speed, tolerance) = (0.2, 1e-3);
    for (shape, formulation) in [&plane, &block].into_iter().flat_map(|shape| Formulation::ALL.map(|one| (shape, one)))
    {
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 0.2, 3);
        let rod = assembly.rod(&RodSpec::new(nodes, RADIUS, material(1e7, 1000.0)));
        assembly.fix(rod.start);
        let (mut model, state) = assembly.finish();
        let up = Vector3::z() * speed;
        model.contacts.obstacles = vec![steady(shape.clone(), rough(0.0), up, Vector3::zeros())];
        let mut settings = Settings::default();
        settings.step.formulation = formulation;
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        let (mut now, mut contacts) = (state.clone(), Vec::new());
        for _ in 0..30 {
            let is_solved = simulation.step(DT).unwrap().status <= Status::ConvergedInSubsteps;
            simulation.store(&mut now);
            simulation.store_contact_forces(&mut contacts);
            // It meets the rod after 0.2 s.
            let lift = below.z + speed * simulation.time() + RADIUS;
            let what = || format!("{formulation}, {}, {lift} m", shape.kind());
            assert!(is_solved || lift > 1e-4, "{}", what());
            // A joint that gapes by a tenth of its length is apart.
            assert!(!is_solved || lift < 0.11 * model.segments[1].length, "{}", what());
            for i in (1..3).filter(|_| is_solved) {
                let arm = now.axis(i) * (0.5 * model.segments[i].length);
                let lowest = (now.positions[i] - arm).z.min((now.positions[i] + arm).z);
                assert!(lowest > lift - 1.1 * tolerance * RADIUS, "{}, segment {i}: {lowest} m", what());
            }
            if is_solved && lift > 1e-4 {
                let force: f64 = contacts.iter().map(|contact| contact.force.z).sum();
                // Within the tolerance nothing bears.
                let right = (lift - tolerance * RADIUS) / Joint::RIGID;
                assert!((force - right).abs() < 0.02 * right, "{}: {force} N, {right} N", what());
            }
        }
    }
}

/// A rope lies on the ground. A segment of it is held where it is, a micrometre in the ground or a tenth of that: neither the ground nor
/// the joints beside it bear more than a part of the rope's weight.
#[test]
fn what_is_held_where_it_lies_bears_no_more_than_the_weight() {
    let ground = Obstacle::new(ground(), rough(0.3));
    for (by_face, depth) in [(false, 1e-6), (false, 1e-7), (true, 1e-6)] {
        let mut assembly = Assembly::new(Vector3::z() * -GRAVITY);
        let low = Vector3::z() * (RADIUS - depth);
        let rod =
            assembly.rod(&RodSpec::new(shape::straight(low, Vector3::x(), 0.6, 15), RADIUS, material(1e6, 1000.0)));
        if by_face {
            assembly.clamp_start(&rod);
        } else {
            assembly.fix(rod.start + 4);
        }
        let (mut model, state) = assembly.finish();
        model.contacts.obstacles = vec![ground.clone()];
        let weight = GRAVITY * model.segments.iter().map(|segment| segment.mass()).sum::<f64>();
        let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
        let (mut joints, mut contacts) = (vec![JointForce::default(); model.joints.len()], Vec::new());
        for _ in 0..50 {
            assert_eq!(simulation.step(DT).unwrap().status, Status::Converged);
        }
        simulation.store_joint_forces(&mut joints);
        simulation.store_contact_forces(&mut contacts);
        let all =
            joints.iter().map(|joint| joint.force.norm()).chain(contacts.iter().map(|contact| contact.force.norm()));
        let largest = all.fold(0.0, f64::max);
        assert!(largest < weight, "held by its face: {by_face}, {depth} m deep: {largest} N of {weight} N");
    }
}

/// What meets the ground slower than gravity would make it in two steps does not bounce: with gravity as it is then.
#[test]
fn without_gravity_what_is_slow_bounces_too() {
    let (mut model, mut state) = block();
    let below = ObstacleShape::HalfSpace { point: Vector3::z() * -0.005, normal: Unit::new_normalize(Vector3::z()) };
    model.contacts.obstacles = vec![Obstacle::new(below, Surface { restitution: 0.8, ..rough(0.3) })];
    let track = Track::new(&[(0.0, Vector3::z() * -GRAVITY), (1e-3, Vector3::zeros())], Interpolation::Linear).unwrap();
    model.changes.push(Change { of: Changing::Gravity, track: Arc::new(track) });
    let speed = GRAVITY * DT;
    state.velocities.iter_mut().for_each(|velocity| *velocity = Vector3::z() * -speed);
    let mut up = 0.0;
    run(&model, &state, &sharp(), 20, |_, now| up = now.velocities[0].z);
    assert!((up / speed - 0.8).abs() < 1e-2, "{up} of {speed} m/s");
}
