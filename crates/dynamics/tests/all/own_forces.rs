//! Loads and gravity that a program sets between steps are those of a model that has them.

use std::sync::Arc;

use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::StepParams;
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::Integrator;
use rod::{Assembly, Change, Changing, Interpolation, Load, Model, RodSpec, State, Track, shape};

use crate::common::*;

const FORCE: Vector3<f64> = Vector3::new(0.3, -2.0, 1.0);
const TORQUE: Vector3<f64> = Vector3::new(0.0, 0.05, 0.1);

/// Rods with a load each on a segment in their middle, `force` and `torque`.
fn loaded(rods: usize, offset: f64, force: Vector3<f64>, torque: Vector3<f64>) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..rods {
        let nodes = shape::straight(Vector3::y() * k as f64, Vector3::x(), 1.0, 10);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
        assembly.clamp_start(&rod);
        assembly.load(Load { segment: rod.start + 5, offset, force: force * (1.0 + k as f64), torque, follows: false });
    }
    assembly.finish()
}

fn run(simulation: &mut Simulation, state: &State) -> State {
    let mut state = state.clone();
    for _ in 0..30 {
        simulation.step(DT).unwrap();
    }
    simulation.store(&mut state);
    state
}

#[test]
fn a_load_set_from_code_is_the_models_to_the_last_bit() {
    for (rods, offset, torque) in [(1, 0.0, Vector3::zeros()), (1, 0.02, TORQUE), (3, 0.0, TORQUE), (8, 0.01, TORQUE)] {
        for formulation in Formulation::ALL {
            let settings = settings(formulation, SolverKind::Direct);
            let (model, state) = loaded(rods, offset, FORCE, torque);
            let expected = run(&mut Simulation::new(&model, &state, &settings, None).unwrap(), &state);
            let (model, state) = loaded(rods, offset, Vector3::zeros(), Vector3::zeros());
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            for k in 0..rods {
                simulation.set_load(k, FORCE * (1.0 + k as f64), torque).unwrap();
            }
            assert_eq!(run(&mut simulation, &state), expected, "{formulation}, {rods} rods");
        }
    }
}

#[test]
fn gravity_set_from_code_is_the_models_to_the_last_bit() {
    let other = Vector3::new(1.0, 0.0, -1.6);
    for rods in [1, 3] {
        let (mut model, state) = loaded(rods, 0.0, FORCE, Vector3::zeros());
        let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
        simulation.set_gravity(other).unwrap();
        model.gravity = other;
        let mut expected = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
        assert_eq!(run(&mut simulation, &state), run(&mut expected, &state), "{rods} rods");
    }
}

#[test]
fn a_free_rod_gains_the_momentum_of_a_force_that_changes() {
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 10);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
    assembly.load(Load {
        segment: rod.end - 1,
        offset: 0.0,
        force: Vector3::zeros(),
        torque: Vector3::zeros(),
        follows: false,
    });
    let (model, mut state) = assembly.finish();
    let step = StepParams { integrator: Integrator::Euler, ..StepParams::DEFAULT };
    let settings = Settings { step, ..Settings::default() };
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let mut impulse = Vector3::zeros();
    for step in 0..50 {
        let force = Vector3::new(0.0, f64::from(step), 20.0 - f64::from(step));
        simulation.set_load(0, force, Vector3::zeros()).unwrap();
        simulation.step(DT).unwrap();
        impulse += force * DT;
    }
    simulation.store(&mut state);
    let momentum: Vector3<f64> =
        model.segments.iter().zip(&state.velocities).map(|(segment, v)| v * segment.mass()).sum();
    // Joints push both their bodies alike, to rounding errors.
    assert!((momentum - impulse).norm() < 1e-9 * impulse.norm(), "{momentum} {impulse}");
}

#[test]
fn what_cannot_be_set_is_refused() {
    let (mut model, state) = loaded(1, 0.0, FORCE, TORQUE);
    let track = Arc::new(Track::new(&[(0.0, FORCE), (1.0, TORQUE)], Interpolation::Linear).unwrap());
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    let error = simulation.set_load(1, FORCE, TORQUE).unwrap_err();
    assert_eq!(error.to_string(), "load 1 does not exist (the model has 1)");
    let error = simulation.set_load(0, FORCE * f64::NAN, TORQUE).unwrap_err();
    assert_eq!(error.to_string(), "load 0 must be finite");
    assert!(matches!(simulation.set_gravity(FORCE / 0.0), Err(SimulationError::NotFinite(_))));

    model.changes = vec![
        Change { of: Changing::Torque(0), track: track.clone() },
        Change { of: Changing::Gravity, track: track.clone() },
    ];
    (model.loads[0].torque, model.gravity) = (track.at(0.0), track.at(0.0));
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    let error = simulation.set_load(0, FORCE, TORQUE).unwrap_err();
    assert_eq!(error.to_string(), "load 0 changes over time as the model says, and cannot be set");
    assert!(matches!(simulation.set_gravity(FORCE), Err(SimulationError::Changes(_))));
}
