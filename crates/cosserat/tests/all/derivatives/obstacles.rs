//! Derivatives of runs with respect to where obstacles are at each frame, against central differences of runs.

use std::sync::Arc;

use cosserat::derivative::{
    DerivativeError, Equilibrium, Forward, ObstacleVariation, Parameter, Recording, Rods, StateVariation, Variation,
    Wanted,
};
use cosserat::prelude::*;

use super::common::{Seen, assert_agree, carried, of_second_order, read, reading, settings, vector};

const DT: f64 = 5e-3;
/// Share of a variation by which differences go to either side.
const STEP: f64 = 5e-5;

struct Case {
    name: &'static str,
    model: Model,
    state: State,
    /// Where the obstacle is at each frame, counted from its first pose: shift and turn. Empty where it stands still.
    way: Vec<Pair>,
    /// After which steps the motion is read.
    read: Vec<usize>,
    /// Iterations after which a step is halved.
    iterations: usize,
}

type Pair = [Vector3<f64>; 2];

fn assembly() -> Assembly {
    Assembly::new(Vector3::new(0.0, 0.0, -9.81))
}

/// A straight rod of ten segments and radius .01 m, held at its start.
fn rod(assembly: &mut Assembly, from: [f64; 3], along: Vector3<f64>, length: f64) {
    let material = Material { youngs_modulus: 5.5e6, torsion_modulus: 2e6, density: 1000.0 };
    let own = assembly.rod(&RodSpec::new(shape::straight(from.into(), along, length, 10), 0.01, material));
    assembly.clamp_start(&own);
}

fn case(
    name: &'static str,
    mut assembly: Assembly,
    (shape, friction): (ObstacleShape, f64),
    way: Option<[Pair; 2]>,
    read: &[usize],
) -> Case {
    let surface = Surface { friction: Friction::new(friction), restitution: 0.0 };
    assembly.model_mut().contacts.obstacles.push(Obstacle::new(shape, surface));
    let (model, state) = assembly.finish();
    let steps = *read.last().unwrap();
    // With a velocity and an acceleration.
    let frame = |[velocity, acceleration]: &[Pair; 2], time: f64| {
        [0, 1].map(|k| velocity[k] * time + acceleration[k] * (0.5 * time * time))
    };
    let way = way.map_or(Vec::new(), |way| (0..=steps).map(|k| frame(&way, DT * k as f64)).collect());
    Case { name, model, state, way, read: read.to_vec(), iterations: 200 }
}

/// A table rises under a cantilever, and tilts.
fn table() -> Case {
    let mut assembly = assembly();
    rod(&mut assembly, [0.0, 0.0, 0.03], Vector3::x(), 0.5);
    let ground = ObstacleShape::HalfSpace { point: Vector3::new(0.4, 0.1, 0.0), normal: Vector3::z_axis() };
    let velocity = [Vector3::new(0.05, 0.2, 0.05), Vector3::new(0.1, -0.3, 0.2)];
    let acceleration = [Vector3::new(0.0, 0.0, 0.8), Vector3::zeros()];
    case("a table", assembly, (ground, 0.3), Some([velocity, acceleration]), &[8, 25, 40])
}

/// A post comes up under a rod, and turns about.
fn post(friction: f64) -> Case {
    let mut assembly = assembly();
    rod(&mut assembly, [0.0, 0.0, 0.0], Vector3::x(), 0.6);
    let [start, end] = [Vector3::new(0.33, -0.2, -0.04), Vector3::new(0.31, 0.2, -0.034)];
    let post = ObstacleShape::Capsule { start, end, radius: 0.02 };
    let velocity = [Vector3::new(0.1, 0.1, 0.2), Vector3::new(0.2, 1.0, 0.6)];
    let acceleration = [Vector3::new(0.3, 0.0, -0.5), Vector3::new(0.0, 2.0, 0.0)];
    let name = if friction > 0.0 { "a rough post" } else { "a smooth post" };
    case(name, assembly, (post, friction), Some([velocity, acceleration]), &[8, 20, 35])
}

/// A box pushes a rod aside with one of its edges.
fn pushing() -> Case {
    let mut assembly = assembly();
    rod(&mut assembly, [0.0, 0.0, 0.0], Vector3::x(), 0.6);
    let orientation = UnitQuaternion::from_euler_angles(0.1, 0.05, 0.7);
    let pose = Pose { position: Vector3::new(0.41, -0.088, 0.01), orientation };
    let pushes = ObstacleShape::Box { pose, sides: Vector3::new(0.1, 0.1, 0.3) };
    let velocity = [Vector3::new(0.05, 0.4, -0.1), Vector3::new(0.1, 0.0, 0.5)];
    let acceleration = [Vector3::new(0.0, 1.0, 0.0), Vector3::zeros()];
    case("a box", assembly, (pushes, 0.2), Some([velocity, acceleration]), &[8, 20, 30])
}

/// A ball that stands still, on which a rod falls.
fn ball() -> Case {
    let mut assembly = assembly();
    rod(&mut assembly, [0.0, 0.0, 0.0], Vector3::x(), 0.6);
    let ball = ObstacleShape::Sphere { centre: Vector3::new(0.33, 0.02, -0.075), radius: 0.06 };
    case("a ball", assembly, (ball, 0.3), None, &[8, 20, 30])
}

/// A box at the end of a rod meets a ball that comes up.
fn with_body() -> Case {
    let mut assembly = assembly();
    let material = Material { youngs_modulus: 5e6, torsion_modulus: 2e6, density: 1000.0 };
    let own = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 0.4, 6), 0.01, material));
    let (sides, place) = (Vector3::new(0.1, 0.12, 0.08), Vector3::new(-0.05, 0.0, 0.01));
    let pose = Pose { position: Vector3::new(0.45, 0.0, -0.01), orientation: UnitQuaternion::identity() };
    let body = assembly.body(RigidBody::new(BodyShape::Box { sides }, 0.05), pose);
    assembly.clamp_start(&own).join_body(own.end - 1, 1.0, body, &place);
    let ball = ObstacleShape::Sphere { centre: Vector3::new(0.46, 0.02, -0.115), radius: 0.06 };
    let velocity = [Vector3::new(0.05, 0.1, 0.2), Vector3::new(0.0, 0.3, 0.2)];
    let acceleration = [Vector3::new(0.0, 0.0, 0.8), Vector3::zeros()];
    case("a body on a ball", assembly, (ball, 0.3), Some([velocity, acceleration]), &[8, 20, 30])
}

/// The way of a variation at a frame.
fn at(poses: &[Pair], frame: usize) -> Pair {
    poses.get(frame).or(poses.last()).copied().unwrap_or([Vector3::zeros(); 2])
}

/// The model, with its obstacle moved along a variation.
fn moved(case: &Case, by: &Variation, share: f64) -> Model {
    let mut model = case.model.clone();
    for (joint, by) in model.joints.iter_mut().zip(&by.joints) {
        joint.bend_compliance += by.bend_compliance * share;
    }
    model.gravity += by.gravity * share;
    let own = &mut model.contacts.obstacles[0];
    own.surface.friction = Friction::new(own.surface.friction.sliding * (by.friction * share).exp());
    let poses = by.obstacles.first().map_or(&[][..], |own| &own.poses);
    let turned = |turn: Vector3<f64>| UnitQuaternion::from_scaled_axis(turn);
    let first = own.shape.pivot();
    let [shift, turn] = at(poses, 0).map(|x| x * share);
    own.shape = own.shape.placed(&Pose { position: first + shift, orientation: turned(turn) });
    if !case.way.is_empty() || poses.len() > 1 {
        let steps = *case.read.last().unwrap();
        let frame = |k: usize| {
            let ([way, turned_by], [by, turned_more]) = (at(&case.way, k), at(poses, k).map(|x| x * share));
            let orientation = turned(turned_more) * turned(turned_by) * turned(-turn);
            (DT * k as f64, Pose { position: first + way + by, orientation })
        };
        let frames: Vec<_> = (0..=steps).map(frame).collect();
        let motion = Motion::through(&frames, Interpolation::Linear).unwrap();
        own.motion = Some(Carried::new(Arc::new(motion)));
    }
    model
}

fn directions(case: &Case) -> Vec<(&'static str, Variation)> {
    let of = |parameter: Parameter| parameter.variation(&case.model);
    let along = |poses: Vec<Pair>| {
        let mut out = Variation::zero(&case.model);
        out.obstacles.push(ObstacleVariation { obstacle: 0, poses });
        out
    };
    let (steps, zero) = (*case.read.last().unwrap(), Vector3::zeros());
    let smooth = |k: usize, seed: usize, size: f64| {
        let phase = vector(seed);
        Vector3::from_fn(|axis, _| size * (0.3 * k as f64 + 3.0 * phase[axis]).sin())
    };
    vec![
        ("bending", of(Parameter::Bending(Rods::All))),
        ("gravity", of(Parameter::Gravity(2))),
        ("friction", of(Parameter::Friction)),
        ("the whole way", along(vec![[Vector3::new(0.01, -0.02, 0.03), Vector3::new(0.03, 0.04, -0.02)]])),
        ("shifts", along((0..=steps).map(|k| [smooth(k, 1, 0.01), zero]).collect())),
        ("turns", along((0..=steps).map(|k| [zero, smooth(k, 5, 0.05)]).collect())),
        ("until a frame", along((0..6).map(|k| [smooth(k, 8, 0.01), smooth(k, 9, 0.05)]).collect())),
    ]
}

fn run(case: &Case, integrator: Integrator, model: &Model, stretch: usize) -> (Recording, Vec<Seen>) {
    let settings = settings(integrator, case.iterations);
    let mut recording = Recording::with_checkpoints(model, &case.state, &settings, stretch).unwrap();
    let (mut pressing, mut forces, mut halved) = (0, Vec::new(), 0);
    let seen = read(&mut recording, (model, &case.state), (DT, &case.read), |recording, step, report| {
        let status = report.status;
        assert!(status <= Status::ConvergedInSubsteps, "{}: step {step}: {}", case.name, status.name());
        halved += usize::from(status == Status::ConvergedInSubsteps);
        recording.simulation().store_contact_forces(&mut forces);
        pressing += usize::from(!forces.is_empty());
    });
    assert!(pressing >= 4, "{}: it touches in {pressing} steps", case.name);
    assert_eq!(halved > 0, case.iterations < 200, "{}: {halved} steps are halved", case.name);
    (recording, seen)
}

fn check(case: &Case, integrator: Integrator) {
    let model = moved(case, &Variation::zero(&case.model), 0.0);
    let (mut recording, states) = run(case, integrator, &model, usize::MAX);
    let weights: Vec<(usize, StateVariation)> = case
        .read
        .iter()
        .map(|&step| {
            let mut of = StateVariation::with_forces(&model);
            for i in 0..model.segments.len() {
                of.positions[i] = vector(i + step);
                of.velocities[i] = vector(i + 3 * step) * DT;
            }
            for (j, own) in of.forces.iter_mut().enumerate() {
                *own = JointForce { force: vector(j + 5 * step) * 0.01, moment: vector(j + 7 * step) * 0.1 };
            }
            (step, of)
        })
        .collect();
    let gradient = recording.backward(&weights, Wanted::ALL).unwrap();
    assert_eq!(run(case, integrator, &model, 7).0.backward(&weights, Wanted::ALL).unwrap(), gradient, "{}", case.name);
    assert_eq!(gradient.obstacles[0].poses.len(), case.read.last().unwrap() + 1);
    let directions = directions(case);
    let variations: Vec<Variation> = directions.iter().map(|(_, variation)| variation.clone()).collect();
    let settings = settings(integrator, case.iterations);
    let mut forward = Forward::new(&model, &case.state, &settings, &variations).unwrap();
    let carried = carried(&mut forward, &model, DT, &weights);
    for (k, (what, variation)) in directions.iter().enumerate() {
        let what = format!("{}, {integrator:?}, {what}", case.name);
        let expected = of_second_order(STEP, |share| {
            let model = moved(case, variation, share);
            let (moved, seen) = run(case, integrator, &model, usize::MAX);
            // Where a step is halved in one of the runs alone there is no derivative.
            let parts = [&recording, &moved].map(|run| run.simulation().counters().steps);
            assert_eq!(parts[0], parts[1], "{what}: parts of steps");
            reading(&seen, &weights, &states)
        });
        assert_agree(&what, gradient.dot(variation), carried[k], expected);
    }
}

#[test]
fn derivatives_by_the_ways_of_obstacles_are_those_of_differences() {
    for case in [table(), post(0.0), post(0.4), pushing(), ball(), with_body()] {
        Integrator::ALL.into_iter().for_each(|integrator| check(&case, integrator));
    }
}

/// Within a step that is halved an obstacle is where its frames say in proportion.
#[test]
fn halved_steps_have_derivatives_by_the_ways_of_obstacles() {
    let mut case = Case { iterations: 3, ..post(0.4) };
    // Turns about several axes are not in proportion between two frames.
    case.way.iter_mut().for_each(|[_, turn]| *turn = Vector3::zeros());
    Integrator::ALL.into_iter().for_each(|integrator| check(&case, integrator));
}

/// What lies under a rod that is at rest bears it: its height is that of the table.
#[test]
fn a_rod_goes_with_the_table_that_bears_it() {
    let mut assembly = assembly();
    let material = Material { youngs_modulus: 5e6, torsion_modulus: 2e6, density: 1000.0 };
    assembly.rod(&RodSpec::new(shape::straight(Vector3::z() * 0.01, Vector3::x(), 0.3, 3), 0.01, material));
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    let case = case("a table that bears", assembly, (ground, 0.5), None, &[5]);
    let (mut recording, _) = run(&case, Integrator::Euler, &case.model, usize::MAX);
    let mut height = StateVariation::zero(3);
    height.positions[1].z = 1.0;
    let mut by = Variation::zero(&case.model);
    by.obstacles.push(ObstacleVariation { obstacle: 0, poses: vec![[Vector3::z(), Vector3::zeros()]] });
    let gradient = recording.backward(&[(5, height.clone())], Wanted::ALL).unwrap();
    assert!((gradient.dot(&by) - 1.0).abs() < 1e-8, "{}", gradient.dot(&by));
    let last = gradient.obstacles[0].poses[5][0].z;
    assert!((last - 1.0).abs() < 1e-6, "it is the last frame that counts: {last}");
    let wanted = Wanted { obstacles: false, ..Wanted::ALL };
    assert!(recording.backward(&[(5, height)], wanted).unwrap().obstacles.is_empty());
}

#[test]
fn what_has_no_derivative_is_refused() {
    let Case { model, state, .. } = table();
    let settings = settings(Integrator::Euler, 200);
    let mut by = Variation::zero(&model);
    by.obstacles.push(ObstacleVariation { obstacle: 1, poses: Vec::new() });
    let error = Forward::new(&model, &state, &settings, &[by]).err().unwrap();
    assert_eq!(error.to_string(), "derivatives know no obstacles that are not there");
    let mut bouncing = model.clone();
    bouncing.contacts.obstacles[0].surface.restitution = 0.5;
    let error = Recording::new(&bouncing, &state, &settings).err().unwrap();
    assert_eq!(error.to_string(), "derivatives know no contacts that bounce");
    let error = Equilibrium::new(&model, &state, &StaticParams::default()).err().unwrap();
    assert!(matches!(error, DerivativeError::Unknown("contacts of equilibria")));
}
