//! Derivatives of whole runs against central differences.

use std::sync::Arc;

use dynamics::formulation::Formulation;
use dynamics::simulation::Settings;
use dynamics::step::{Status, StepParams};
use jointed::linear::solvers::SolverKind;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rod::Integrator;
use rod::{
    Air, Assembly, Body, Change, Changing, Damping, Driven, InnerDamping, Interpolation, Keyframe, Load, Model, Motion,
    RodSpec, Section, State, Track, Wind, shape,
};
use sensitivity::{Forward, HeldVariation, Parameter, Recording, Rods, StateVariation, Variation, Wanted};

use crate::common::*;

fn settings_of(integrator: Integrator) -> Settings {
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
        let factor = 1.0 + by.mass / segment.own_mass() * share;
        segment.density *= factor;
        if let Some(inertia) = &mut segment.line_inertia {
            inertia.mass *= factor;
            inertia.polar *= factor;
        }
    }
    for (load, [force, torque]) in model.loads.iter_mut().zip(&by.loads) {
        load.force += force * share;
        load.torque += torque * share;
    }
    // Of all times: the course of a rest is shifted as a whole.
    for change in &mut model.changes {
        if let Changing::Rest(joint) = change.of {
            let of = |time| (time, change.track.at(time) + by.joints[joint].rest_darboux * share);
            let values: Vec<_> = change.track.times().map(of).collect();
            change.track = Arc::new(Track::new(&values, Interpolation::Linear).unwrap());
        }
    }
    if let Some(held) = by.held.first() {
        let shifts: Vec<_> = held.poses.iter().map(|[shift, _]| shift * share).collect();
        model.motions = vec![motion(&case.model, &shifts)];
    }
    if let Some(air) = &mut model.air {
        air.density += by.air.density * share;
        air.normal_drag += by.air.normal_drag * share;
        air.tangential_drag += by.air.tangential_drag * share;
        air.wind = Wind::steady(air.wind.velocity(&Vector3::zeros(), 0.0) + by.air.wind * share);
    }
    model.gravity += by.gravity * share;
    model.damping.linear += by.damping[0] * share;
    model.damping.angular += by.damping[1] * share;
    for i in 0..state.positions.len() {
        state.positions[i] += by.start.positions[i] * share;
        state.orientations[i] = UnitQuaternion::from_scaled_axis(by.start.turns[i] * share) * state.orientations[i];
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
        let h = 1e-3;
        let at = |share: f64| {
            let (model, state) = moved(case, variation, share);
            reading(&run(case, &model, &state, settings), &weights, &end)
        };
        let expected = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
        let error = (found - expected).abs() / expected.abs().max(1e-4);
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
fn directions(case: &Case) -> Vec<(&'static str, Variation)> {
    let of = |parameter: Parameter| parameter.variation(&case.model);
    let rng = &mut ChaCha8Rng::seed_from_u64(11);
    let mut out = vec![
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
    ];
    match case.name {
        "muscle" => {
            let mut shift = Variation::zero(&case.model);
            shift.joints.iter_mut().for_each(|joint| joint.rest_darboux = Vector3::new(0.3, -0.2, 0.1));
            out.push(("rest over time", shift));
        }
        "inner damping" => out.extend(
            [
                ("inner bending", of(Parameter::InnerBending(Rods::All))),
                ("inner twist", of(Parameter::InnerTwist(Rods::One(0)))),
                ("inner stretch", of(Parameter::InnerStretch(Rods::All))),
            ]
            .map(|(name, variation)| (name, scaled(variation, 0.1))),
        ),
        "air" => out.extend([
            ("air density", of(Parameter::AirDensity)),
            ("normal drag", of(Parameter::NormalDrag)),
            ("tangential drag", of(Parameter::TangentialDrag)),
            ("wind", of(Parameter::Wind(1))),
        ]),
        "load" => {
            let mut variation = Variation::zero(&case.model);
            variation.loads.iter_mut().for_each(|load| *load = [random(rng), random(rng) * 0.1]);
            out.push(("loads", variation));
        }
        "driven" => {
            let mut variation = Variation::zero(&case.model);
            let poses = (0..case.steps).map(|_| [random(rng) * 0.01, Vector3::zeros()]).collect();
            variation.held.push(HeldVariation { body: Body::Anchor(1), poses });
            out.push(("grip", variation));
        }
        "flat section" => {
            let mut variation = Variation::zero(&case.model);
            variation.joints.iter_mut().for_each(|joint| joint.rest_darboux = random(rng));
            out.push(("rest shape", variation));
        }
        _ => {}
    }
    out
}

fn scaled(mut variation: Variation, by: f64) -> Variation {
    for joint in &mut variation.joints {
        let InnerDamping { bending, twist, stretch } = joint.inner_damping;
        joint.inner_damping = InnerDamping { bending: bending * by, twist: twist * by, stretch: stretch * by };
    }
    variation
}

/// One of each scene; all are damped a little, so that rates can be changed both ways.
fn cases() -> Vec<Case> {
    let soft = rod(1.0, 8, 0.01, material(1e7, 1000.0));
    let mut cases = vec![
        case("chain", soft.clone(), 0.01, 12),
        case("helix", helix(16), 0.01, 10),
        case("tree", tree(), 0.005, 10),
        case("ring", ring(), 0.01, 10),
        case("inner damping", soft.clone(), 0.01, 10),
        case("load", soft.clone(), 0.01, 10),
        case("air", soft.clone(), 0.01, 10),
        case("muscle", soft, 0.01, 10),
        case("flat section", flat(), 0.01, 10),
        case("driven", driven(), 0.01, 10),
    ];
    for case in &mut cases {
        case.model.damping = Damping { linear: 0.3, angular: 0.2 };
        match case.name {
            "inner damping" => {
                let inner_damping = InnerDamping { bending: 0.02, twist: 0.03, stretch: 0.01 };
                case.model.joints.iter_mut().for_each(|joint| joint.inner_damping = inner_damping);
            }
            "load" => {
                for (segment, force) in [(7, 0.4), (4, -0.2), (7, 0.1)] {
                    let (force, torque) = (Vector3::new(0.1, force, 0.2), Vector3::new(0.01, 0.0, -0.02));
                    case.model.loads.push(Load { segment, offset: 0.03, force, torque, follows: false });
                }
            }
            "muscle" => {
                let inner_damping = InnerDamping { bending: 0.02, twist: 0.03, stretch: 0.01 };
                case.model.joints.iter_mut().for_each(|joint| joint.inner_damping = inner_damping);
                let values = [(0.0, Vector3::zeros()), (0.1, Vector3::new(1.0, 2.0, -1.0))];
                let track = Arc::new(Track::new(&values, Interpolation::Linear).unwrap());
                let change = |joint| Change { of: Changing::Rest(joint), track: track.clone() };
                case.model.changes = (0..case.model.joints.len()).map(change).collect();
            }
            "air" => {
                let wind = Wind::steady(Vector3::new(1.0, 3.0, 0.5));
                case.model.air = Some(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
            }
            _ => {}
        }
    }
    cases
}

/// A strip that is wider than high, curved at rest.
fn flat() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::helix(Vector3::zeros(), 0.3, 0.4, 1.0, 10);
    let section = Section::Rectangle { width: 0.04, height: 0.01 };
    let rod = assembly.rod(&RodSpec { sections: vec![section], ..RodSpec::new(nodes, 0.01, material(1e7, 900.0)) });
    assembly.clamp_start(&rod);
    assembly.finish()
}

/// A rod between two grips, one of which moves.
fn driven() -> (Model, State) {
    let (mut model, state) = helix(10);
    model.motions.push(motion(&model, &[]));
    (model, state)
}

/// The motion of its second grip, with shifts beyond it at the ends of steps of 0.01 s.
fn motion(model: &Model, shifts: &[Vector3<f64>]) -> Driven {
    let pose = model.anchors[1];
    let keys: Vec<_> = (0..=10)
        .map(|step| {
            let share = step as f64 * 0.1;
            let shift = if step > 0 { shifts.get(step - 1).copied().unwrap_or_default() } else { Vector3::zeros() };
            let turn = if step > 0 { Vector3::new(0.02, -0.01, 0.03) } else { Vector3::zeros() };
            let way = Vector3::new(0.03, -0.02, 0.04) * share * share;
            Keyframe { time: 0.01 * step as f64, position: pose.position + way + shift, turn }
        })
        .collect();
    let motion = Motion::new(pose.orientation, &keys, Interpolation::Linear).unwrap();
    Driven::new(Body::Anchor(1), Arc::new(motion))
}

/// The adjoint's gradient against forward sensitivities: the same number twice.
fn check_adjoint(case: &Case, settings: &Settings, directions: &[(&str, Variation)]) {
    let mut directions = directions.to_vec();
    if case.name == "driven" {
        let turns = (0..case.steps).map(|step| [Vector3::x(), Vector3::y() * step as f64]).collect();
        let mut variation = Variation::zero(&case.model);
        variation.held.push(HeldVariation { body: Body::Anchor(1), poses: turns });
        directions.push(("grip that turns", variation));
    }
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
        assert!(error < 1e-9, "{} {name}: adjoint {found:e}, forward {sum:e}", case.name);
    }
}

#[test]
fn the_adjoint_says_the_same_as_forward_sensitivities() {
    for case in cases() {
        for integrator in Integrator::ALL {
            check_adjoint(&case, &settings_of(integrator), &directions(&case));
        }
    }
}

#[test]
fn forward_sensitivities_are_derivatives() {
    for case in cases() {
        for integrator in Integrator::ALL {
            check(&case, &settings_of(integrator), &directions(&case), 1e-6);
        }
    }
}

/// The error of a run that is refused.
fn refused(model: &Model, state: &State, settings: &Settings) -> String {
    let error = Forward::new(model, state, settings, &[]).err().map(|error| error.to_string());
    let of_recording = Recording::new(model, state, settings).err().map(|error| error.to_string());
    assert_eq!(error, of_recording);
    error.unwrap_or_default()
}

#[test]
fn what_has_no_derivative_is_refused() {
    let exact = settings_of(Integrator::Euler);
    let (model, state) = helix(8);
    let step = StepParams { formulation: Formulation::Xpbd, ..exact.step };
    assert!(refused(&model, &state, &Settings { step, ..exact }).contains("formulation newton"));
    let mut touching = model.clone();
    touching.contacts.between_segments = Some(rod::Surface::default());
    touching.contacts.allow_overlap = true;
    assert!(refused(&touching, &state, &exact).contains("overlaps at the start"));
    touching.contacts.between_segments = Some(rod::Surface { restitution: 0.5, ..rod::Surface::default() });
    assert!(refused(&touching, &state, &exact).contains("contacts that bounce"));
    let mut timed = model.clone();
    timed.motions.push(motion(&model, &[]).between(0.05, 0.1));
    assert!(refused(&timed, &state, &exact).contains("take hold or let go"));

    let step = StepParams { max_iterations: 1, max_halvings: 0, ..exact.step };
    let mut recording = Recording::new(&model, &state, &Settings { step, ..exact }).unwrap();
    let error = recording.step(0.02).unwrap_err().to_string();
    assert_eq!(error, "step 1 has no derivative: out of iterations");

    let other = Variation::zero(&helix(9).0);
    let error = Forward::new(&model, &state, &exact, &[other]).err().unwrap().to_string();
    assert_eq!(error, "a variation with 10 joints, but there are 9");
    let mut recording = Recording::new(&model, &state, &exact).unwrap();
    assert!(recording.backward(&[(1, StateVariation::zero(8))], Wanted::ALL).is_err(), "no step has been taken");
}

/// Steps that were halved are gone through in their parts.
#[test]
fn halved_steps_have_derivatives() {
    let (model, state) = rod(1.0, 8, 0.01, material(1e7, 1000.0));
    let mut case = case("halved", (model, state), 0.08, 3);
    for (i, w) in case.state.angular_velocities.iter_mut().enumerate().skip(1) {
        *w = Vector3::new(0.0, 10.0 + i as f64, 0.0);
    }
    let exact = settings_of(Integrator::Bdf2);
    let settings = Settings { step: StepParams { max_iterations: 3, ..exact.step }, ..exact };
    let mut forward = Forward::new(&case.model, &case.state, &settings, &[]).unwrap();
    let halved = (0..case.steps).any(|_| forward.step(case.dt).unwrap().status == Status::ConvergedInSubsteps);
    assert!(halved);
    let of = |parameter: Parameter| parameter.variation(&case.model);
    let directions = [("bending", of(Parameter::Bending(Rods::All))), ("gravity", of(Parameter::Gravity(2)))];
    check(&case, &settings, &directions, 1e-6);
    check_adjoint(&case, &settings, &directions);
}
