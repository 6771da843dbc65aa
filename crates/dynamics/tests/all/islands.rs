//! Sets that may touch are islands: what happens in one does not show in another.

use dynamics::formulation::Formulation;
use dynamics::simulation::Simulation;
use dynamics::step::Status;
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::Integrator;
use rod::{Assembly, Contacts, Friction, Model, Obstacle, ObstacleShape, RodSpec, State, Surface, shape};

use crate::common::*;

/// Straight rods: centre, direction and velocity of each; 0.4 m in 8 segments of 1 cm radius, above a rough ground.
fn rods(rods: &[([f64; 3], [f64; 3], [f64; 3])]) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for &(centre, along, velocity) in rods {
        let along = Vector3::from(along).normalize();
        let nodes = shape::straight(Vector3::from(centre) - along * 0.2, along, 0.4, 8);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.01, material(1e6, 500.0)));
        assembly.state_mut().velocities[rod].fill(velocity.into());
    }
    let (mut model, state) = assembly.finish();
    let surface = Surface { friction: Friction::new(0.4), ..Surface::default() };
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    let obstacles = vec![Obstacle::new(ground, surface)];
    model.contacts = Contacts { obstacles, between_segments: Some(surface), ..Contacts::default() };
    (model, state)
}

/// A heap of so many rods, across each other and a little askew, that falls at 8 m/s.
fn heap(count: usize) -> Vec<([f64; 3], [f64; 3], [f64; 3])> {
    let rod = |k: usize| {
        let angle = 1.1 * k as f64;
        ([5.0, 0.0, 0.03 + 0.025 * k as f64], [angle.cos(), angle.sin(), 0.05], [0.0, 0.0, -8.0])
    };
    (0..count).map(rod).collect()
}

/// A simulation on rods that fall, with halvings where they are needed.
fn simulation((model, state): &(Model, State), integrator: Integrator) -> Simulation {
    let mut settings = settings(Formulation::Newton, SolverKind::Direct);
    settings.step.integrator = integrator;
    Simulation::new(model, state, &settings, None).unwrap()
}

/// Poses and velocities of the first segments.
fn first(simulation: &Simulation, state: &State, segments: usize) -> Vec<[f64; 3]> {
    let mut end = state.clone();
    simulation.store(&mut end);
    (0..segments).flat_map(|i| [end.positions[i].into(), end.velocities[i].into()]).collect()
}

/// A rod that falls onto the ground has the same bits with a heap beside it, whose steps are done in parts.
#[test]
fn a_heap_far_away_leaves_a_rod_as_it_is() {
    let one = ([0.0, 0.0, 0.1], [1.0, 0.2, 0.3], [0.0; 3]);
    for integrator in [Integrator::Euler, Integrator::Bdf2] {
        let alone = rods(&[one]);
        let beside = rods(&[vec![one], heap(8)].concat());
        let (mut small, mut large) = (simulation(&alone, integrator), simulation(&beside, integrator));
        let mut statuses = vec![Status::Converged; beside.0.segments.len()];
        for step in 0..60 {
            let status = small.step(DT).unwrap().status;
            large.step(DT).unwrap();
            large.store_statuses(&mut statuses);
            assert_eq!(statuses[0], status, "step {step}");
            assert_eq!(first(&small, &alone.1, 8), first(&large, &beside.1, 8), "step {step}");
        }
        assert!(small.counters().contact_solves > 0, "it comes to lie on the ground");
        let (few, many) = (small.counters(), large.counters());
        assert!(many.retries > few.retries, "the heap's steps are done in parts");
    }
}

/// A rod that flies freely beside a heap takes as many iterations as it takes alone.
#[test]
fn a_rod_that_flies_costs_what_it_costs_alone() {
    let flying = ([0.0, 0.0, 20.0], [1.0, 0.2, 0.3], [0.3, 0.0, 1.0]);
    let iterations = |all: &[([f64; 3], [f64; 3], [f64; 3])]| {
        let mut simulation = simulation(&rods(all), Integrator::Euler);
        (0..40).for_each(|_| _ = simulation.step(DT).unwrap());
        (simulation.counters().iterations, simulation.counters().steps)
    };
    let (together, alone, heap_alone) =
        (iterations(&[heap(8), vec![flying]].concat()), iterations(&[flying]), iterations(&heap(8)));
    assert_eq!(together.0, alone.0 + heap_alone.0);
    assert_eq!(together.1, alone.1 + heap_alone.1);
}

/// Rods side by side that fly five radii in a step, in one direction: the ways of all meet, and they do not.
#[test]
fn rods_that_move_alike_are_not_looked_at() {
    let row = |speeds: [f64; 3]| {
        let rod = |k: usize| ([0.06 * k as f64, 0.0, 20.0], [0.0, 1.0, 0.0], [speeds[k], 0.0, 0.0]);
        rods(&[rod(0), rod(1), rod(2)])
    };
    let fly = |model: (Model, State)| {
        let mut simulation = simulation(&model, Integrator::Euler);
        (0..20).for_each(|_| _ = simulation.step(DT).unwrap());
        let mut end = model.1.clone();
        simulation.store(&mut end);
        (simulation.counters(), [0, 8, 16].map(|rod| end.positions[rod].x))
    };
    let (together, _) = fly(row([2.5; 3]));
    assert_eq!(together.contact_candidates, 0);
    // The first one catches up with the others: it pushes and does not pass.
    let (counters, [first, second, third]) = fly(row([3.0, 2.5, 2.5]));
    assert!(counters.contact_candidates > 0 && counters.contact_solves > 0);
    assert!(first < second && second < third && counters.deepest_penetration < 1e-3, "{first} {second} {third}");
}

/// Two heaps and a rod that flies into one of them, on one thread and on several.
#[test]
fn islands_have_the_same_bits_on_any_number_of_threads() {
    let mut all = heap(12);
    all.extend(heap(12).into_iter().map(|([x, y, z], along, velocity)| ([-x, y, z], along, velocity)));
    all.extend((0..12).map(|k| ([0.0, k as f64, 0.3], [1.0, 0.1, 0.0], [0.0; 3])));
    all.push(([4.0, 0.0, 0.2], [0.0, 1.0, 0.1], [8.0, 0.0, 0.0]));
    let model = rods(&all);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut simulation = simulation(&model, Integrator::Euler);
            (0..25).for_each(|_| _ = simulation.step(DT).unwrap());
            first(&simulation, &model.1, model.0.segments.len())
        })
    };
    assert!(model.0.segments.len() >= 256, "enough to be shared");
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(3));
}

/// A fast rod hits one that lies far outside of the room of the step's first search: both become one island within the step.
#[test]
fn islands_that_meet_within_a_step_become_one() {
    // Clamped at one end, the first rod is swung by its load into the second, which its prediction does not see.
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 0.4, 8);
    let first = assembly.rod(&RodSpec::new(nodes, 0.01, material(1e7, 500.0)));
    let nodes = shape::straight(Vector3::new(0.35, -0.2, 0.05), Vector3::y(), 0.4, 8);
    assembly.rod(&RodSpec::new(nodes, 0.01, material(1e7, 500.0)));
    assembly.state_mut().velocities[first].fill(Vector3::new(0.0, 0.0, 4.0));
    let (mut model, state) = assembly.finish();
    model.contacts = Contacts { between_segments: Some(Surface::default()), ..Contacts::default() };
    let momentum = |state: &State| -> f64 {
        model.segments.iter().zip(&state.velocities).map(|(segment, v)| segment.mass() * v.z).sum()
    };
    let mut simulation = simulation(&(model.clone(), state.clone()), Integrator::Euler);
    let before = momentum(&state);
    let mut end = state.clone();
    for _ in 0..10 {
        simulation.step(DT).unwrap();
        simulation.store(&mut end);
        assert!((momentum(&end) - before).abs() < 1e-6 * before, "{} {before}", momentum(&end));
    }
    assert!(end.velocities[8..].iter().any(|v| v.z > 0.5), "the second one is pushed");
    assert!(simulation.counters().deepest_penetration < 1e-3);
}
