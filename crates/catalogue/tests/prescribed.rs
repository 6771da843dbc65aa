//! Fixed segments follow their motion exactly with every learned guess, too, also where it is restricted to a plane, and
//! where projections are predicted.

use std::sync::Arc;

use catalogue::{Guess, GuessName, Row, rows};
use cosserat::assembly::{Assembly, Material, RodSpec, shape};
use cosserat::simulation::{CgParams, Formulation, Integrator, Settings, Simulation, SolverKind, Status, StepParams};
use cosserat::state::{Model, State};
use dataset::{Config, Dataset, Scenario, generate};
use graph::{Normal, planar_normal};
use knn::{Knn, Params};
use nalgebra::{UnitQuaternion, Vector3};

const DT: f64 = 0.01;
/// Velocity [m/s] and angular velocity [rad/s] of the fixed segment: in space, and within the plane of x and z.
const IN_SPACE: [Vector3<f64>; 2] = [Vector3::new(0.05, -0.02, 0.03), Vector3::new(0.6, 0.5, 1.0)];
const IN_PLANE: [Vector3<f64>; 2] = [Vector3::new(0.05, 0.0, 0.03), Vector3::new(0.0, 1.2, 0.0)];

/// A rod of 20 segments along x whose first one turns and drifts.
fn turning([velocity, spin]: [Vector3<f64>; 2]) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 20);
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1000.0 };
    assembly.rod(&RodSpec::new(nodes, 0.02, material));
    assembly.fix(0);
    let state = assembly.state_mut();
    (state.velocities[0], state.angular_velocities[0]) = (velocity, spin);
    assembly.finish()
}

fn follow(mut simulation: Simulation, state: &State, what: &str) {
    let mut now = state.clone();
    let (velocity, spin) = (state.velocities[0], state.angular_velocities[0]);
    for step in 1..=500 {
        if simulation.step(DT).unwrap().status == Status::NonFinite {
            // Predictions alone may throw a rod about until nothing is left of it.
            assert!(what.ends_with("alone"), "{what}, step {step}");
            break;
        }
        simulation.store(&mut now);
        let elapsed = f64::from(step) * DT;
        let gap = (now.positions[0] - (state.positions[0] + velocity * elapsed)).norm();
        let turned = UnitQuaternion::from_scaled_axis(spin * elapsed) * state.orientations[0];
        let [apart, back] = [-1.0, 1.0].map(|sign| (now.orientations[0].coords + turned.coords * sign).norm());
        assert!(gap <= 1e-12 && apart.min(back) <= 1e-12, "{what}, step {step}: {gap:e} m, {:e}", apart.min(back));
    }
    let counters = simulation.counters();
    assert!(counters.guesses_used + counters.guesses_dropped > 0, "{what}");
}

/// Starts of linear solves or of whole steps, and predictions in the projection's place where there are any; restricted to
/// the plane where one is given.
fn check_in(row: &Row, (model, state): &(Model, State), plane: Option<Normal>) {
    let helps_steps = row.guess_name.helps_steps();
    let place = if plane.is_some() { "in a plane" } else { "in space" };
    for formulation in Formulation::ALL {
        let what = format!("{} {place}, {formulation}", row.name);
        if helps_steps && !formulation.momentum() {
            continue;
        }
        let step = StepParams { formulation, integrator: Integrator::Euler, ..StepParams::DEFAULT };
        let solver = if helps_steps { SolverKind::Direct } else { SolverKind::Cg(CgParams::default()) };
        // As it is, and in substeps.
        for (max_iterations, relative_tolerance) in [(step.max_iterations, step.relative_tolerance), (1, 1e-10)] {
            let step = StepParams {
                max_iterations,
                relative_tolerance,
                motion_tolerance: relative_tolerance,
                max_halvings: 1,
                ..step
            };
            let build = row.factory(plane);
            let simulation = Simulation::new(model, state, &Settings { step, solver }, Some(&build)).unwrap();
            follow(simulation, state, &format!("{what}, {max_iterations} iterations"));
        }
        if let Some(project) = row.projection(plane) {
            let step = StepParams { max_iterations: 3, ..step };
            follow(Simulation::end_to_end(model, state, &step, &project).unwrap(), state, &format!("{what}, alone"));
        }
    }
}

/// The guess in space, and in a plane that it is restricted to.
fn check(name: GuessName, guess: Guess) {
    let guesses = [(name, guess)];
    let free = rows(&guesses, false).pop().expect("a row");
    check_in(&free, &turning(IN_SPACE), None);
    let planar = turning(IN_PLANE);
    let plane = planar_normal(&planar.0, &planar.1);
    assert!(plane.is_some());
    // The last row is the one that is restricted, or the only one, which knows planes by itself.
    let restricted = rows(&guesses, true).pop().expect("a row");
    check_in(&restricted, &planar, plane);
}

#[test]
fn with_nearest_neighbours() {
    let directory = tempfile::tempdir().unwrap();
    let config =
        Config { train_trajectories: 4, validation_trajectories: 1, steps: 5, ..Config::table_1(Scenario::Rod) };
    generate(directory.path(), &config, None, &|_| ()).unwrap();
    let knn = Knn::new(&Dataset::open(directory.path()).unwrap(), Params::default());
    check(GuessName::Knn, Guess::Knn(Arc::new(knn)));
}

#[cfg(feature = "gn")]
#[test]
fn with_the_networks_in_the_program() {
    for name in ["gn", "gn-best", "gn-step"] {
        let name: GuessName = name.parse().unwrap();
        let sources = catalogue::Sources::default();
        let training = catalogue::Training::of(&sources, &[name], &[Scenario::Rod], true).unwrap().remove(0);
        check(name, Guess::load(name, &training).unwrap());
    }
}
