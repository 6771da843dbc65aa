//! Derivatives of whole runs against central differences.

#[path = "common/mod.rs"]
mod common;

use common::*;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rod::{Damping, Model, State};
use solver::derivative::{Forward, Parameter, Recording, Rods, StateVariation, Variation, Wanted};
use solver::formulation::Formulation;
use solver::integrator::Integrator;
use solver::linear::solvers::SolverKind;
use solver::simulation::Settings;
use solver::step::StepParams;

fn settings_of(integrator: Integrator) -> Settings {
    let step = StepParams {
        formulation: Formulation::Newton,
        integrator,
        relative_tolerance: 1e-13,
        absolute_tolerance: 1e-14,
        max_iterations: 60,
        ..StepParams::DEFAULT
    };
    Settings { step, solver: SolverKind::Direct }
}

/// A scene with how it is run.
struct Case {
    name: &'static str,
    model: Model,
    state: State,
    dt: f64,
    steps: usize,
}

fn case(name: &'static str, (model, mut state): (Model, State), dt: f64, steps: usize) -> Case {
    let rng = &mut ChaCha8Rng::seed_from_u64(3);
    for i in (0..model.segments.len()).filter(|&i| !model.segments[i].fixed) {
        state.velocities[i] += random(rng) * 0.3;
        state.angular_velocities[i] += random(rng) * 2.0;
    }
    Case { name, model, state, dt, steps }
}

fn random(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

/// A model and a state that are changed a little.
fn moved(case: &Case, by: &Variation, share: f64) -> (Model, State) {
    let (mut model, mut state) = (case.model.clone(), case.state.clone());
    for (joint, by) in model.joints.iter_mut().zip(&by.joints) {
        joint.rest_darboux += by.rest_darboux * share;
        joint.stretch_compliance += by.stretch_compliance * share;
        joint.shear_compliance += by.shear_compliance * share;
        joint.shear_extra += by.shear_extra * share;
        joint.bend_compliance += by.bend_compliance * share;
        joint.bend_extra += by.bend_extra * share;
        joint.twist_compliance += by.twist_compliance * share;
        joint.inner_damping.bending += by.inner_damping.bending * share;
        joint.inner_damping.twist += by.inner_damping.twist * share;
        joint.inner_damping.stretch += by.inner_damping.stretch * share;
    }
    for (segment, by) in model.segments.iter_mut().zip(&by.segments) {
        segment.density *= 1.0 + by.mass / segment.own_mass() * share;
    }
    for (load, [force, torque]) in model.loads.iter_mut().zip(&by.loads) {
        load.force += force * share;
        load.torque += torque * share;
    }
    model.gravity += by.gravity * share;
    model.damping.linear += by.damping[0] * share;
    model.damping.angular += by.damping[1] * share;
    for i in 0..state.positions.len() {
        state.positions[i] += by.start.positions[i] * share;
        state.orientations[i] =
            UnitQuaternion::from_scaled_axis(by.start.turns[i] * share) * state.orientations[i];
        state.velocities[i] += by.start.velocities[i] * share;
        state.angular_velocities[i] += by.start.angular_velocities[i] * share;
    }
    (model, state)
}

/// A covector of states, and what it says of one.
fn reading(state: &State, weights: &StateVariation, about: &State) -> f64 {
    let mut sum = 0.0;
    for i in 0..state.positions.len() {
        let turn = state.orientations[i] * about.orientations[i].inverse();
        sum += weights.positions[i].dot(&state.positions[i])
            + weights.turns[i].dot(&turn.scaled_axis())
            + weights.velocities[i].dot(&state.velocities[i])
            + weights.angular_velocities[i].dot(&state.angular_velocities[i]);
    }
    sum
}

/// The last state.
fn run(case: &Case, model: &Model, state: &State, settings: &Settings) -> State {
    let mut forward = Forward::new(model, state, settings, &[]).unwrap();
    for _ in 0..case.steps {
        forward.step(case.dt).unwrap();
    }
    let mut end = state.clone();
    forward.store(&mut end);
    end
}

/// What shifts a state by random numbers of the size of its own.
fn weights(segments: usize, seed: u64) -> StateVariation {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut out = StateVariation::zero(segments);
    for i in 0..segments {
        out.positions[i] = random(rng);
        out.turns[i] = random(rng) * 0.3;
        out.velocities[i] = random(rng) * 0.03;
        out.angular_velocities[i] = random(rng) * 0.01;
    }
    out
}

/// Derivatives along all directions against central differences, of fourth order.
fn check(case: &Case, settings: &Settings, directions: &[(&str, Variation)], tolerance: f64) {
    let variations: Vec<_> = directions.iter().map(|(_, variation)| variation.clone()).collect();
    let mut forward = Forward::new(&case.model, &case.state, settings, &variations).unwrap();
    for _ in 0..case.steps {
        forward.step(case.dt).unwrap();
    }
    let mut end = case.state.clone();
    forward.store(&mut end);
    let segments = case.model.segments.len();
    let weights = weights(segments, 17);
    for (k, (name, variation)) in directions.iter().enumerate() {
        let mut change = StateVariation::zero(segments);
        forward.store_change(k, &mut change);
        let found = change.dot(&weights);
        let h = 1e-4;
        let at = |share: f64| {
            let (model, state) = moved(case, variation, share);
            reading(&run(case, &model, &state, settings), &weights, &end)
        };
        let expected = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let error = (found - expected).abs() / expected.abs().max(1e-4);
        eprintln!("{} {} {name}: {found:e}, differences {expected:e}, off by {error:.1e}", case.name, settings.step.integrator);
        assert!(error < tolerance, "{} {name}: {found:e}, differences say {expected:e}", case.name);
    }
}

/// A random change of the first state.
fn of_start(case: &Case, of: impl Fn(&mut StateVariation, usize, [Vector3<f64>; 4])) -> Variation {
    let rng = &mut ChaCha8Rng::seed_from_u64(5);
    let mut out = Variation::zero(&case.model);
    for i in 0..case.model.segments.len() {
        let numbers = [(); 4].map(|()| random(rng));
        if !case.model.segments[i].fixed {
            of(&mut out.start, i, numbers);
        }
    }
    out
}

/// All directions that any scene has.
fn common(case: &Case) -> Vec<(&'static str, Variation)> {
    let of = |parameter: Parameter| parameter.variation(&case.model);
    vec![
        ("bending", of(Parameter::Bending(Rods::All))),
        ("torsion", of(Parameter::Torsion(Rods::All))),
        ("stretch", of(Parameter::Stretch(Rods::All))),
        ("density", of(Parameter::Density(Rods::All))),
        ("gravity", of(Parameter::Gravity(2))),
        ("linear damping", of(Parameter::LinearDamping)),
        ("angular damping", of(Parameter::AngularDamping)),
        ("second bending", of(Parameter::BendingAbout(1, Rods::All))),
        ("velocities", of_start(case, |start, i, [v, ..]| start.velocities[i] = v)),
        ("angular velocities", of_start(case, |start, i, [_, w, ..]| start.angular_velocities[i] = w)),
        ("positions", of_start(case, |start, i, [.., x, _]| start.positions[i] = x * 1e-2)),
        ("orientations", of_start(case, |start, i, [.., q]| start.turns[i] = q * 1e-2)),
    ]
}

fn cases() -> Vec<Case> {
    let soft = |length, segments| {
        let (mut model, state) = rod(length, segments, 0.01, material(1e7, 1000.0));
        model.damping = Damping { linear: 0.3, angular: 0.2 };
        (model, state)
    };
    vec![
        case("chain", soft(1.0, 8), 0.01, 12),
        case("helix", helix(16), 0.01, 10),
        case("tree", tree(), 0.005, 10),
        case("ring", ring(), 0.01, 10),
    ]
}

/// The adjoint's gradient against forward sensitivities: the same number twice.
fn check_adjoint(case: &Case, settings: &Settings, directions: &[(&str, Variation)]) {
    let variations: Vec<_> = directions.iter().map(|(_, variation)| variation.clone()).collect();
    let mut forward = Forward::new(&case.model, &case.state, settings, &variations).unwrap();
    let mut recording = Recording::new(&case.model, &case.state, settings).unwrap();
    let segments = case.model.segments.len();
    let mut sums = vec![[0.0; 2]; directions.len()];
    let mut objective = Vec::new();
    for step in 1..=case.steps {
        forward.step(case.dt).unwrap();
        recording.step(case.dt).unwrap();
        if step % 4 != 0 && step != case.steps {
            continue;
        }
        let weights = weights(segments, step as u64);
        for (k, [sum, size]) in sums.iter_mut().enumerate() {
            let mut change = StateVariation::zero(segments);
            forward.store_change(k, &mut change);
            let part = change.dot(&weights);
            *sum += part;
            *size += part.abs();
        }
        objective.push((step, weights));
    }
    let gradient = recording.backward(&objective, Wanted::ALL).unwrap();
    for ((name, variation), [sum, size]) in directions.iter().zip(sums) {
        let found = gradient.dot(variation);
        let error = (found - sum).abs() / size.max(1e-6);
        eprintln!("{} {} {name}: adjoint {found:e}, forward {sum:e}, off by {error:.1e}", case.name, settings.step.integrator);
        assert!(error < 1e-9, "{} {name}: adjoint {found:e}, forward {sum:e}", case.name);
    }
}

#[test]
fn the_adjoint_says_the_same_as_forward_sensitivities() {
    for case in cases() {
        for integrator in Integrator::ALL {
            check_adjoint(&case, &settings_of(integrator), &common(&case));
        }
    }
}

#[test]
fn forward_sensitivities_are_derivatives() {
    for case in cases() {
        for integrator in Integrator::ALL {
            check(&case, &settings_of(integrator), &common(&case), 1e-6);
        }
    }
}
