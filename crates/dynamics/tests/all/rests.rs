//! Rest shapes that change over time, as the model says or set between steps: muscles.

use std::sync::Arc;

use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::{Status, StepParams};
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::{
    Assembly, Body, Change, Changing, Integrator, Interpolation, Model, RestShape, RodSpec, State, Track, measure,
    shape,
};

use crate::common::*;

/// Clamped rods without gravity, straight at first.
fn straight(rods: usize, segments: usize) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    for k in 0..rods {
        let nodes = shape::straight(Vector3::y() * k as f64, Vector3::x(), 1.0, segments);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
        assembly.clamp_start(&rod);
    }
    assembly.finish()
}

/// Joints between two segments, not those to the ground.
fn inner(model: &Model) -> Vec<usize> {
    let is_inner = |k: &usize| matches!([model.joints[*k].a, model.joints[*k].b], [Body::Segment(_), Body::Segment(_)]);
    (0..model.joints.len()).filter(is_inner).collect()
}

/// Lets all inner joints follow a track.
fn follow(model: &mut Model, track: &Arc<Track>) {
    for joint in inner(model) {
        model.joints[joint].rest_darboux = track.at(0.0);
        model.changes.push(Change { of: Changing::Rest(joint), track: track.clone() });
    }
}

fn track(values: &[(f64, Vector3<f64>)], interpolation: Interpolation) -> Arc<Track> {
    Arc::new(Track::new(values, interpolation).unwrap())
}

#[test]
fn a_rest_set_from_code_is_the_models_to_the_last_bit() {
    let course = track(&[(0.0, Vector3::zeros()), (1.0, Vector3::new(0.5, 3.0, 1.0))], Interpolation::Linear);
    for rods in [1, 3, 8] {
        for formulation in Formulation::ALL {
            let settings = settings(formulation, SolverKind::Direct);
            let (plain, mut state) = straight(rods, 10);
            let mut model = plain.clone();
            follow(&mut model, &course);
            let mut of_model = Simulation::new(&model, &state, &settings, None).unwrap();
            let mut of_code = Simulation::new(&plain, &state, &settings, None).unwrap();
            let mut middle = None;
            for step in 0..30 {
                if step == 15 {
                    middle = Some(of_code.snapshot());
                }
                of_model.step(DT).unwrap();
                for joint in inner(&plain) {
                    of_code.set_rest(joint, course.at(of_code.time() + DT)).unwrap();
                }
                of_code.step(DT).unwrap();
            }
            let mut expected = state.clone();
            of_model.store(&mut expected);
            of_code.store(&mut state);
            assert_eq!(state, expected, "{formulation}, {rods} rods");
            // A snapshot keeps what was set.
            let mut still = Simulation::new(&plain, &state, &settings, None).unwrap();
            still.restore(middle.as_ref().unwrap()).unwrap();
            of_code.restore(middle.as_ref().unwrap()).unwrap();
            for simulation in [&mut still, &mut of_code] {
                simulation.step(DT).unwrap();
            }
            still.store(&mut expected);
            of_code.store(&mut state);
            assert_eq!(state, expected, "{formulation}, {rods} rods");
        }
    }
}

#[test]
fn a_muscle_bends_a_rod_to_an_arc() {
    for (formulation, integrator) in integrated() {
        for from_rest in [false, true] {
            let (mut model, mut state) = straight(1, 40);
            model.damping.linear = 2.0;
            let curvature = 1.5;
            let values = [(0.0, Vector3::zeros()), (2.0, Vector3::y() * curvature)];
            follow(&mut model, &track(&values, Interpolation::Smooth));
            if from_rest {
                model.measure_from_rest();
            }
            let step = StepParams { formulation, integrator, ..StepParams::DEFAULT };
            let settings = Settings { step, solver: SolverKind::Direct };
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            for _ in 0..400 {
                simulation.step(DT).unwrap();
            }
            simulation.store(&mut state);
            simulation.store_model(&mut model);
            let end = state.positions[39] + state.axis(39) * (0.5 / 40.0);
            let angle = curvature * (1.0 - 0.5 / 40.0);
            // The clamp's half joint stays straight.
            let straight = 0.5 / 40.0;
            let expected = Vector3::new(straight + angle.sin() / curvature, 0.0, -(1.0 - angle.cos()) / curvature);
            assert!((end - expected).norm() < 2e-3, "{formulation}, {integrator}: {end} {expected}");
            // Nothing holds the rod back: it stores nothing, and does not if the model says what rests are now.
            let energy = measure::energy(&model, &state);
            assert!(energy.bend < 1e-6, "{formulation}, {integrator}: {} J", energy.bend);
        }
    }
}

#[test]
fn what_flexes_in_free_flight_keeps_its_momenta() {
    for integrator in Integrator::ALL {
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 20);
        let spec = RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, 0.02, material(1e6, 1000.0)) };
        assembly.rod(&spec);
        let (mut model, mut state) = assembly.finish();
        let values: Vec<_> = (0..20)
            .map(|k| (0.05 * f64::from(k), Vector3::new(f64::from(k % 3) - 1.0, f64::from(k % 2) * 3.0, 1.0)))
            .collect();
        follow(&mut model, &track(&values, Interpolation::Smooth));
        let step = StepParams { integrator, ..StepParams::DEFAULT };
        let mut simulation =
            Simulation::new(&model, &state, &Settings { step, solver: SolverKind::Direct }, None).unwrap();
        let mut fastest: f64 = 0.0;
        for _ in 0..200 {
            assert_eq!(simulation.step(0.005).unwrap().status, Status::Converged);
            simulation.store(&mut state);
            let of = |i: usize| state.positions[i].cross(&state.velocities[i]) * model.segments[i].mass();
            let spin = |i: usize| {
                let (own, q) = (&model.segments[i], &state.orientations[i]);
                let w = q.inverse() * state.angular_velocities[i];
                let [across, along] = [own.transverse_inertia(), own.axial_inertia()];
                q * Vector3::new(across * w.x, across * w.y, along * w.z)
            };
            let angular: Vector3<f64> = (0..20).map(|i| of(i) + spin(i)).sum();
            let momentum: Vector3<f64> = (0..20).map(|i| state.velocities[i] * model.segments[i].mass()).sum();
            let size: f64 = (0..20).map(|i| of(i).norm()).sum();
            fastest = fastest.max(size);
            assert!(momentum.norm() < 1e-6, "{integrator}: {momentum}");
            // The velocities that are told are those over a step, which the discrete momentum is not quite that of.
            assert!(angular.norm() < 0.05 * fastest.max(0.2), "{integrator}: {angular}, {fastest}");
        }
        assert!(fastest > 1e-2, "{fastest}");
    }
}

#[test]
fn rests_that_cannot_be_set_are_refused() {
    let (mut model, state) = straight(1, 4);
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    let error = simulation.set_rest(9, Vector3::x()).unwrap_err();
    assert_eq!(error.to_string(), "joint 9 does not exist (the model has 4)");
    let error = simulation.set_rest(1, Vector3::x() * f64::NAN).unwrap_err();
    assert_eq!(error.to_string(), "the rest of joint 1 must be finite");
    follow(&mut model, &track(&[(0.0, Vector3::zeros())], Interpolation::Held));
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    let joint = inner(&model)[0];
    assert!(matches!(simulation.set_rest(joint, Vector3::x()), Err(SimulationError::Changes(_))));
    model.changes[0].of = Changing::Rest(9);
    assert!(Simulation::new(&model, &state, &Settings::default(), None).is_err());
}
