//! The exact tangent: the same solutions as of the positive matrix, from fewer iterations.

use crate::common::*;
use nalgebra::Vector3;
use rod::{Assembly, Model, RodSpec, State, shape};
use solver::formulation::{Formulation, Tangent};
use solver::integrator::Integrator;
use solver::linear::solvers::SolverKind;
use solver::simulation::{Settings, Simulation, SimulationError};
use solver::step::{Status, StepParams};

fn settings_of(tangent: Tangent, integrator: Integrator) -> Settings {
    let step = StepParams {
        formulation: Formulation::Newton,
        tangent,
        integrator,
        relative_tolerance: 1e-8,
        absolute_tolerance: 1e-10,
        max_iterations: 60,
        ..StepParams::DEFAULT
    };
    Settings { step, solver: SolverKind::Direct }
}

/// The state after some steps of dt, and iterations a step.
fn run(model: &Model, state: &State, settings: &Settings, dt: f64) -> (State, f64) {
    let mut simulation = Simulation::new(model, state, settings, None).unwrap();
    const STEPS: usize = 25;
    for step in 0..STEPS {
        let status = simulation.step(dt).unwrap().status;
        assert_eq!(status, Status::Converged, "step {step}, {:?}", settings.step);
    }
    let mut end = state.clone();
    simulation.store(&mut end);
    (end, simulation.counters().iterations as f64 / STEPS as f64)
}

#[test]
fn exact_steps_are_those_of_the_positive_matrix_in_fewer_iterations() {
    for (name, (model, state), dt) in [("helix", helix(24), DT), ("tree", tree(), 0.25 * DT), ("ring", ring(), DT)] {
        for integrator in Integrator::ALL {
            let [(positive, slow), (exact, fast)] = [Tangent::Positive, Tangent::Exact]
                .map(|tangent| run(&model, &state, &settings_of(tangent, integrator), dt));
            // BDF2 leaves more of its inertia out of the tangent.
            let is_faster = integrator == Integrator::Bdf2 || fast < slow;
            assert!(is_faster, "{name}: {fast} iterations a step, {slow} with the positive matrix");
            for (a, b) in positive.positions.iter().zip(&exact.positions) {
                assert!((a - b).norm() < 1e-6, "{name} {integrator}: {a} {b}");
            }
        }
    }
}

#[test]
fn the_exact_tangent_is_refused_where_there_is_none() {
    let refused = |(model, state): (Model, State), settings: Settings| {
        let error = Simulation::new(&model, &state, &settings, None).err();
        assert!(matches!(error, Some(SimulationError::Tangent(_))), "{error:?}");
    };
    let exact = settings_of(Tangent::Exact, Integrator::Euler);
    let step = StepParams { formulation: Formulation::XpbdGeometric, ..exact.step };
    refused(helix(8), Settings { step, ..exact });
    let mut rings = Assembly::new(GRAVITY);
    let [one, other] = [0.0, 1.0].map(|x| {
        let nodes = shape::ring(Vector3::new(x, 0.0, 0.0), 0.5, 14);
        rings.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.03, material(1e5, 400.0)) })
    });
    rings.branch(one.start, 0.5, &other);
    refused(rings.finish(), exact);
}
