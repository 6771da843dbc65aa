//! Rods that run through eyelets: theory, conserved quantities, refinement.

use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use nalgebra::{UnitQuaternion, Vector3};
use rod::measure::energy;
use rod::{
    Assembly, Body, BodyShape, Contacts, Integrator, Load, Material, Model, Obstacle, ObstacleShape, Pose, RestShape,
    RigidBody, RodSpec, Sliding, SlidingJoint, State, Surface, shape,
};

pub(crate) const G: f64 = 9.81;

pub(crate) fn settings(integrator: Integrator) -> Settings {
    Settings { step: StepParams { integrator, ..StepParams::DEFAULT }, ..Settings::default() }
}

fn soft() -> Material {
    Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 }
}

fn here(position: Vector3<f64>) -> Pose {
    Pose { position, orientation: UnitQuaternion::identity() }
}

/// Adds an eyelet in the ground where the rod is at this distance from its start.
fn fixed_eyelet(model: &mut Model, state: &State, segments: std::ops::Range<usize>, start: f64, friction: f64) {
    let holder = Body::Anchor(model.anchors.len());
    let joint = SlidingJoint { segments, holder, place: Vector3::zeros(), start, friction, feed: None };
    model.anchors.push(here(joint.point(model, state, start)));
    model.sliding_joints.push(joint);
}

/// Steps `model` and shows each step's end.
pub(crate) fn run(
    model: &Model,
    state: &State,
    settings: &Settings,
    (dt, steps): (f64, usize),
    mut see: impl FnMut(f64, &State, &[Sliding]),
) -> Simulation {
    let mut simulation = Simulation::new(model, state, settings, None).unwrap();
    let (mut state, mut sliding) = (state.clone(), vec![Sliding::default(); model.sliding_joints.len()]);
    for step in 0..steps {
        let status = simulation.step(dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(&mut state);
        simulation.store_sliding(&mut sliding);
        see(simulation.time(), &state, &sliding);
    }
    simulation
}

/// A bead of 1 kg on a wire, whose segments are fixed, at this distance from its start.
fn bead(wire: Vec<Vector3<f64>>, start: f64, friction: f64) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::z() * -G);
    let wire = assembly.rod(&RodSpec::new(wire, 0.005, soft()));
    wire.clone().for_each(|i| _ = assembly.fix(i));
    let ball = RigidBody::new(BodyShape::Sphere { radius: 0.01 }, 1.0);
    let bead = assembly.body(ball, here(Vector3::zeros()));
    let (mut model, mut state) = assembly.finish();
    let joint = SlidingJoint {
        segments: wire,
        holder: Body::Segment(bead),
        place: Vector3::zeros(),
        start,
        friction,
        feed: None,
    };
    state.positions[bead] = joint.point(&model, &state, start);
    model.sliding_joints.push(joint);
    (model, state)
}

#[test]
fn a_bead_slides_down_a_wire_as_on_an_incline() {
    let (slope, dt) = (0.6_f64, 0.005);
    let along = Vector3::new(slope.cos(), 0.0, -slope.sin());
    for (friction, integrator) in [(0.0, Integrator::Bdf2), (0.3, Integrator::Bdf2), (0.3, Integrator::Euler)] {
        let (model, state) = bead(shape::straight(Vector3::zeros(), along, 6.0, 30), 0.5, friction);
        let acceleration = G * (slope.sin() - friction * slope.cos());
        let mut last = (0.0, 0.0);
        run(&model, &state, &settings(integrator), (dt, 200), |time, _, sliding| last = (time, sliding[0].place - 0.5));
        let (time, way) = last;
        // Euler's rule goes by one velocity a step.
        let expected = 0.5 * acceleration * time * (time + if integrator == Integrator::Euler { dt } else { 0.0 });
        assert!((way / expected - 1.0).abs() < 2e-3, "friction {friction}, {integrator}: {way} m, {expected} m");
    }
    // Steeper friction than the wire holds it for good.
    let (model, state) = bead(shape::straight(Vector3::zeros(), along, 6.0, 30), 0.5, slope.tan() + 1e-3);
    run(&model, &state, &settings(Integrator::Bdf2), (dt, 200), |_, state, sliding| {
        assert_eq!(sliding[0].place, 0.5);
        let fallen = (state.positions[30] - along * 0.5).norm();
        assert!(fallen < 1e-9, "{fallen}");
    });
}

/// A bead on a wire along a circle of 1 m swings as a pendulum and keeps its energy, with an error of second order.
#[test]
fn a_bead_on_a_circle_is_a_pendulum() {
    let circle = |k: usize| {
        let angle = -1.6 + 0.05 * k as f64;
        Vector3::new(angle.sin(), 0.0, -angle.cos())
    };
    let (model, state) = bead((0..=64).map(circle).collect(), 0.0, 0.0);
    let length: f64 = model.segments.iter().take(64).map(|segment| segment.length).sum();
    let swing = 0.4;
    let start = 0.5 * length - swing;
    let (model, state) = {
        let (mut model, mut state) = (model, state);
        model.sliding_joints[0].start = start;
        state.positions[64] = model.sliding_joints[0].point(&model, &state, start);
        (model, state)
    };
    let before = energy(&model, &state).total();
    let mut errors = Vec::new();
    for dt in [0.02, 0.01, 0.005] {
        let (mut crossings, mut last, mut worst) = (Vec::new(), (0.0, start), 0.0_f64);
        let steps = (6.0 / dt) as usize;
        run(&model, &state, &settings(Integrator::Bdf2), (dt, steps), |time, state, sliding| {
            let [from, to] = [last.1 - 0.5 * length, sliding[0].place - 0.5 * length];
            if from < 0.0 && to >= 0.0 {
                crossings.push(last.0 + (time - last.0) * from / (from - to));
            }
            last = (time, sliding[0].place);
            worst = worst.max((energy(&model, state).total() - before).abs());
        });
        let period = (crossings[2] - crossings[0]) / 2.0;
        let (theory, error) =
            (std::f64::consts::TAU / G.sqrt() * (1.0 + swing * swing / 16.0), worst / (G * swing * swing / 2.0));
        assert!((period / theory - 1.0).abs() < 2e-3 + 4.0 * dt * dt, "{dt}: {period} s, {theory} s");
        errors.push(error);
    }
    assert!(errors[2] < 4e-3 && errors.windows(2).all(|pair| pair[0] > 4.0 * pair[1]), "{errors:?}");
}

/// A taut rope that turns by an angle at an eyelet, straight on both sides of it, pulled by forces at its ends.
fn bent(turn: f64, pulls: [f64; 2], friction: f64, fraction: f64) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let direction = |sign: f64| Vector3::new(sign * (0.5 * turn).cos(), 0.0, -(0.5 * turn).sin());
    let nodes = (-10..=10).map(|k: i32| direction(f64::from(k.signum())) * (0.1 * f64::from(k.abs()))).collect();
    let rod = assembly.rod(&RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, 0.001, soft()) });
    for (segment, side, pull) in [(rod.start, -1.0, pulls[0]), (rod.end - 1, 1.0, pulls[1])] {
        let force = direction(side) * pull;
        assembly.load(Load { segment, offset: 0.05 * side, force, torque: Vector3::zeros(), follows: false });
    }
    assembly.damping(rod::Damping { linear: 5.0, angular: 5.0 });
    let (mut model, state) = assembly.finish();
    fixed_eyelet(&mut model, &state, rod, 1.0 + 0.1 * fraction, friction);
    (model, state)
}

#[test]
fn a_rope_slides_where_its_tensions_differ_by_the_capstan_factor() {
    for (turn, friction) in [(0.3_f64, 0.3), (0.5, 0.2), (1.0, 0.4)] {
        let factor = (friction * turn).exp();
        for (share, slides) in [(0.99, false), (1.01, true)] {
            let (model, state) = bent(turn, [10.0, 10.0 * factor * share], friction, 0.0);
            // The first jerk may take it along; what slides goes on to the rope's end.
            let mut place = 0.0;
            run(&model, &state, &settings(Integrator::Bdf2), (0.005, 200), |_, _, sliding| place = sliding[0].place);
            assert_eq!(place == 0.0, slides, "turn {turn}, friction {friction}, {share}: {place}");
            assert!(slides || place > 0.9, "turn {turn}, friction {friction}, {share}: {place}");
        }
    }
}

/// The force changes smoothly as eyelets pass from segment to segment, by less than 1 % in steps of a fiftieth of one.
#[test]
fn the_force_is_smooth_along_the_rod() {
    let (mut model, state) = bent(0.7, [10.0, 0.0], 0.0, 0.0);
    let end = state.positions[19] + state.axis(19) * 0.05;
    model.loads.pop();
    // A hand leads the end away.
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.damping(model.damping);
    let nodes = (0..=20).map(|k| match k {
        0..=19 => state.positions[k] - state.axis(k) * 0.05,
        _ => end,
    });
    let rod = assembly.rod(&RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes.collect(), 0.001, soft()) });
    assembly.clamp_end(&rod).load(model.loads[0]);
    let (mut model, state) = assembly.finish();
    model.pin(model.joints.len() - 1);
    let from = model.anchors[0];
    let keys = [(0.0, from), (10.0, Pose { position: from.position + state.axis(19) * 0.6, ..from })];
    let motion = rod::Motion::through(&keys, rod::Interpolation::Linear).unwrap();
    model.motions.push(rod::Driven::new(Body::Anchor(0), std::sync::Arc::new(motion)));
    fixed_eyelet(&mut model, &state, rod, 1.0, 0.0);
    let mut forces = Vec::new();
    run(&model, &state, &settings(Integrator::Bdf2), (1.0 / 30.0, 280), |_, _, sliding| {
        forces.push((sliding[0].force, sliding[0].place));
    });
    let settled = &forces[40..];
    let passed = settled[settled.len() - 1].1 - settled[0].1;
    assert!(passed.abs() > 0.4, "four segments have passed: {passed}");
    for pair in settled.windows(2) {
        let [a, b] = [pair[0].0, pair[1].0];
        assert!((b - a).norm() < 0.01 * a.norm(), "{a:?} {b:?}");
    }
    // 2 T sin(turn / 2), to what a rod of rigid segments makes of it.
    let mean = settled.iter().map(|(force, _)| force.norm()).sum::<f64>() / settled.len() as f64;
    assert!((mean / (20.0 * 0.35_f64.sin()) - 1.0).abs() < 0.02, "{mean}");
}

/// Two masses on a rope over four eyelets that turn it by 45 degrees each, as over a pulley without friction.
#[test]
fn atwoods_machine_of_eyelets() {
    let mut assembly = Assembly::new(Vector3::z() * -G);
    let (h, radius) = (0.05, 0.3);
    let corner = |k: usize| {
        let angle = std::f64::consts::FRAC_PI_4 * (k as f64 + 0.5);
        Vector3::new(-angle.cos(), 0.0, angle.sin()) * radius
    };
    let mut nodes: Vec<_> = (1..=20).rev().map(|k| corner(0) - Vector3::z() * (h * k as f64)).collect();
    let mut places = vec![20.0 * h];
    nodes.push(corner(0));
    for k in 1..4 {
        let (from, to) = (corner(k - 1), corner(k));
        let pieces = 5;
        nodes.extend((1..=pieces).map(|i| from + (to - from) * (f64::from(i) / f64::from(pieces))));
        places.push(places[k - 1] + (to - from).norm());
    }
    nodes.extend((1..=20).map(|k| corner(3) - Vector3::z() * (h * k as f64)));
    let rope = assembly.rod(&RodSpec {
        rest: RestShape::Straight,
        ..RodSpec::new(nodes, 0.001, Material { density: 1000.0, ..soft() })
    });
    let (m1, m2) = (1.0, 1.8);
    assembly.add_mass(rope.start, m1).add_mass(rope.end - 1, m2);
    let (mut model, state) = assembly.finish();
    places.iter().for_each(|&place| fixed_eyelet(&mut model, &state, rope.clone(), place, 0.0));
    let mut ways = Vec::new();
    run(&model, &state, &settings(Integrator::Bdf2), (0.0025, 200), |time, state, sliding| {
        let [first, last] = [rope.start, rope.end - 1].map(|i| state.positions[i].z);
        ways.push((time, 0.5 * (last - first), energy(&model, state).total()));
        assert_eq!(sliding.len(), 4);
    });
    // The corners are drawn sharp; once the rope is taut its ends go by the difference of the weights.
    let [a, b, c] = [60, 120, 180].map(|k| ways[k]);
    let acceleration = (c.1 - 2.0 * b.1 + a.1) / (b.0 - a.0).powi(2);
    let expected = -G * (m2 - m1) / (m1 + m2);
    assert!((acceleration / expected - 1.0).abs() < 0.01, "{acceleration}, {expected}");
    assert!((c.2 - a.2).abs() < 1e-2 * (m2 - m1) * G * (a.1 - c.1).abs(), "{} {}", c.2, a.2);
}

/// An eyelet that comes to an end of its rod stays there, and no energy comes of it.
#[test]
fn a_rod_stops_at_its_ends() {
    let wire = shape::straight(Vector3::zeros(), Vector3::new(1.0, 0.0, -0.5), 1.0, 10);
    let (model, state) = bead(wire, 0.5, 0.0);
    let before = energy(&model, &state).total();
    let mut places = Vec::new();
    run(&model, &state, &settings(Integrator::Bdf2), (0.005, 200), |_, state, sliding| {
        places.push(sliding[0].place);
        assert!(energy(&model, state).total() <= before + 1e-9);
    });
    assert_eq!(places.last(), Some(&1.0));
}

/// A rope through an eyelet above the ground falls onto it and is pulled away.
fn on_the_ground() -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::z() * -G);
    let radius = 0.005;
    let nodes = shape::straight(Vector3::z() * 0.03, Vector3::x(), 2.0, 40);
    let rope = assembly.rod(&RodSpec::new(nodes, radius, Material { density: 1000.0, ..soft() }));
    let pull = Vector3::new(5.0, 0.0, 5.0);
    assembly.load(Load { segment: rope.end - 1, offset: 0.025, force: pull, torque: Vector3::zeros(), follows: false });
    let (mut model, state) = assembly.finish();
    let ground =
        ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: nalgebra::Unit::new_normalize(Vector3::z()) };
    model.contacts = Contacts { obstacles: vec![Obstacle::new(ground, Surface::default())], ..Contacts::default() };
    fixed_eyelet(&mut model, &state, rope, 1.5, 0.2);
    (model, state)
}

#[test]
fn beside_contacts() {
    let (model, state) = on_the_ground();
    let mut place = 1.5;
    let mut simulation = run(&model, &state, &settings(Integrator::Bdf2), (0.005, 60), |_, state, sliding| {
        let lowest = state.positions.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
        assert!(lowest > 0.005 - 1e-5, "{lowest}");
        place = sliding[0].place;
    });
    assert!(place < 1.3, "{place}");
    assert!(simulation.counters().iterations < 10 * 60, "{}", simulation.counters().iterations);
    // Going on from a snapshot has the same bits.
    let snapshot = simulation.snapshot();
    let (mut first, mut second) = (state.clone(), state.clone());
    (0..5).for_each(|_| _ = simulation.step(0.005).unwrap());
    simulation.store(&mut first);
    let mut other = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
    other.restore(&snapshot).unwrap();
    (0..5).for_each(|_| _ = other.step(0.005).unwrap());
    other.store(&mut second);
    assert_eq!(first, second);
}

#[test]
fn what_has_no_eyelets_is_refused_by_name() {
    use dynamics::formulation::{ContactProjection, Formulation};
    let (model, state) = on_the_ground();
    let with = |step: StepParams| Simulation::new(&model, &state, &Settings { step, ..Settings::default() }, None);
    let error = |step: StepParams| with(step).err().map(|error| error.to_string()).unwrap_or_default();
    let own = StepParams { formulation: Formulation::Xpbd, ..StepParams::DEFAULT };
    assert_eq!(error(own), "sliding joints need formulation newton");
    let own = StepParams { contact_projection: ContactProjection::Alternating, ..StepParams::DEFAULT };
    assert_eq!(error(own), "sliding joints need contacts that are coupled");
    assert!(with(StepParams::DEFAULT).is_ok());
    // Segments of two rods, and an eyelet that is part of its own rod.
    let mut assembly = Assembly::new(Vector3::zeros());
    let line = |y: f64| RodSpec::new(shape::straight(Vector3::y() * y, Vector3::x(), 1.0, 4), 0.01, soft());
    assembly.rod(&line(0.0));
    assembly.rod(&line(1.0));
    let (model, state) = assembly.finish();
    let mistake = |segments, holder| {
        let joint = SlidingJoint { segments, holder, place: Vector3::zeros(), start: 0.5, friction: 0.0, feed: None };
        let model = Model { sliding_joints: vec![joint], ..model.clone() };
        model.validate(&state).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let part = "sliding joint 0: ";
    for (found, expected) in [
        (mistake(2..6, Body::Segment(7)), "last segment = 5, but it must be of the same rod as the first"),
        (
            mistake(0..4, Body::Segment(2)),
            "its holder, segment = 2, but it must be no segment of the rod that runs through it",
        ),
        (mistake(4..9, Body::Segment(2)), "segment 8 does not exist (there are 8)"),
        (mistake(0..4, Body::Segment(5)), ""),
    ] {
        let expected = if expected.is_empty() { String::new() } else { format!("{part}{expected}") };
        assert_eq!(found, expected);
    }
}
