//! Gradients of runs in which rods touch, away from where contacts change, against central differences of runs.

use cosserat::derivative::{Forward, Parameter, Recording, Rods, StateVariation, Variation, Wanted};
use cosserat::prelude::*;

use super::common::{Seen, assert_agree, carried, moved, of_second_order, read, reading, settings, vector};

const DT: f64 = 5e-3;
/// Share of a variation by which central differences go to either side.
const STEP: f64 = 5e-4;

struct Case {
    name: &'static str,
    model: Model,
    state: State,
    /// After which steps the motion is read.
    read: Vec<usize>,
}

fn material() -> Material {
    Material { youngs_modulus: 5e6, torsion_modulus: 2e6, density: 1000.0 }
}

fn surface(friction: f64) -> Surface {
    Surface { friction: Friction::new(friction), restitution: 0.0 }
}

/// A straight rod of ten segments and radius .01 m.
fn rod(assembly: &mut Assembly, from: [f64; 3], along: Vector3<f64>, length: f64) -> std::ops::Range<usize> {
    assembly.rod(&RodSpec::new(shape::straight(from.into(), along, length, 10), 0.01, material()))
}

fn assembly() -> Assembly {
    Assembly::new(Vector3::new(0.0, 0.0, -9.81))
}

fn case(name: &'static str, assembly: Assembly, read: &[usize]) -> Case {
    let (model, state) = assembly.finish();
    Case { name, model, state, read: read.to_vec() }
}

fn on_obstacle(assembly: &mut Assembly, shape: ObstacleShape, friction: f64) {
    assembly.model_mut().contacts.obstacles.push(Obstacle { shape, surface: surface(friction), motion: None });
}

/// A cantilever falls, and its tip comes to slide over the ground.
fn tip_on_ground() -> Case {
    let mut assembly = assembly();
    let own = rod(&mut assembly, [0.0, 0.0, 0.032], Vector3::x(), 0.5);
    assembly.clamp_start(&own);
    let (segment, force) = (own.end - 2, Vector3::new(0.05, 0.03, -0.02));
    let load = Load { segment, offset: 0.0, force, torque: Vector3::zeros(), follows: false };
    assembly.model_mut().loads.push(load);
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    on_obstacle(&mut assembly, ground, 0.3);
    case("a tip on the ground", assembly, &[6, 25, 40])
}

/// A rod that is held at one end falls over a post, and slides along it.
fn over_a_post(friction: f64) -> Case {
    let mut assembly = assembly();
    let own = rod(&mut assembly, [0.0, 0.0, 0.0], Vector3::x(), 0.6);
    assembly.clamp_start(&own);
    let [start, end] = [Vector3::new(0.33, -0.2, -0.036), Vector3::new(0.31, 0.2, -0.03)];
    on_obstacle(&mut assembly, ObstacleShape::Capsule { start, end, radius: 0.02 }, friction);
    let name = if friction > 0.0 { "over a rough post" } else { "over a smooth post" };
    case(name, assembly, &[8, 20, 35])
}

/// A rod falls across another one; both are held at one end.
fn across(friction: f64) -> Case {
    let mut assembly = assembly();
    let first = rod(&mut assembly, [0.0, 0.0, 0.0], Vector3::x(), 0.5);
    let second = rod(&mut assembly, [0.33, -0.22, 0.026], Vector3::new(0.1, 1.0, 0.0).normalize(), 0.5);
    assembly.clamp_start(&first).clamp_end(&first);
    assembly.clamp_start(&second);
    let state = assembly.state_mut();
    second.clone().for_each(|i| state.velocities[i].z -= 0.4);
    assembly.model_mut().contacts.between_segments = Some(surface(friction));
    let name = if friction > 0.5 { "across each other, rough" } else { "across each other, smooth" };
    case(name, assembly, &[6, 12, 20])
}

/// A rod that falls onto fixed segments, of which the run's start says where they are.
fn onto_a_fixed_bar() -> Case {
    let mut assembly = assembly();
    let own = rod(&mut assembly, [0.0, 0.0, 0.03], Vector3::x(), 0.5);
    let bar = rod(&mut assembly, [0.37, -0.46, 0.0], Vector3::y(), 1.0);
    assembly.clamp_start(&own);
    let model = assembly.model_mut();
    bar.for_each(|i| model.segments[i].fixed = true);
    model.contacts.between_segments = Some(surface(0.2));
    case("onto a fixed bar", assembly, &[10, 30])
}

/// A rod slides over the ground with all of its segments.
fn sliding() -> Case {
    let mut assembly = assembly();
    let own = rod(&mut assembly, [0.0, 0.0, 0.0101], Vector3::x(), 0.4);
    let state = assembly.state_mut();
    own.for_each(|i| state.velocities[i] = Vector3::new(0.4, 0.9, 0.0));
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    on_obstacle(&mut assembly, ground, 0.3);
    case("sliding over the ground", assembly, &[6, 12])
}

fn directions(model: &Model) -> Vec<(&'static str, Variation)> {
    let of = |parameter: Parameter| parameter.variation(model);
    let mut out = vec![
        ("bending", of(Parameter::Bending(Rods::All))),
        ("density", of(Parameter::Density(Rods::All))),
        ("gravity", of(Parameter::Gravity(2))),
        ("friction", of(Parameter::Friction)),
    ];
    let mut rest = Variation::zero(model);
    rest.joints.iter_mut().enumerate().for_each(|(j, joint)| joint.rest_darboux = vector(j) * 0.1);
    let (mut velocities, mut places) = (Variation::zero(model), Variation::zero(model));
    for i in 0..model.segments.len() {
        if model.segments[i].fixed {
            places.start.positions[i] = Vector3::new(0.02, 0.01, 0.05);
            continue;
        }
        velocities.start.velocities[i] = vector(i + 20) * 0.1;
        places.start.positions[i] = vector(i + 40) * 1e-4;
        places.start.turns[i] = vector(i + 50) * 1e-3;
    }
    let mut loads = Variation::zero(model);
    loads.loads.iter_mut().for_each(|load| load[0] = Vector3::new(0.02, -0.01, 0.03));
    out.push(("loads", loads));
    out.extend([("rest shape", rest), ("velocities", velocities), ("places", places)]);
    out
}

/// A run, with a checkpoint every so many steps, and its states where it is read.
fn run(
    case: &Case,
    integrator: Integrator,
    variation: Option<(&Variation, f64)>,
    stretch: usize,
) -> (Recording, Vec<Seen>) {
    let (mut model, state) = match variation {
        Some((variation, share)) => moved(&case.model, &case.state, variation, share),
        None => (case.model.clone(), case.state.clone()),
    };
    let factor = variation.map_or(1.0, |(variation, share)| (variation.friction * share).exp());
    let contacts = &mut model.contacts;
    let surfaces =
        contacts.between_segments.iter_mut().chain(contacts.obstacles.iter_mut().map(|own| &mut own.surface));
    for surface in surfaces {
        surface.friction = Friction::new(surface.friction.sliding * factor);
    }
    let mut recording = Recording::with_checkpoints(&model, &state, &settings(integrator, 200), stretch).unwrap();
    let seen = read(&mut recording, (&model, &state), (DT, &case.read), |_, step, report| {
        let status = report.status;
        assert!(status <= Status::ConvergedInSubsteps, "{}: step {step}: {}", case.name, status.name());
    });
    (recording, seen)
}

fn check(case: &Case, integrator: Integrator) {
    let (mut recording, states) = run(case, integrator, None, usize::MAX);
    let mut forces = Vec::new();
    recording.simulation().store_contact_forces(&mut forces);
    assert!(!forces.is_empty(), "{}: nothing touches", case.name);
    let count = case.model.segments.len();
    let weights: Vec<(usize, StateVariation)> = case
        .read
        .iter()
        .map(|&step| {
            let mut of = StateVariation::with_forces(&case.model);
            // What joints of two fixed segments transmit, as stiff as they are, would drown all else.
            let is_fixed = |body| matches!(body, Body::Segment(i) if case.model.segments[i].fixed);
            let joints = of.forces.iter_mut().zip(&case.model.joints).enumerate();
            for (j, (own, _)) in joints.filter(|(_, (_, joint))| !(is_fixed(joint.a) && is_fixed(joint.b))) {
                *own = JointForce { force: vector(j + 5 * step) * 0.01, moment: vector(j + 7 * step) * 0.1 };
            }
            for i in 0..count {
                of.positions[i] = vector(i + step);
                of.velocities[i] = vector(i + 3 * step) * DT;
            }
            (step, of)
        })
        .collect();
    let gradient = recording.backward(&weights, Wanted::ALL).unwrap();
    assert_eq!(run(case, integrator, None, 7).0.backward(&weights, Wanted::ALL).unwrap(), gradient, "{}", case.name);
    let directions = directions(&case.model);
    let variations: Vec<Variation> = directions.iter().map(|(_, variation)| variation.clone()).collect();
    let mut forward = Forward::new(&case.model, &case.state, &settings(integrator, 200), &variations).unwrap();
    let carried = carried(&mut forward, &case.model, DT, &weights);
    for ((what, variation), carried) in directions.iter().zip(carried) {
        let expected = of_second_order(STEP, |share| {
            reading(&run(case, integrator, Some((variation, share)), usize::MAX).1, &weights, &states)
        });
        let what = format!("{}, {integrator:?}, {what}", case.name);
        assert_agree(&what, gradient.dot(variation), carried, expected);
    }
}

#[test]
fn gradients_through_contacts_are_those_of_differences() {
    let posts = [over_a_post(0.0), over_a_post(0.4)];
    let others = [tip_on_ground(), across(0.9), across(0.1), onto_a_fixed_bar(), sliding()];
    for case in posts.iter().chain(&others) {
        Integrator::ALL.into_iter().for_each(|integrator| check(case, integrator));
    }
}
