//! Rigid bodies that rods carry and that carry rods: pendulums, balance, momenta, what holds them, what they touch.

use std::f64::consts::PI;
use std::sync::Arc;

use acceptance::{Beam, assert_order, by_euler, relaxed, run, tight};
use cosserat::assembly::{
    Air, Assembly, BodyShape, Friction, Material, Obstacle, ObstacleShape, RigidBody, RodSpec, Surface, Wind, shape,
};
use cosserat::motion::{Driven, Interpolation, Keyframe, Motion, Reaction};
use cosserat::scene;
use cosserat::simulation::{Formulation, PreconditionerKind, Settings, Simulation, SolverKind, Status};
use cosserat::state::{Body, JointForce, Model, OnPulley, Pose, State, measure};
use nalgebra::{Unit, UnitQuaternion, Vector3};

use crate::dynamics::discrete_angular_momentum;

const GRAVITY: f64 = 9.81;
const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -GRAVITY);

/// Upright, at a place.
fn at(position: Vector3<f64>) -> Pose {
    Pose { position, orientation: UnitQuaternion::identity() }
}

/// A box whose three moments of inertia differ.
pub(crate) fn brick(mass: f64) -> RigidBody {
    RigidBody::new(BodyShape::Box { sides: Vector3::new(0.1, 0.6, 0.25) }, mass)
}

/// Circular frequency of the oscillation of `coordinate`, without the shift that implicit Euler gives it.
fn frequency(model: &Model, state: &State, dt: f64, coordinate: impl Fn(&State) -> f64) -> f64 {
    let mut simulation = Simulation::new(model, state, &tight(), None).unwrap();
    let mut state = state.clone();
    let (mut crossings, mut before) = (Vec::new(), coordinate(&state));
    for step in 0..20_000 {
        assert_eq!(simulation.step(dt).unwrap().status, Status::Converged);
        simulation.store(&mut state);
        let now = coordinate(&state);
        if before * now < 0.0 {
            crossings.push((f64::from(step) + before / (before - now)) * dt);
        }
        before = now;
        if crossings.len() == 5 {
            let found = 4.0 * PI / (crossings[4] - crossings[0]);
            return (found * dt).tan() / dt;
        }
    }
    panic!("no oscillation");
}

/// A body on a stiff stick of one segment, whose upper end turns freely about the origin.
pub(crate) fn pendulum(body: RigidBody, place: Vector3<f64>, swing: Vector3<f64>) -> (Model, State, f64) {
    let (length, material) = (0.5, Material { youngs_modulus: 1e9, torsion_modulus: 1e9, density: 100.0 });
    let mut assembly = Assembly::new(DOWN);
    let nodes = shape::straight(Vector3::zeros(), -Vector3::z(), length, 1);
    let stick = assembly.rod(&RodSpec::new(nodes, 0.005, material));
    assembly.clamp_start(&stick);
    let centre = Vector3::z() * -length - place;
    let bob = assembly.body(body.clone(), at(centre));
    assembly.join_body(stick.start, 1.0, bob, &place);
    let model = assembly.model_mut();
    (model.joints[0].bend_compliance, model.joints[0].twist_compliance) = (1e12, 1e12);
    (model.joints[1].bend_compliance, model.joints[1].twist_compliance) = (1e-9, 1e-9);
    let stick = model.segments[0].clone();
    let axis = swing.normalize();
    let about = |i: Vector3<f64>| axis.dot(&i.component_mul(&axis));
    let arm = |x: Vector3<f64>| x.norm_squared() - x.dot(&axis).powi(2);
    let inertia = about(body.inertia) + body.mass * arm(centre) + stick.mass() * length.powi(2) / 3.0;
    let pull = GRAVITY * (body.mass * -centre.z + stick.mass() * 0.5 * length);
    let state = assembly.state_mut();
    for i in 0..2 {
        state.angular_velocities[i] = swing;
        state.velocities[i] = swing.cross(&state.positions[i]);
    }
    let (model, state) = assembly.finish();
    (model, state, (pull / inertia).sqrt())
}

#[test]
fn a_body_on_a_stick_swings_with_the_period_of_a_physical_pendulum() {
    let ball = RigidBody::new(BodyShape::Sphere { radius: 0.3 }, 2.0);
    let cases = [
        ("ball", ball, Vector3::z() * 0.3, Vector3::y()),
        ("brick about x", brick(2.0), Vector3::z() * 0.125, Vector3::x()),
        ("brick about y", brick(2.0), Vector3::z() * 0.125, Vector3::y()),
    ];
    for (case, body, place, axis) in cases {
        let (model, state, exact) = pendulum(body, place, axis * 1e-3);
        let across = axis.cross(&Vector3::z());
        let found = frequency(&model, &state, 0.02 / exact, |state| state.positions[1].dot(&across));
        println!("{case}: {found} rad/s, theory {exact}");
        assert!((found / exact - 1.0).abs() < 5e-6, "{case}: {found} instead of {exact}");
    }
}

/// Spun about its middle axis a body turns over again and again, with the same angular momentum and energy.
#[test]
fn a_free_body_keeps_its_angular_momentum_to_rounding_as_it_turns_over() {
    let mut assembly = Assembly::new(Vector3::zeros());
    let orientation = UnitQuaternion::from_euler_angles(0.3, -0.4, 1.0);
    let body = assembly.body(brick(3.0), Pose { position: Vector3::zeros(), orientation });
    let middle = Vector3::z();
    assert_eq!(brick(3.0).inertia.imin() + brick(3.0).inertia.imax(), 1, "the middle axis is z");
    assembly.state_mut().angular_velocities[body] = orientation * (middle * 6.0 + Vector3::new(0.01, 0.0, 0.0));
    let (model, state) = assembly.finish();
    let dt = 0.01;
    let before = discrete_angular_momentum(&model, &state, dt);
    let energy = measure::energy(&model, &state).kinetic;
    let mut simulation = Simulation::new(&model, &state, &by_euler(Settings::default()), None).unwrap();
    let mut now = state.clone();
    let mut turned_over = false;
    for _ in 0..1000 {
        assert_eq!(simulation.step(dt).unwrap().status, Status::Converged);
        simulation.store(&mut now);
        let change = (discrete_angular_momentum(&model, &now, dt) - before).norm() / before.norm();
        assert!(change < 1e-11, "{change}");
        assert!((measure::energy(&model, &now).kinetic / energy - 1.0).abs() < 5e-3);
        turned_over |= (now.orientations[body] * middle).dot(&(orientation * middle)) < -0.9;
    }
    assert!(turned_over);
}

/// A brick and a ball at the ends of a soft rod, thrown and spinning.
fn bola() -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let beam = Beam::rubber(10);
    let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::x()));
    let brick = assembly.body(brick(0.5), at(Vector3::new(-0.1, 0.2, 0.0)));
    assembly.join_body(rod.start, 0.0, brick, &Vector3::new(0.1, -0.2, 0.0));
    let ball = assembly.body(RigidBody::new(BodyShape::Sphere { radius: 0.1 }, 0.3), at(Vector3::x() * 1.1));
    assembly.join_body(rod.end - 1, 1.0, ball, &Vector3::new(-0.1, 0.0, 0.0));
    let spin = Vector3::new(0.4, 1.0, 2.0);
    let state = assembly.state_mut();
    for i in 0..state.len() {
        state.velocities[i] = Vector3::new(1.0, -2.0, 3.0) + spin.cross(&state.positions[i]);
        state.angular_velocities[i] = spin;
    }
    assembly.finish()
}

#[test]
fn two_bodies_on_a_rod_in_free_flight_keep_their_momenta() {
    let (model, state) = bola();
    let momentum = measure::linear_momentum(&model, &state);
    let angular = measure::angular_momentum(&model, &state);
    for formulation in Formulation::ALL {
        let mut settings = tight();
        settings.step.formulation = formulation;
        let drifts = [100, 200, 400].map(|steps| {
            let dt = 0.5 / f64::from(steps);
            let (_, end) = run(&model, &state, &settings, dt, steps as usize);
            let change = (measure::linear_momentum(&model, &end) - momentum).norm() / momentum.norm();
            assert!(change < 1e-12, "{formulation}: {change}");
            (discrete_angular_momentum(&model, &end, dt) - angular).norm() / angular.norm()
        });
        // Symplectic Euler: forces act where the bodies are at the end of a step.
        assert_order(&format!("angular momentum of a bola, {formulation}"), &drifts, 1.0);
    }
}

#[test]
fn all_linear_solvers_and_lanes_agree_on_bodies() {
    let (model, state) = bola();
    let settings = |solver: SolverKind| Settings { solver, ..tight() };
    let (_, expected) = run(&model, &state, &settings(SolverKind::Direct), 2e-3, 20);
    let cg = [PreconditionerKind::BlockJacobi, PreconditionerKind::Frozen].map(SolverKind::cg);
    for solver in [SolverKind::Sparse].into_iter().chain(cg) {
        let (_, end) = run(&model, &state, &settings(solver), 2e-3, 20);
        for (a, b) in end.positions.iter().zip(&expected.positions) {
            assert!((a - b).norm() < 1e-7, "{}", solver.name());
        }
    }
}

/// Held at a place off its middle, a body hangs with its centre of mass below it.
#[test]
fn a_body_on_a_rope_comes_to_rest_below_it() {
    let mut assembly = Assembly::new(DOWN);
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1000.0 };
    let nodes = shape::straight(Vector3::zeros(), -Vector3::z(), 0.5, 10);
    let rope = assembly.rod(&RodSpec::new(nodes, 0.001, material));
    assembly.clamp_start(&rope);
    let place = Vector3::new(0.02, 0.05, 0.1);
    let body = assembly.body(brick(2.0), at(Vector3::z() * -0.5 - place));
    assembly.join_body(rope.end - 1, 1.0, body, &place);
    let (model, state) = relaxed(assembly);
    let held = state.orientations[body] * place;
    println!("centre {}, held {held}", state.positions[body]);
    // The rope's stiffness takes the rest: B / (m g) under its length.
    assert!(state.positions[body].xy().norm() < 1e-6 && held.xy().norm() < 1e-5);
    assert!((held.z - place.norm()).abs() < 1e-6 && (state.positions[body].z + 0.5 + place.norm()).abs() < 1e-5);
    assert!(measure::worst_gap(&model, &state) < 1e-6);
}

/// A beam with a weight at each end, hung where the moments balance, stays level; hung elsewhere it does not.
#[test]
fn a_mobile_balances() {
    let level = |at_mass_ratio: f64| {
        let mut assembly = Assembly::new(DOWN);
        let stiff = Material { youngs_modulus: 1e11, torsion_modulus: 1e11, density: 1.0 };
        let soft = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1.0 };
        let beam = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 0.6, 12), 0.005, stiff));
        let thread = assembly.rod(&RodSpec::new(
            shape::straight(Vector3::new(0.2, 0.0, 0.3), -Vector3::z(), 0.3, 10),
            0.0005,
            soft,
        ));
        assembly.clamp_start(&thread).join(beam.start + 3, 1.0, thread.end - 1, 1.0);
        let weights = [(beam.start, 0.0, 0.2), (beam.end - 1, 1.0, 0.2 / at_mass_ratio)].map(|(segment, end, mass)| {
            let centre = Vector3::new(end * 0.6, 0.0, -0.05);
            let weight = assembly.body(RigidBody::new(BodyShape::Sphere { radius: 0.03 }, mass), at(centre));
            assembly.join_body(segment, end, weight, &Vector3::new(0.0, 0.0, 0.05));
            weight
        });
        let (_, state) = relaxed(assembly);
        state.positions[weights[0]].z - state.positions[weights[1]].z
    };
    let (balanced, heavy) = (level(2.0), level(1.9));
    println!("a balanced mobile is off by {balanced} m, a heavier weight hangs {heavy} m lower");
    assert!(balanced.abs() < 1e-3 && heavy > 0.05);
}

/// A body that is held feels the weight of all that hangs on it, at the place where it hangs.
#[test]
fn a_held_body_carries_what_hangs_on_it() {
    let mut assembly = Assembly::new(DOWN);
    let place = Vector3::new(0.3, -0.1, -0.05);
    let held = assembly.body(brick(2.0), at(Vector3::zeros()));
    let rod = assembly.rod(&Beam::rubber(5).spec(place, -Vector3::z()));
    assembly.join_body(rod.start, 0.0, held, &place).fix(held);
    let ball = assembly.body(RigidBody::new(BodyShape::Sphere { radius: 0.1 }, 1.5), at(place - Vector3::z() * 1.1));
    assembly.join_body(rod.end - 1, 1.0, ball, &(Vector3::z() * 0.1));
    let (model, state) = assembly.finish();
    let hanging: f64 = model.segments[1..].iter().map(|segment| segment.mass()).sum();
    let (simulation, end) = run(&model, &state, &tight(), 0.01, 10);
    let mut forces = vec![JointForce::default(); model.joints.len()];
    simulation.store_joint_forces(&mut forces);
    let reaction = Reaction::all(&model, [&end, &end], [0.0, 0.01], &forces, &[])[0];
    assert_eq!(reaction.body, Body::Segment(held));
    let weight = -DOWN * (hanging + 2.0);
    assert!((reaction.force - weight).norm() < 1e-8 * weight.norm(), "{}", reaction.force);
    let moment = place.cross(&(-DOWN * hanging));
    assert!((reaction.moment - moment).norm() < 1e-8 * moment.norm(), "{} and {moment}", reaction.moment);
    // At the rod's start the body pulls against the rod's axis: that is tension.
    let tension = forces.iter().zip(&model.joints).map(|(force, joint)| force.tension(&model, &end, joint));
    assert!(tension.into_iter().all(|tension| tension > 0.0));
}

#[test]
fn a_driven_body_takes_the_rods_along() {
    let mut assembly = Assembly::new(DOWN);
    let hand = assembly.body(brick(1.0), at(Vector3::zeros()));
    let place = Vector3::new(0.05, 0.3, 0.0);
    let rod = assembly.rod(&Beam::rubber(8).spec(place, Vector3::y()));
    assembly.join_body(rod.start, 0.0, hand, &place).fix(hand);
    let keyframe = |time: f64, shift: Vector3<f64>, turn: Vector3<f64>| Keyframe { time, position: shift, turn };
    let (shift, turn) = (Vector3::new(0.5, 0.2, 0.4), Vector3::new(0.3, -0.8, 1.2));
    let frames = [keyframe(0.0, Vector3::zeros(), Vector3::zeros()), keyframe(0.5, shift, turn)];
    let motion = Motion::new(UnitQuaternion::identity(), &frames, Interpolation::Smooth).unwrap();
    assembly.model_mut().motions.push(Driven::new(Body::Segment(hand), Arc::new(motion)));
    let (model, state) = assembly.finish();
    let (_, end) = run(&model, &state, &Settings::default(), 0.01, 60);
    assert!((end.positions[hand] - shift).norm() < 1e-12);
    assert!(end.orientations[hand].angle_to(&UnitQuaternion::from_scaled_axis(turn)) < 1e-12);
    assert!(measure::worst_gap(&model, &end) < 1e-3);
    let root = shift + end.orientations[hand] * place;
    let half = 0.5 * model.segments[rod.start].length;
    assert!((end.positions[rod.start] - end.axis(rod.start) * half - root).norm() < 1e-4);
}

/// The ground z < 0.
fn ground(friction: f64) -> Obstacle {
    let normal = Unit::new_normalize(Vector3::z());
    let surface = Surface { friction: Friction::new(friction), restitution: 0.0 };
    Obstacle::new(ObstacleShape::HalfSpace { point: Vector3::zeros(), normal }, surface)
}

/// A ball that is pushed along the ground slides until it rolls, at 5/7 of its speed, whatever the friction.
#[test]
fn a_ball_slides_rests_on_the_ground_and_rolls() {
    let (radius, speed, friction) = (0.1, 1.4, 0.3);
    let mut assembly = Assembly::new(DOWN);
    let ball = assembly.body(RigidBody::new(BodyShape::Sphere { radius }, 2.0), at(Vector3::z() * radius));
    assembly.state_mut().velocities[ball] = Vector3::x() * speed;
    assembly.model_mut().contacts.obstacles.push(ground(friction));
    let (model, state) = assembly.finish();
    // Friction moves the ball by no more than 1e-5 m a step.
    let mut settings = Settings::default();
    settings.step.contact_tolerance = 1e-7;
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let (dt, mut now) = (1e-3, state.clone());
    for step in 1..=500 {
        assert_eq!(simulation.step(dt).unwrap().status, Status::Converged);
        simulation.store(&mut now);
        assert!((now.positions[ball].z - radius).abs() < 2e-3 * radius, "step {step}");
        let time = dt * f64::from(step);
        if time < 0.1 {
            // The ground presses with the weight, and friction takes its share of that from the speed.
            let expected = speed - friction * GRAVITY * time;
            assert!((now.velocities[ball].x - expected).abs() < 5e-3 * speed, "step {step}");
        }
    }
    let (v, w) = (now.velocities[ball], now.angular_velocities[ball]);
    assert!((v.x / speed - 5.0 / 7.0).abs() < 5e-3, "{v}");
    assert!((w.y * radius / v.x - 1.0).abs() < 5e-3, "{w}");
}

/// Two balls on a smooth pulley: the heavy one pulls the other over it.
#[test]
fn a_ball_pulls_a_rope_over_an_obstacle() {
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
    let (pulley, rope) = (0.1, 0.004);
    let reach = pulley + rope;
    let mut nodes: Vec<Vector3<f64>> = (0..30).map(|i| Vector3::new(-reach, 0.0, -0.6 + 0.02 * f64::from(i))).collect();
    nodes.extend((0..=16).map(|i| {
        let angle = PI * f64::from(i) / 16.0;
        // Nodes on the circle whose chords touch the pulley.
        Vector3::new(-angle.cos(), 0.0, angle.sin()) * (reach / (PI / 32.0).cos())
    }));
    nodes.extend((1..=30).map(|i| Vector3::new(reach, 0.0, -0.02 * f64::from(i))));
    let mut assembly = Assembly::new(DOWN);
    let rope = assembly.rod(&RodSpec::new(nodes, rope, material));
    let weights = [(rope.start, 0.0, -reach, 1.0), (rope.end - 1, 1.0, reach, 1.5)].map(|(segment, end, x, mass)| {
        let centre = Vector3::new(x, 0.0, -0.65);
        let ball = assembly.body(RigidBody::new(BodyShape::Sphere { radius: 0.04 }, mass), at(centre));
        assembly.join_body(segment, end, ball, &(Vector3::z() * 0.05));
        ball
    });
    let [start, end] = [-1.0, 1.0].map(|y| Vector3::y() * y);
    let shape = ObstacleShape::Capsule { start, end, radius: pulley };
    assembly.model_mut().contacts.obstacles.push(Obstacle::new(shape, Surface::default()));
    let (model, state) = assembly.finish();
    let mass: f64 = model.segments.iter().map(|segment| segment.mass()).sum();
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    let (dt, steps) = (2e-3, 100);
    for step in 0..steps {
        let status = simulation.step(dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
    }
    let mut now = state.clone();
    simulation.store(&mut now);
    let time = dt * f64::from(steps);
    let expected = 0.5 * GRAVITY * 0.5 / mass * time * time;
    let [up, down] = weights.map(|i| now.positions[i].z - state.positions[i].z);
    println!("after {time} s one is {up} m up and the other {} m down; Atwood's machine: {expected} m", -down);
    assert!((up / expected - 1.0).abs() < 0.05 && (-down / expected - 1.0).abs() < 0.05);
}

/// When the trolley has stopped, the load swings as a rigid body on a cable does: a double pendulum in its slow mode.
#[test]
fn the_load_of_the_crane_swings_with_its_period() {
    let scene = scene::builtin("crane").unwrap();
    let (model, mut state) = (scene.model, scene.state);
    let (trolley, load) = (scene.rods[0].segments.start, scene.rods[1].segments.start);
    let body = model.segments[load].body.as_ref().unwrap();
    let (length, arm) = (6.0, 0.6);
    // Of M x'' = -K x with the angles x of cable and load, over m: M = [L^2, L d; L d, d^2 + I / m], K = g diag(L, d).
    let own = arm * arm + body.inertia.y / body.mass;
    let (a, b) = (own / (GRAVITY * arm), length / GRAVITY);
    let coupling = length * arm / GRAVITY;
    // Its compliance K^-1 M has the largest eigenvalue 1 / omega^2.
    let slow = 0.5 * (a + b) + (0.25 * (a - b).powi(2) + coupling * coupling / (length * arm)).sqrt();
    let exact = slow.sqrt().recip();
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    let (mut crossings, mut before, mut aside) = (Vec::new(), 0.0, 0.0);
    for step in 1..=scene.run.steps {
        assert_eq!(simulation.step(scene.run.dt).unwrap().status, Status::Converged);
        simulation.store(&mut state);
        let time = scene.run.dt * step as f64;
        let now = state.positions[load].x - state.positions[trolley].x;
        if time > 4.0 && before * now < 0.0 {
            crossings.push(time - scene.run.dt * now / (now - before));
        }
        before = now;
        aside += state.positions[load].y / scene.run.steps as f64;
    }
    assert!((state.positions[trolley] - Vector3::x() * 2.0).norm() < 1e-12);
    let halves = (crossings.len() - 1) as f64;
    let found = PI * halves / (crossings[crossings.len() - 1] - crossings[0]);
    // The wind's push over the weight, less what gusts and the swing to and fro leave open.
    let push = 0.5 * 1.2 * body.drag_area * 5.0 * 5.0 / (body.mass * GRAVITY);
    let leaning = push * (length + arm);
    println!("the load swings at {found} rad/s, theory {exact}; it is {aside} m aside, theory {leaning} m");
    assert!((0.5..1.5).contains(&(aside / leaning)));
    assert!(halves >= 3.0 && (found / exact - 1.0).abs() < 0.02, "{found} instead of {exact}");
    assert!(measure::worst_gap(&model, &state) < 1e-3);
}

/// A ball falls through air towards its terminal speed, `v = V tanh(g t / V)`, and a wind carries it along.
#[test]
fn a_ball_falls_at_its_terminal_speed() {
    let (radius, mass, density) = (0.05, 0.02, 1.2);
    let wind = Vector3::new(3.0, 0.0, 0.0);
    let mut assembly = Assembly::new(DOWN);
    let ball = assembly.body(RigidBody::new(BodyShape::Sphere { radius }, mass), at(Vector3::zeros()));
    let wind = Wind::steady(wind);
    assembly.air(Air { density, normal_drag: 1.1, tangential_drag: 0.01, wind });
    assembly.state_mut().velocities[ball] = Vector3::x() * 3.0;
    let (model, state) = assembly.finish();
    let terminal = (2.0 * mass * GRAVITY / (density * 0.47 * PI * radius * radius)).sqrt();
    let errors = [200, 400, 800].map(|steps| {
        let dt = 0.5 / f64::from(steps);
        let (_, end) = run(&model, &state, &Settings::default(), dt, steps as usize);
        assert!((end.velocities[ball].x - 3.0).abs() < 1e-12, "it goes with the wind");
        -end.velocities[ball].z - terminal * (GRAVITY * 0.5 / terminal).tanh()
    });
    assert_order("a ball falling for 0.5 s", &errors, 1.0);
    assert!(errors[2].abs() < 1e-2 * terminal);
    let (_, end) = run(&model, &state, &Settings::default(), 0.02, 500);
    assert!((-end.velocities[ball].z / terminal - 1.0).abs() < 1e-6);
}

/// A finger, guided by what moves with the jaw, presses a cable against it with 30 N, and all go up by 20 cm. Friction holds
/// the cable where both sides together bear its weight, 2 mu N > m (g + a): m g is 1.48 N and the most that is needed 1.66 N.
#[test]
fn a_gripper_lifts_a_cable_where_friction_bears_its_weight() {
    let lifted = |friction: f64| {
        let up = "motion = { times_s = [0, 0.5, 1.5], shifts_m = [[0, 0, 0], [0, 0, 0], [0, 0, 0.2]], interpolation = \"smooth\" }";
        let part = |name: &str, friction: f64, [x, y, z]: [f64; 3], sides: &str, motion: &str| {
            format!(
                "[[obstacles]]\nname = \"{name}\"\nfriction = {friction}\nshape.box = {{ sides_m = {sides}, centre_m = [{x}, {y}, \
                 {z}] }}\n{motion}\n"
            )
        };
        let text = [
            format!("run = {{ dt_s = 0.005, steps = 320 }}\ndamping = {{ linear_per_s = 0.5, angular_per_s = 1 }}\ncontact.friction = {friction}\n"),
            "[[rods]]\nname = \"cable\"\nradius_m = 0.01\nyoungs_modulus_pa = 1e7\ndensity_kg_m3 = 1200\nshape.straight = { start_m = \
             [-0.2, 0, 0.0601], direction = [1, 0, 0], length_m = 0.4, segments = 20 }\n"
                .to_owned(),
            part("left", 0.5, [-0.15, 0.0, 0.0], "[0.04, 0.1, 0.1]", ""),
            part("right", 0.5, [0.15, 0.0, 0.0], "[0.04, 0.1, 0.1]", ""),
            part("jaw", friction, [0.0, 0.021, 0.06], "[0.06, 0.02, 0.06]", up),
            part("shelf", 0.0, [0.0, -0.075, 0.015], "[0.06, 0.1, 0.01]", up),
            part("roof", 0.0, [0.0, -0.075, 0.1052], "[0.06, 0.1, 0.01]", up),
            "[[bodies]]\nname = \"finger\"\nmass_kg = 0.2\nposition_m = [0, -0.05, 0.0601]\nshape.box = { sides_m = [0.06, 0.06, 0.08] }\n\
             loads = [{ times_s = [0, 0.2], forces_n = [[0, 2, 0], [0, 30, 0]] }]\n"
                .to_owned(),
        ]
        .concat();
        let scene = scene::parse(&text, "gripper.toml").unwrap();
        let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
        let mut state = scene.state.clone();
        for _ in 0..scene.run.steps {
            simulation.step(scene.run.dt).unwrap();
        }
        simulation.store(&mut state);
        // The finger is segment 0, the cable's two in the middle are 10 and 11.
        0.5 * (state.positions[10].z + state.positions[11].z) - 0.06
    };
    let (slips, holds) = (lifted(0.015), lifted(0.04));
    println!("lifted by {slips} m and {holds} m");
    assert!((holds - 0.2).abs() < 4e-3 && slips < 0.1, "{holds} m, {slips} m");
}

/// What is pushed out of the ground in a step keeps that velocity: however large the body and short the step, that is none
/// beside gravity's.
#[test]
fn a_large_body_rests_in_short_steps() {
    for dt in [0.02, 0.005, 0.001] {
        let mut assembly = Assembly::new(DOWN);
        let sides = Vector3::new(10.0, 10.0, 10.0);
        let body = assembly.body(RigidBody::new(BodyShape::Box { sides }, 1000.0), at(Vector3::z() * 5.0));
        assembly.model_mut().contacts.obstacles.push(ground(0.5));
        let (model, state) = assembly.finish();
        let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
        let (mut now, mut highest) = (state.clone(), 0.0_f64);
        for _ in 0..500 {
            assert_eq!(simulation.step(dt).unwrap().status, Status::Converged);
            simulation.store(&mut now);
            highest = highest.max(now.positions[body].z - 5.0);
        }
        println!("steps of {dt} s: up by {highest} m at most");
        assert!(highest < GRAVITY * dt * dt, "steps of {dt} s: {highest} m");
    }
}

/// Atwood's machine with a wheel far heavier than what hangs on it: it turns as the weights' difference says, and gains no energy.
#[test]
fn a_heavy_wheel_turns_as_its_inertia_says() {
    let (radius, inertia, weights, length) = (0.3, 9.0, [0.2, 0.4], 0.05);
    let on = |k: usize| PI * (1.0 - k as f64 / 24.0);
    let side = |sign: f64| move |k: usize| [sign * radius, 0.0, -length * k as f64];
    let nodes: Vec<[f64; 3]> = (1..=20)
        .rev()
        .map(side(-1.0))
        .chain((0..=24).map(|k| [radius * on(k).cos(), 0.0, radius * on(k).sin()]))
        .chain((1..=20).map(side(1.0)))
        .collect();
    let dt = 0.005;
    let text = format!(
        "run.dt_s = {dt}\n[[rods]]\nname = \"rope\"\nradius_m = 0.003\nyoungs_modulus_pa = 1e7\ntorsion_modulus_pa = 1e7\ndensity_kg_m3 \
         = 1000\nrest = \"straight\"\nmasses = [{{ segment = 0, mass_kg = {} }}, {{ segment = -1, mass_kg = {} }}]\nshape.polyline = {{ \
         nodes_m = {nodes:?} }}\n[[pulleys]]\nname = \"wheel\"\nrod = \"rope\"\ncentre_m = [0, 0, 0]\naxis = [0, 1, 0]\nradius_m = \
         {radius}\nfriction = 0.5\ninertia_kg_m2 = {inertia}\n",
        weights[0], weights[1]
    );
    let scene = scene::parse(&text, "wheel.toml").unwrap();
    let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
    let mut state = scene.state.clone();
    let energy = |state: &State| measure::energy(&scene.model, state).total();
    let (start, mut highest) = (energy(&state), f64::NEG_INFINITY);
    for _ in 0..(2.0 / dt) as usize {
        assert!(simulation.step(dt).unwrap().status <= Status::ConvergedInSubsteps);
        simulation.store(&mut state);
        highest = highest.max(energy(&state));
    }
    let mut pulleys = vec![OnPulley::default(); 1];
    simulation.store_pulleys(&mut pulleys);
    let rope = 1000.0 * PI * 0.003_f64.powi(2) * (40.0 * length + PI * radius);
    let expected = (weights[1] - weights[0]) * GRAVITY / (weights[0] + weights[1] + rope + inertia / radius.powi(2));
    let found = pulleys[0].rate * radius / 2.0;
    println!("steps of {dt} s: {found} m/s^2 for {expected}, energy up by {} J of {start}", highest - start);
    assert!((found / expected - 1.0).abs() < 0.01, "{found} m/s^2, not {expected}");
    assert!(highest - start < 5e-3, "{highest} J after {start} J");
}
