//! Rods on springs along them, against closed forms.

use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::{Assembly, Foundation, Integrator, Load, Model, RodSpec, State, shape};

use crate::common::*;

const RADIUS: f64 = 0.02;
const MODULUS: f64 = 1e8;
const DENSITY: f64 = 1000.0;

/// A free rod of 4 m along x on springs.
fn laid(segments: usize, springs: Foundation) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 4.0, segments);
    let rod = assembly.rod(&RodSpec::new(nodes, RADIUS, material(MODULUS, DENSITY)));
    assembly.foundation(rod, &springs);
    assembly.finish()
}

#[test]
fn a_point_load_sinks_in_as_hetenyi_says() {
    let springs = Foundation { across: 1e4, along: 1e4, damping: 0.0 };
    let segments = 161;
    let (mut model, mut state) = laid(segments, springs);
    let force = 5.0;
    let middle = segments / 2;
    model.loads = vec![Load {
        segment: middle,
        offset: 0.0,
        force: Vector3::y() * force,
        torque: Vector3::zeros(),
        follows: false,
    }];
    let report = statics::equilibrium(&model, &mut state, &statics::StaticParams::default()).unwrap();
    assert!(report.converged);
    // An endless beam on an elastic foundation (Hetenyi 1946): F lambda / (2 k), lambda = (k / (4 E I))^(1/4); 4 m are 17 / lambda.
    let bending = MODULUS * std::f64::consts::PI * RADIUS.powi(4) / 4.0;
    let lambda = (springs.across / (4.0 * bending)).powf(0.25);
    let expected = force * lambda / (2.0 * springs.across);
    let found = state.positions[middle].y;
    assert!((found / expected - 1.0).abs() < 0.01, "{found} m, not {expected}");
    // And it stays so in time.
    let step = StepParams { integrator: Integrator::Bdf2, ..StepParams::DEFAULT };
    let mut simulation = Simulation::new(&model, &state, &Settings { step, solver: SolverKind::Direct }, None).unwrap();
    for _ in 0..50 {
        assert_eq!(simulation.step(0.01).unwrap().status, Status::Converged);
    }
    simulation.store(&mut state);
    assert!((state.positions[middle].y / found - 1.0).abs() < 1e-3);
}

#[test]
fn a_rod_swings_on_its_springs_and_they_damp_it() {
    for damping in [0.0, 0.01] {
        let springs = Foundation { across: 200.0, along: 800.0, damping };
        for (direction, stiffness) in [(Vector3::y(), 200.0), (Vector3::x(), 800.0)] {
            let (model, mut state) = laid(10, springs);
            state.velocities.fill(direction * 0.1);
            let line: f64 = DENSITY * std::f64::consts::PI * RADIUS.powi(2);
            let rate = (stiffness / line).sqrt();
            let ratio: f64 = 0.5 * damping * rate;
            let damped = rate * (1.0 - ratio * ratio).sqrt();
            let step = StepParams { integrator: Integrator::Bdf2, ..StepParams::DEFAULT };
            let mut simulation =
                Simulation::new(&model, &state, &Settings { step, solver: SolverKind::Direct }, None).unwrap();
            let before = state.positions[4];
            let dt = 1e-3;
            for step in 1..=1000 {
                simulation.step(dt).unwrap();
                let time = f64::from(step) * dt;
                simulation.store(&mut state);
                let expected = 0.1 / damped * (-ratio * rate * time).exp() * (damped * time).sin();
                let found = (state.positions[4] - before).dot(&direction);
                assert!((found - expected).abs() < 0.02 * 0.1 / damped, "{damping}, {direction}: {found} {expected}");
            }
        }
    }
}

#[test]
fn springs_in_one_direction_hold_in_that_one() {
    for (springs, soft, stiff) in [
        (
            Foundation { across: 1e4, along: 0.0, damping: 0.0 },
            Vector3::new(1.0, 0.0, 1.0),
            Vector3::new(-1.0, 0.0, 1.0),
        ),
        (
            Foundation { across: 0.0, along: 1e4, damping: 0.0 },
            Vector3::new(-1.0, 0.0, 1.0),
            Vector3::new(1.0, 0.0, 1.0),
        ),
    ] {
        let mut assembly = Assembly::new(Vector3::zeros());
        // Drawn at half a right angle.
        let nodes = shape::straight(Vector3::zeros(), Vector3::new(1.0, 0.0, 1.0), 1.0, 10);
        let rod = assembly.rod(&RodSpec::new(nodes, RADIUS, material(MODULUS, DENSITY)));
        assembly.foundation(rod, &springs);
        let (mut model, start) = assembly.finish();
        let load =
            |segment| Load { segment, offset: 0.0, force: stiff.normalize(), torque: Vector3::zeros(), follows: false };
        model.loads = (0..10).map(load).collect();
        let mut state = start.clone();
        let report = statics::equilibrium(&model, &mut state, &statics::StaticParams::default()).unwrap();
        assert!(report.converged, "{springs:?}");
        let way = state.positions[4] - start.positions[4];
        // 10 N on 1e4 N/m, and nothing in the direction that is free.
        assert!((way.dot(&stiff.normalize()) - 1e-3).abs() < 1e-5, "{springs:?}: {way}");
        assert!(way.dot(&soft.normalize()).abs() < 1e-5, "{springs:?}: {way}");
    }
}
