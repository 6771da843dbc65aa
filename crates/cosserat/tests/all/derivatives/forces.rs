//! Derivatives of what joints transmit, in runs and in equilibria, against central differences.

use cosserat::derivative::{
    DerivativeError, Equilibrium, Forward, HeldVariation, Parameter, Recording, Rods, StateVariation, Variation, Wanted,
};
use cosserat::prelude::*;

use super::common::{Seen, carried, moved, of_fourth_order, parts, read, reading, settings, vector};

const STEPS: usize = 6;
/// After which steps forces are read.
const READ: [usize; 3] = [1, 4, STEPS];

struct Case {
    name: &'static str,
    model: Model,
    state: State,
    dt: f64,
    /// Share of a variation by which differences go to either side.
    step: f64,
}

fn material() -> Material {
    Material { youngs_modulus: 5e6, torsion_modulus: 2e6, density: 1000.0 }
}

/// A case that turns as a whole about its first segment.
fn turning(name: &'static str, (model, mut state): (Model, State), dt: f64) -> Case {
    let rate = Vector3::new(0.3, 0.2, -0.4);
    for i in (0..model.segments.len()).filter(|&i| !model.segments[i].fixed) {
        state.velocities[i] += rate.cross(&(state.positions[i] - state.positions[0])) + vector(i + 90) * 0.1;
        state.angular_velocities[i] += rate + vector(i + 80);
    }
    Case { name, model, state, dt, step: 2e-3 }
}

fn coil(assembly: &mut Assembly) -> std::ops::Range<usize> {
    assembly.rod(&RodSpec::new(shape::helix(Vector3::zeros(), 0.3, 0.4, 1.0, 8), 0.02, material()))
}

/// A coil between two grips.
fn clamped() -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let own = coil(&mut assembly);
    assembly.clamp_start(&own).clamp_end(&own);
    assembly.finish()
}

/// The same with a hinge in the place of one grip, damped inside.
fn hinged() -> (Model, State) {
    let (mut model, state) = clamped();
    let ends: Vec<usize> = (0..model.joints.len())
        .filter(|&j| [model.joints[j].a, model.joints[j].b].iter().any(|body| matches!(body, Body::Anchor(_))))
        .collect();
    model.hinge(ends[0], &Vector3::new(0.3, 1.0, 0.2));
    for joint in &mut model.joints {
        joint.inner_damping = InnerDamping { bending: 0.01, twist: 0.02, stretch: 0.005 };
    }
    (model, state)
}

/// A coil that is wider than high, with a ball joint within, on which a force acts.
fn flat() -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let nodes = shape::helix(Vector3::zeros(), 0.3, 0.4, 1.0, 8);
    let section = Section::Rectangle { width: 0.04, height: 0.015 };
    let own = assembly.rod(&RodSpec { sections: vec![section], ..RodSpec::new(nodes, 0.01, material()) });
    assembly.fix(own.start);
    let (mut model, state) = assembly.finish();
    model.pin(5);
    let force = Vector3::new(0.3, 0.2, -0.1);
    model.loads.push(Load { segment: 7, offset: 0.02, force, torque: Vector3::new(0.01, 0.0, -0.02), follows: false });
    (model, state)
}

/// A coil with a box at its end.
fn with_body() -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let nodes = shape::helix(Vector3::zeros(), 0.3, 0.4, 1.0, 8);
    let end = nodes[8];
    let own = assembly.rod(&RodSpec::new(nodes, 0.02, material()));
    let (sides, place) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.05, 0.1, -0.15));
    let orientation = UnitQuaternion::from_euler_angles(0.2, -0.3, 0.5);
    let pose = Pose { position: end - orientation * place, orientation };
    let body = assembly.body(RigidBody::new(BodyShape::Box { sides }, 0.5), pose);
    assembly.clamp_start(&own).join_body(own.end - 1, 1.0, body, &place);
    assembly.finish()
}

fn scene_of(name: &'static str) -> Case {
    let Scene { model, state, run, .. } = scene::builtin(name).unwrap();
    turning(name, (model, state), run.dt.min(2e-3))
}

/// Directions of all kinds.
fn directions(model: &Model) -> Vec<(&'static str, Variation)> {
    let of = |parameter: Parameter| parameter.variation(model);
    let mut stretch = of(Parameter::Stretch(Rods::All));
    stretch.joints.iter_mut().for_each(|joint| joint.stretch_compliance *= 100.0);
    let mut out = vec![
        ("bending", of(Parameter::Bending(Rods::All))),
        ("torsion", of(Parameter::Torsion(Rods::All))),
        ("stretch", stretch),
        ("gravity", of(Parameter::Gravity(2))),
    ];
    out.push(("density", of(Parameter::Density(Rods::All))));
    if let Some(i) = model.segments.iter().position(|segment| segment.body.is_some()) {
        let [mut heavier, mut wider] = [Variation::zero(model), Variation::zero(model)];
        heavier.segments[i].mass = 0.3;
        wider.segments[i].inertia = Vector3::new(1e-3, -5e-4, 8e-4);
        out.extend([("mass of a body", heavier), ("inertia of a body", wider)]);
    }
    let mut rest = Variation::zero(model);
    rest.joints.iter_mut().enumerate().for_each(|(j, joint)| joint.rest_darboux = vector(j) * 0.1);
    let (mut velocities, mut places) = (Variation::zero(model), Variation::zero(model));
    let free = |i: &usize| !model.segments[*i].fixed;
    for i in (0..model.segments.len()).filter(free) {
        velocities.start.velocities[i] = vector(i + 20) * 0.1;
        velocities.start.angular_velocities[i] = vector(i + 30) * 0.1;
        places.start.positions[i] = vector(i + 40) * 1e-2;
        places.start.turns[i] = vector(i + 50) * 1e-1;
    }
    out.extend([("rest shape", rest), ("velocities", velocities), ("places", places)]);
    // Grips are shifted from the start on, which inner damping remembers.
    let remembers = model.joints.iter().any(|joint| joint.inner_damping != InnerDamping::NONE);
    if model.motions.is_empty() && !remembers {
        let held = (0..model.segments.len()).filter(|i| !free(i)).map(Body::Segment);
        for (k, body) in held.chain((0..model.anchors.len()).map(Body::Anchor)).enumerate() {
            let mut grip = Variation::zero(model);
            grip.held.push(HeldVariation { body, poses: vec![[vector(60 + k) * 1e-4, vector(70 + k) * 1e-3]; STEPS] });
            out.push(("grip", grip));
        }
    }
    if !model.loads.is_empty() {
        let mut loads = Variation::zero(model);
        loads.loads.iter_mut().enumerate().for_each(|(i, load)| *load = [vector(i), vector(i + 9) * 0.1]);
        out.push(("loads", loads));
    }
    out
}

/// Weights of forces and moments, and a few of poses beside them.
fn weights(model: &Model, seed: usize) -> StateVariation {
    let mut out = StateVariation::with_forces(model);
    let long = model.joints[0].length;
    for (j, own) in out.forces.iter_mut().enumerate() {
        *own = JointForce { force: vector(j + seed) * long, moment: vector(j + 7 + seed) };
    }
    out.positions[1] = vector(seed);
    out
}

fn run(case: &Case, (model, state): (&Model, &State), settings: &Settings) -> (Recording, Vec<Seen>) {
    let mut recording = Recording::new(model, state, settings).unwrap();
    let seen = read(&mut recording, (model, state), (case.dt, &READ), |_, step, report| {
        assert_eq!(report.status, Status::Converged, "{}: step {step}", case.name);
    });
    (recording, seen)
}

/// Of the sum that differences are taken of.
fn size(of: &[Seen], weights: &[(usize, StateVariation)]) -> f64 {
    let all = of.iter().zip(weights).flat_map(|((_, forces), (_, weights))| forces.iter().zip(&weights.forces));
    let squared = |x: &Vector3<f64>, y: &Vector3<f64>| x.norm_squared() * y.norm_squared();
    all.map(|(x, w)| squared(&x.force, &w.force) + squared(&x.moment, &w.moment)).sum::<f64>().sqrt()
}

fn check(case: &Case, integrator: Integrator) {
    let (settings, Case { name, model, state, .. }) = (settings(integrator, 60), case);
    let (mut recording, about) = run(case, (model, state), &settings);
    let last = model.segments.len() - 1;
    let weights = READ.map(|step| {
        let mut of = weights(model, step);
        (of.velocities[last], of.angular_velocities[last]) = (vector(step + 3) * case.dt, vector(step + 5) * case.dt);
        (step, of)
    });
    let gradient = recording.backward(&weights, Wanted::ALL).unwrap();
    let directions = directions(model);
    let variations: Vec<Variation> = directions.iter().map(|(_, variation)| variation.clone()).collect();
    let mut forward = Forward::new(model, state, &settings, &variations).unwrap();
    let forward = carried(&mut forward, model, case.dt, &weights);
    // Of a difference, as far as steps are solved.
    let noise = 3e-12 * size(&about, &weights) / case.step;
    let mut seen = 0;
    for (k, (what, variation)) in directions.iter().enumerate() {
        let found = gradient.dot(variation);
        let expected = of_fourth_order(case.step, |share| {
            let (model, state) = moved(model, state, variation, share);
            reading(&run(case, (&model, &state), &settings).1, &weights, &about)
        });
        seen += usize::from(expected.abs() > 1e6 * noise);
        println!("{name} {integrator:?}, {what}: {found:e} {expected:e} {noise:.1e}");
        assert!(
            (found - expected).abs() <= 1e-6 * expected.abs() + noise,
            "{name} {integrator:?}, {what}: {found:e}, differences say {expected:e}"
        );
        let [sum, size] = forward[k];
        assert!((found - sum).abs() <= 1e-8 * size, "{name} {integrator:?}, {what}: {found:e}, forward {sum:e}");
    }
    assert!(2 * seen >= directions.len(), "{name} {integrator:?}: {seen} directions stand out from the noise");
}

#[test]
fn derivatives_of_forces_in_runs_are_those_of_differences() {
    let cases = [
        turning("hinged", hinged(), 5e-3),
        turning("flat", flat(), 5e-3),
        turning("with a body", with_body(), 5e-3),
        scene_of("branch"),
    ];
    for case in &cases {
        Integrator::ALL.into_iter().for_each(|integrator| check(case, integrator));
    }
}

fn check_equilibrium(name: &str, model: &Model, state: &State, step: f64) {
    let params = StaticParams::default();
    let mut state = state.clone();
    assert!(statics::equilibrium(model, &mut state, &params).unwrap().converged, "{name}");
    let at_rest = |model: &Model, state: &State| {
        let found = Equilibrium::new(model, state, &params).unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut forces = vec![JointForce::default(); model.joints.len()];
        found.store_joint_forces(&mut forces);
        (found, forces)
    };
    let (mut equilibrium, forces) = at_rest(model, &state);
    let rest = equilibrium.state().clone();
    let (weights, about) = ([(0, weights(model, 3))], [(rest.clone(), forces)]);
    let noise = 200.0 * f64::EPSILON * size(&about, &weights) / step;
    let mut seen = 0;
    let gradient = equilibrium.backward(&weights[0].1, Wanted::ALL).unwrap();
    for (what, variation) in directions(model) {
        let change = equilibrium.forward(&variation).unwrap();
        let along = change.dot(&weights[0].1);
        let back = gradient.dot(&variation);
        assert!(
            (along - back).abs() <= 1e-8 * parts(&weights[0].1, &change),
            "{name}, {what}: {along:e} forward, {back:e} backward"
        );
        let expected = of_fourth_order(step, |share| {
            let (model, state) = moved(model, &rest, &variation, share);
            let (found, forces) = at_rest(&model, &state);
            reading(&[(found.state().clone(), forces)], &weights, &about)
        });
        println!("{name}, {what}: {along:e} {expected:e} {noise:.1e}");
        seen += usize::from(expected.abs() > 1e6 * noise);
        assert!(
            (along - expected).abs() <= 1e-6 * expected.abs() + noise,
            "{name}, {what}: {along:e}, differences say {expected:e}"
        );
    }
    assert!(seen >= 4, "{name}: {seen} directions stand out from the noise");
}

#[test]
fn derivatives_of_forces_at_rest_are_those_of_differences() {
    let (model, state) = flat();
    let (coil, coiled) = clamped();
    let (mut free, turned) = hinged();
    free.joints.iter_mut().for_each(|joint| joint.inner_damping = InnerDamping::NONE);
    let Scene { model: cable, state: hung, .. } = scene::builtin("hung-cable").unwrap();
    let cable = Model { motions: Vec::new(), ..cable };
    check_equilibrium("hung-cable", &cable, &hung, 5e-3);
    check_equilibrium("clamped", &coil, &coiled, 1e-3);
    let (loaded, loaded_state) = with_body();
    check_equilibrium("with a body", &loaded, &loaded_state, 1e-3);
    check_equilibrium("hinged", &free, &turned, 1e-3);
    let mut joined = model;
    joined.joints[5].freedom = cosserat::state::Freedom::None;
    joined.loads[0].torque = Vector3::zeros();
    check_equilibrium("flat", &joined, &state, 1e-3);
}

/// In equilibrium the pull of a cable that hangs straight down is the weight below.
#[test]
fn forces_at_rest_are_weights() {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -10.0));
    let own = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), -Vector3::z(), 1.0, 10), 0.02, material()));
    assembly.clamp_start(&own);
    let (model, state) = assembly.finish();
    let mut rest = Equilibrium::new(&model, &state, &StaticParams::default()).unwrap();
    let mut forces = vec![JointForce::default(); model.joints.len()];
    rest.store_joint_forces(&mut forces);
    let joint = model.joints_of(&own)[0];
    let below: f64 = model.segments.iter().map(|segment| segment.mass()).sum();
    assert!((forces[joint].force - Vector3::new(0.0, 0.0, -10.0 * below)).norm() < 1e-9);
    let change = rest.forward(&Parameter::Gravity(2).variation(&model)).unwrap();
    assert!((change.forces[joint].force - Vector3::z() * below).norm() < 1e-9);
    assert!(change.forces.iter().all(|own| own.moment.norm() < 1e-9));
}

#[test]
fn forces_that_do_not_fit_are_refused() {
    let (model, state) = flat();
    let settings = settings(Integrator::Euler, 60);
    let mut recording = Recording::new(&model, &state, &settings).unwrap();
    recording.step(1e-3).unwrap();
    let mut short = StateVariation::with_forces(&model);
    short.forces.pop();
    let error = recording.backward(&[(1, short)], Wanted::ALL).unwrap_err();
    assert_eq!(error.to_string(), "a variation with 6 forces of joints, but there are 7");
    let mut start = Variation::zero(&model);
    start.start = StateVariation::with_forces(&model);
    let error = Forward::new(&model, &state, &settings, &[start]).err().unwrap();
    assert!(matches!(error, DerivativeError::Size { found: 7, expected: 0, .. }), "{error}");
    // Before the first step joints transmit nothing, whatever a run depends on.
    let gradient = recording.backward(&[(0, weights(&model, 1))], Wanted::ALL).unwrap();
    let only_the_place = weights(&model, 1).positions[1];
    assert_eq!(gradient.start.positions[1], only_the_place);
    assert!(gradient.joints.iter().all(|joint| *joint == Default::default()));
}
