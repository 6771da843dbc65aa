//! The guess: data points predict themselves, and a simulation takes it without harm.

use std::sync::Arc;

use cosserat::guess::{InitialGuess, Members, Topology};
use cosserat::internals::dynamics::projection::Projection;
use cosserat::internals::kernels::Spatial;
use cosserat::simulation::{Formulation, Integrator, Settings, Simulation, SolverKind, Status, StepParams};
use cosserat::state::Model;
use dataset::{Config, Dataset, Scenario, Split, generate};
use graph::Graph;
use knn::{Knn, KnnGuess, Params};

fn dataset(directory: &std::path::Path, scenario: Scenario) -> Dataset {
    let config = Config { train_trajectories: 6, validation_trajectories: 1, steps: 10, ..Config::table_1(scenario) };
    generate(directory, &config, None, &|_| ()).unwrap();
    Dataset::open(directory).unwrap()
}

#[test]
fn data_points_predict_themselves() {
    let directory = tempfile::tempdir().unwrap();
    let dataset = dataset(directory.path(), Scenario::Helix);
    let knn = Arc::new(Knn::new(&dataset, Params { every: 1, ..Params::default() }));
    assert_eq!(knn.len(), dataset.manifest().train.sample_joints);
    let trajectory = dataset.trajectory(Split::Train, 2).unwrap();
    let mut guess = KnnGuess::new(knn, trajectory.graph().clone(), None);
    let mut component = trajectory.component();
    let (mut dlambda, mut dp) = (
        vec![Spatial::zero(); trajectory.graph().edges().len()],
        vec![Spatial::zero(); trajectory.graph().nodes().len()],
    );
    let norm = |x: &mut dyn Iterator<Item = Spatial<f64>>| x.map(|x| x.dot(x)).sum::<f64>().sqrt();
    // Later iterations correct so little that their inputs, in single precision, hardly differ.
    for sample in trajectory.samples().filter(|sample| sample.iteration() == 0) {
        sample.restore(&mut component);
        let mut started = dlambda.clone();
        assert!(guess.start_solve(&component, 0, &mut started));
        guess.project(&component, 0, &mut dp, &mut dlambda);
        assert_eq!(started, dlambda, "one prediction for both uses");
        let exact: Vec<Spatial<f64>> = sample.dp().map(|x| Spatial::from_array(x.map(f64::from))).collect();
        // The clamped segment, and so the first edge's sender, looks the same at all times.
        let pairs = [(&dlambda[1..], &component.dlambda[1..]), (&dp, &exact)];
        for (found, exact) in pairs {
            let apart = norm(&mut found.iter().zip(exact).map(|(a, b)| a.plus(*b, -1.0)));
            assert!(apart < 1e-4 * norm(&mut exact.iter().copied()), "{apart}");
        }
    }
}

#[test]
fn simulations_take_the_guess() {
    // Ropes that touch themselves and are held at both ends, and trees in wind, as well as helices.
    for (scenario, steps) in [(Scenario::Helix, 5), (Scenario::Knot, 5), (Scenario::Tree, 2)] {
        let directory = tempfile::tempdir().unwrap();
        let dataset = dataset(directory.path(), scenario);
        let knn = Arc::new(Knn::new(&dataset, Params::default()));
        let scene = scenario.sample(0, 100).scene().unwrap();
        let build = |model: &Model, members: &Members, topology: &Topology| -> Option<Box<dyn InitialGuess>> {
            Some(Box::new(KnnGuess::new(knn.clone(), Graph::new(model, members, topology), None)))
        };
        let settings = Settings { solver: "cg-block-jacobi".parse::<SolverKind>().unwrap(), ..Settings::default() };
        let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, Some(&build)).unwrap();
        for _ in 0..steps {
            simulation.step(0.02).unwrap();
        }
        let counters = simulation.counters();
        assert!(counters.guesses_used >= steps && counters.linear_failures == 0, "{scenario}: {counters:?}");
        assert_eq!(counters.guesses_dropped, 0, "{scenario}");
    }
}

#[test]
fn end_to_end_follows_a_known_motion_and_says_that_it_is_not_exact() {
    let directory = tempfile::tempdir().unwrap();
    let knn = Arc::new(Knn::new(&dataset(directory.path(), Scenario::Rod), Params { every: 1, ..Params::default() }));
    // A trajectory of the training set.
    let scene = Scenario::Rod.sample(0, 2).scene().unwrap();
    let plane = graph::planar_normal(&scene.model, &scene.state);
    assert!(plane.is_some());
    let build = |model: &Model, members: &Members, topology: &Topology| -> Box<dyn Projection> {
        Box::new(KnnGuess::new(knn.clone(), Graph::new(model, members, topology), plane))
    };
    let params = StepParams {
        formulation: Formulation::Xpbd,
        integrator: Integrator::Euler,
        max_iterations: 1,
        ..StepParams::default()
    };
    let mut predicted = Simulation::end_to_end(&scene.model, &scene.state, &params, &build).unwrap();
    let settings = Settings { step: StepParams { max_iterations: 30, ..params }, ..Settings::default() };
    let mut exact = Simulation::new(&scene.model, &scene.state, &settings, None).unwrap();
    let (mut found, mut expected) = (scene.state.clone(), scene.state.clone());
    for _ in 0..10 {
        assert_eq!(predicted.step(0.02).unwrap().status, Status::OutOfIterations);
        exact.step(0.02).unwrap();
    }
    predicted.store(&mut found);
    exact.store(&mut expected);
    let moved = (expected.positions[20] - scene.state.positions[20]).norm();
    let apart = (expected.positions[20] - found.positions[20]).norm();
    assert!(apart < 0.1 * moved, "{apart} of {moved}");
    assert!(found.positions.iter().all(|x| x.y.abs() < 1e-9), "restricted to its plane");
    let counters = predicted.counters();
    assert_eq!((counters.guesses_used, counters.guesses_dropped, counters.not_converged), (10, 0, 10));
    assert!(counters.worst_stretch > 1e-6);
}
