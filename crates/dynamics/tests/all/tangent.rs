//! The exact tangent: the same solutions as of the positive matrix, from fewer iterations.

use component::Members;
use dynamics::formulation::{Formulation, Tangent};
use dynamics::guess::GuessKind;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::{Status, StepParams};
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use nalgebra::Vector3;
use rod::Integrator;
use rod::{Assembly, Model, RodSpec, State, shape};

use crate::common::*;

fn settings_of(tangent: Tangent, integrator: Integrator) -> Settings {
    let step = StepParams {
        formulation: Formulation::Newton,
        tangent,
        integrator,
        relative_tolerance: 1e-8,
        motion_tolerance: 1e-8,
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
            assert!(fast < slow, "{name} {integrator}: {fast} iterations a step, {slow} with the positive matrix");
            for (a, b) in positive.positions.iter().zip(&exact.positions) {
                assert!((a - b).norm() < 1e-6, "{name} {integrator}: {a} {b}");
            }
        }
    }
}

/// At the end of a step each iteration leaves the square of what the one before has left; on rings also a small share of it,
/// as what is not symmetric of the inertia is left out of the tangent there. The positive matrix leaves about half.
#[test]
fn residuals_fall_quadratically_at_the_end_of_a_step() {
    const ROUNDING: f64 = 1e-13;
    let scenes = [("helix", helix(50), DT, 0.0), ("tree", tree(), 0.25 * DT, 0.0), ("ring", ring(), DT, 2e-3)];
    for (name, (model, state), dt, share) in scenes {
        let usual = settings_of(Tangent::Exact, Integrator::Euler);
        // Steps with a cap on their iterations leave what these leave.
        let mut capped = usual;
        (capped.step.motion_tolerance, capped.step.max_halvings) = (0.0, 0);
        let mut simulation = Simulation::new(&model, &state, &usual, None).unwrap();
        let mut start = state.clone();
        for step in 0..10 {
            simulation.step(dt).unwrap();
            simulation.store(&mut start);
            let left = [1, 2, 3, 4].map(|iterations| {
                capped.step.max_iterations = iterations;
                let mut once = Simulation::new(&model, &start, &capped, None).unwrap();
                once.step(dt).unwrap();
                let counters = once.counters();
                counters.worst_stretch.max(counters.worst_bend).max(counters.worst_momentum)
            });
            for pair in left.windows(2) {
                let most = 2.0 * pair[0] * pair[0] + share * pair[0] + ROUNDING;
                assert!(pair[1] <= most, "{name}, step {step}: {left:?}");
            }
        }
    }
}

/// Iterations a step to 1e-6 from the default start, the one that shows that no more is needed included; the slack rod is thrown at its clamp.
#[test]
fn few_iterations_are_enough() {
    let slack = {
        let (model, mut state) = rod(2.0, 40, 0.005, material(1e6, 1000.0));
        state.velocities.iter_mut().skip(1).for_each(|velocity| *velocity = Vector3::new(-4.0, 1.0, 0.0));
        (model, state)
    };
    for (name, (model, state), most) in [("helix", helix(50), 4.5), ("ring", ring(), 4.0), ("slack rod", slack, 8.0)] {
        let step = StepParams {
            formulation: Formulation::Newton,
            tangent: Tangent::Exact,
            integrator: Integrator::Euler,
            ..StepParams::DEFAULT
        };
        let kind = GuessKind::StepAdaptive;
        let build = |model: &Model, members: &Members, topology: &Topology| kind.build(model, members, topology);
        let settings = Settings { step, solver: SolverKind::Direct };
        let mut simulation = Simulation::new(&model, &state, &settings, Some(&build)).unwrap();
        const STEPS: u64 = 50;
        for step in 0..STEPS {
            let status = simulation.step(DT).unwrap().status;
            assert_eq!(status, Status::Converged, "{name}, step {step}");
        }
        let mean = simulation.counters().iterations as f64 / STEPS as f64;
        assert!(mean <= most, "{name}: {mean} iterations a step");
    }
}

/// The choice takes the way of fewer iterations, of which one with the exact tangent counts as 1.35 (1 on a ring).
#[test]
fn the_way_of_less_work_is_found_out() {
    let still = rod(1.0, 20, 0.02, material(1e7, 1000.0));
    for (name, (model, state), exact_cost) in [("helix", helix(50), 1.35), ("ring", ring(), 1.0), ("rod", still, 1.35)]
    {
        let iterations = |tangent: Tangent| {
            let step = StepParams { formulation: Formulation::Newton, tangent, ..StepParams::DEFAULT };
            let settings = Settings { step, solver: SolverKind::Direct };
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            for step in 0..150 {
                assert_eq!(simulation.step(DT).unwrap().status, Status::Converged, "{name}, {tangent}, step {step}");
            }
            simulation.counters().iterations as f64
        };
        let [auto, positive, exact] = [Tangent::Auto, Tangent::Positive, Tangent::Exact].map(iterations);
        // All of its iterations are at least as dear as those of the positive matrix, and at most as those of the exact one.
        let least = positive.min(exact_cost * exact);
        assert!(auto <= 1.15 * least, "{name}: {auto} iterations, {positive} and {exact} with one tangent alone");
        let saves = exact_cost * exact < 0.8 * positive;
        assert!(!saves || auto < 0.9 * positive, "{name}: {auto} iterations, {positive} with the positive matrix");
    }
}

/// Without an exact tangent, and with a solver that was asked for, the choice is the positive matrix, bit by bit.
#[test]
fn the_choice_is_the_positive_matrix_where_there_is_no_other() {
    let mut rings = Assembly::new(GRAVITY);
    let [one, other] = [0.0, 1.0].map(|x| {
        let nodes = shape::ring(Vector3::new(x, 0.0, 0.0), 0.5, 14);
        rings.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.03, material(1e5, 400.0)) })
    });
    rings.branch(one.start, 0.5, &other);
    for ((model, state), solver) in [(rings.finish(), SolverKind::Direct), (helix(12), SolverKind::Sparse)] {
        let [a, b] = [Tangent::Auto, Tangent::Positive].map(|tangent| {
            let settings = Settings { solver, ..settings_of(tangent, Integrator::Euler) };
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            (0..5).for_each(|_| assert!(simulation.step(0.25 * DT).is_ok()));
            let mut end = state.clone();
            simulation.store(&mut end);
            (end, simulation.counters().iterations)
        });
        assert_eq!(a.0.positions, b.0.positions);
        assert!(a.1 == b.1 && a.1 > 0);
    }
}

#[test]
fn the_exact_tangent_is_refused_where_there_is_none() {
    let refused = |(model, state): (Model, State), settings: Settings| {
        let error = Simulation::new(&model, &state, &settings, None).err();
        assert!(matches!(error, Some(SimulationError::Tangent(_))), "{error:?}");
    };
    let exact = settings_of(Tangent::Exact, Integrator::Euler);
    let step = StepParams { formulation: Formulation::Xpbd, ..exact.step };
    refused(helix(8), Settings { step, ..exact });
    let mut rings = Assembly::new(GRAVITY);
    let [one, other] = [0.0, 1.0].map(|x| {
        let nodes = shape::ring(Vector3::new(x, 0.0, 0.0), 0.5, 14);
        rings.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.03, material(1e5, 400.0)) })
    });
    rings.branch(one.start, 0.5, &other);
    refused(rings.finish(), exact);
}
