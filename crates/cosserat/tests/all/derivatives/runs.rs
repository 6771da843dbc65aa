//! The gradient of a run, back through its steps, against central differences of runs: the scenes that come with the program.

use cosserat::derivative::{HeldVariation, Parameter, Recording, Rods, StateVariation, Variation, Wanted};
use cosserat::prelude::*;

use super::common::{Seen, moved, of_fourth_order, read, reading, settings, vector};

const SCENES: [&str; 12] = [
    "helix",
    "bending-rod",
    "slack-rod",
    "small-cantilever",
    "torsion-bar",
    "tip-mass",
    "pendulum",
    "clamped-ends",
    "all-clamped",
    "heavy-ring",
    "michell-ring",
    "branch",
];

const STEPS: usize = 6;

/// Share of a variation by which central differences go to either side.
const STEP: f64 = 2e-3;

/// After which steps the motion is read: a sum over frames.
const READ: [usize; 3] = [2, 4, STEPS];

/// A scene that turns as a whole about its first segment, with damping that can be changed both ways.
fn turning(name: &str) -> (Model, State, f64) {
    let Scene { mut model, mut state, run, .. } = scene::builtin(name).unwrap();
    model.damping = Damping { linear: 0.3, angular: 0.2 };
    let rate = Vector3::new(0.3, 0.2, -0.4);
    for i in (0..model.segments.len()).filter(|&i| !model.segments[i].fixed) {
        state.velocities[i] += rate.cross(&(state.positions[i] - state.positions[0]));
        state.angular_velocities[i] += rate;
    }
    (model, state, run.dt.min(2e-3))
}

/// Directions of all kinds that a model has.
fn directions(model: &Model) -> Vec<(&'static str, Variation)> {
    let of = |parameter: Parameter| parameter.variation(model);
    let mut out = vec![
        ("bending", of(Parameter::Bending(Rods::All))),
        ("torsion", of(Parameter::Torsion(Rods::All))),
        ("stretch", of(Parameter::Stretch(Rods::All))),
        ("density", of(Parameter::Density(Rods::All))),
        ("gravity", of(Parameter::Gravity(2))),
        ("linear damping", of(Parameter::LinearDamping)),
        ("angular damping", of(Parameter::AngularDamping)),
    ];
    let mut rest = Variation::zero(model);
    rest.joints.iter_mut().enumerate().for_each(|(j, joint)| joint.rest_darboux = vector(j) * 0.1);
    out.push(("rest shape", rest));
    let free = |i: &usize| !model.segments[*i].fixed;
    let mut velocities = Variation::zero(model);
    let mut places = Variation::zero(model);
    for i in (0..model.segments.len()).filter(free) {
        velocities.start.velocities[i] = vector(i + 20) * 0.1;
        velocities.start.angular_velocities[i] = vector(i + 30) * 0.1;
        places.start.positions[i] = vector(i + 40) * 1e-4;
        places.start.turns[i] = vector(i + 50) * 1e-3;
    }
    out.extend([("velocities", velocities), ("places", places)]);
    if model.motions.is_empty() {
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
    if model.air.is_some() {
        let air = [Parameter::AirDensity, Parameter::NormalDrag, Parameter::TangentialDrag, Parameter::Wind(1)];
        out.extend(air.map(|parameter| ("air", of(parameter))));
    }
    out
}

/// A run and its states at [`READ`].
fn run(model: &Model, state: &State, settings: &Settings, dt: f64) -> (Recording, Vec<Seen>) {
    let mut recording = Recording::new(model, state, settings).unwrap();
    // Runs whose steps are halved elsewhere are no neighbours.
    let check = |_: &Recording, _, report: StepReport| assert_eq!(report.status, Status::Converged);
    let seen = read(&mut recording, (model, state), (dt, &READ), check);
    (recording, seen)
}

fn check(name: &str, integrator: Integrator) {
    let settings = settings(integrator, 60);
    let (model, state, dt) = turning(name);
    let (mut recording, about) = run(&model, &state, &settings, dt);
    let count = model.segments.len();
    let weights = READ.map(|step| {
        let mut of = StateVariation::zero(count);
        for i in 0..count {
            of.positions[i] = vector(i + step);
            of.turns[i] = vector(i + 2 * step) * 0.1;
            of.velocities[i] = vector(i + 3 * step) * dt;
        }
        (step, of)
    });
    let gradient = recording.backward(&weights, Wanted::ALL).unwrap();
    let sizes = about.iter().zip(&weights).flat_map(|((state, _), (_, of))| state.positions.iter().zip(&of.positions));
    let size = sizes.map(|(x, w)| x.norm_squared() * w.norm_squared()).sum::<f64>().sqrt();
    // Of a difference, as far as steps are solved: what is a million times as large is compared to 1e-6.
    let noise = settings.step.absolute_tolerance * size / STEP;
    let directions = directions(&model);
    let (count, mut seen) = (directions.len(), 0);
    for (what, variation) in directions {
        let found = gradient.dot(&variation);
        let expected = of_fourth_order(STEP, |share| {
            let (model, state) = moved(&model, &state, &variation, share);
            reading(&run(&model, &state, &settings, dt).1, &weights, &about)
        });
        let error = (found - expected).abs();
        let allowed = 1e-6 * expected.abs() + noise;
        assert!(error < allowed, "{name} {integrator:?}, {what}: {found:e}, differences say {expected:e}");
        seen += usize::from(expected.abs() > 1e6 * noise);
    }
    assert!(3 * seen >= count, "{name} {integrator:?}: {seen} of {count} directions stand out from the noise");
}

#[test]
fn gradients_of_runs_are_those_of_differences() {
    for name in SCENES {
        for integrator in Integrator::ALL {
            check(name, integrator);
        }
    }
}
