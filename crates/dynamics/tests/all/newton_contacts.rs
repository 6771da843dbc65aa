//! Formulation `newton` where bodies can touch.

use dynamics::formulation::{ContactProjection, Formulation, Tangent};
use dynamics::simulation::{Simulation, SimulationError};
use dynamics::step::Status;
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::{Assembly, Contacts, Friction, Model, Obstacle, ObstacleShape, RodSpec, State, Surface, shape};

use crate::common::*;

/// Two cantilevers side by side, one much softer than the other.
fn cantilevers() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for (k, modulus) in [1e4, 1e8].into_iter().enumerate() {
        let nodes = shape::straight(Vector3::y() * k as f64, Vector3::x(), 1.0, 20);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.01, material(modulus, 1000.0)));
        assembly.fix(rod.start);
    }
    assembly.finish()
}

/// A set that is at its tolerance stays there while another one goes on: what does not touch moves as if nothing could.
#[test]
fn what_does_not_touch_moves_as_if_nothing_could() {
    let (mut model, state) = cantilevers();
    let mut settings = settings(Formulation::Newton, SolverKind::Direct);
    settings.step.max_halvings = 0;
    // Where bodies can touch, what they still move is compared with it.
    settings.step.contact_tolerance = 1e-6;
    let run = |model: &Model| {
        let mut simulation = Simulation::new(model, &state, &settings, None).unwrap();
        for step in 0..50 {
            assert_eq!(simulation.step(DT).unwrap().status, Status::Converged, "step {step}");
        }
        let mut end = state.clone();
        simulation.store(&mut end);
        (end, simulation.counters().iterations)
    };
    let (free, _) = run(&model);
    model.contacts.between_segments = Some(Surface::default());
    let (watched, _) = run(&model);
    for (a, b) in free.positions.iter().zip(&watched.positions) {
        assert!((a - b).norm() < 1e-5, "{a} {b}");
    }
}

/// A helix that falls onto the ground: its turns come to lie on each other, nearly parallel, and hold each other by friction.
fn falling_helix() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::helix(Vector3::new(0.5, 0.0, 0.75), 0.5, 0.5, 2.5, 50);
    assembly.rod(&RodSpec::new(nodes, 0.05, material(1e6, 100.0)));
    let (mut model, state) = assembly.finish();
    let surface = Surface { friction: Friction::new(0.3), ..Surface::default() };
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    let obstacles = vec![Obstacle::new(ground, surface)];
    model.contacts = Contacts { obstacles, between_segments: Some(surface), ..Contacts::default() };
    (model, state)
}

#[test]
fn turns_of_a_helix_that_lie_on_each_other_converge() {
    let (model, state) = falling_helix();
    let mut simulation =
        Simulation::new(&model, &state, &settings(Formulation::Newton, SolverKind::Direct), None).unwrap();
    // In the last of these steps two turns touch.
    for step in 0..13 {
        assert_eq!(simulation.step(DT).unwrap().status, Status::Converged, "step {step}");
    }
    let counters = simulation.counters();
    assert!(counters.deepest_penetration < 1e-3 && counters.worst_contact < 1e-3, "{counters:?}");
    assert!(counters.contact_solves > 0);
}

/// Where turns rest on each other, nearest places on axes that are nearly parallel do not jump from iteration to iteration.
#[test]
fn a_helix_at_rest_takes_few_iterations() {
    let (model, state) = falling_helix();
    let settings = settings(Formulation::Newton, SolverKind::Direct);
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let mut step = |steps: usize| {
        let before = simulation.counters();
        (0..steps).for_each(|_| _ = simulation.step(0.02).unwrap());
        let after = simulation.counters();
        assert_eq!(after.not_converged, 0);
        assert!(after.deepest_penetration < 1e-3, "{after:?}");
        (after.iterations - before.iterations) as f64 / steps as f64
    };
    step(60);
    let at_rest = step(40);
    assert!(at_rest < 6.0, "{at_rest}");
}

/// A cantilever swings down onto a stiffer one across it, without friction.
fn crossed_cantilevers() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let [soft, stiff] = [2e6, 2e9].map(|modulus| material(modulus, 1000.0));
    let upper = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 20), 0.01, soft));
    let start = Vector3::new(0.675, -0.425, -0.15);
    let lower = assembly.rod(&RodSpec::new(shape::straight(start, Vector3::y(), 0.8, 16), 0.01, stiff));
    assembly.fix(upper.start).fix(lower.start);
    let (mut model, state) = assembly.finish();
    model.contacts.between_segments = Some(Surface::default());
    (model, state)
}

/// Contacts are solved with the exact tangent's own operator: the same motion in fewer iterations.
#[test]
fn exact_steps_with_contacts_are_those_of_the_positive_matrix_in_fewer_iterations() {
    let (model, state) = crossed_cantilevers();
    let run = |tangent| {
        let mut settings = settings(Formulation::Newton, SolverKind::Direct);
        settings.step.tangent = tangent;
        settings.step.contact_tolerance = 1e-8;
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        for step in 0..60 {
            let status = simulation.step(0.01).unwrap().status;
            assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        }
        let mut end = state.clone();
        simulation.store(&mut end);
        (end, simulation.counters())
    };
    let [(positive, slow), (exact, fast), (_, auto)] = [Tangent::Positive, Tangent::Exact, Tangent::Auto].map(run);
    for (a, b) in positive.positions.iter().zip(&exact.positions) {
        assert!((a - b).norm() < 1e-4, "{a} {b}");
    }
    assert!(fast.contact_solves > 100, "{fast:?}");
    let [slow, fast, auto] = [slow, fast, auto].map(|counters| counters.iterations as f64);
    assert!(fast < 0.5 * slow && auto < 0.8 * slow, "{fast} and {auto} iterations, {slow} with the positive matrix");
}

#[test]
fn contacts_that_alternate_know_no_exact_tangent() {
    let (model, state) = crossed_cantilevers();
    let mut settings = settings(Formulation::Newton, SolverKind::Direct);
    (settings.step.tangent, settings.step.contact_projection) = (Tangent::Exact, ContactProjection::Alternating);
    let error = Simulation::new(&model, &state, &settings, None).err();
    assert!(matches!(error, Some(SimulationError::Tangent(_))), "{error:?}");
}
