//! A heap of cables: the ground bears it, and no cable is in another.

use cosserat::prelude::*;
use cosserat::simulation::Touched;

/// Squared distance of two lines of numbers `from + s along`, s from 0 to 1, by search: 200 places on the first, the nearest
/// place of the second to each.
fn distance_squared(a: [Vector3<f64>; 2], b: [Vector3<f64>; 2]) -> f64 {
    let (along_a, along_b) = (a[1] - a[0], b[1] - b[0]);
    let at = |k: usize| a[0] + along_a * (k as f64 / 200.0);
    let nearest =
        |p: Vector3<f64>| b[0] + along_b * ((p - b[0]).dot(&along_b) / along_b.norm_squared()).clamp(0.0, 1.0);
    (0..=200).map(|k| (at(k) - nearest(at(k))).norm_squared()).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_ground_bears_a_heap_and_no_cable_is_in_another() {
    let scene = cosserat::scene::builtin("heap-5").unwrap();
    let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
    let (mut state, mut forces) = (scene.state.clone(), Vec::new());
    // Means over the last half second: cables still roll.
    let (mut up, mut steps) = (0.0, 0);
    for step in 1..=scene.run.steps {
        let report = simulation.step(scene.run.dt).unwrap();
        assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
        if step + 50 > scene.run.steps {
            simulation.store_contact_forces(&mut forces);
            let ground = forces.iter().filter(|force| matches!(force.other, Touched::Obstacle(_)));
            up += ground.map(|force| force.force.z).sum::<f64>();
            steps += 1;
        }
    }
    // Places that were near enough to be found, but cannot touch yet, are not looked at.
    let counters = simulation.counters();
    assert!(4 * counters.contacts_left_out > counters.contact_evaluations, "{counters:?}");
    simulation.store(&mut state);
    let segments = &scene.model.segments;
    let weight = segments.iter().map(|segment| segment.mass()).sum::<f64>() * 9.81;
    let share = up / f64::from(steps) / weight;
    println!("the ground bears {share} of the weight");
    assert!((share - 1.0).abs() < 0.01, "{share}");
    let line = |i: usize| {
        let half = state.axis(i) * (0.5 * segments[i].length);
        [state.positions[i] - half, state.positions[i] + half]
    };
    let radius = segments[0].radius;
    let (mut nearest, mut pairs) = (f64::INFINITY, 0);
    for a in 0..segments.len() {
        let low = line(a).map(|end| end.z).into_iter().fold(f64::INFINITY, f64::min);
        assert!(low > 0.999 * radius, "segment {a} is in the ground: {low}");
        for b in (a + 1..segments.len()).filter(|&b| segments[b].rod != segments[a].rod) {
            if (state.positions[a] - state.positions[b]).norm() < segments[a].length + 2.0 * radius {
                nearest = nearest.min(distance_squared(line(a), line(b)));
                pairs += 1;
            }
        }
    }
    let depth = 2.0 - nearest.sqrt() / radius;
    println!("{pairs} pairs looked at, the deepest {depth} radii");
    assert!(pairs > 10 && depth < 1e-3, "{pairs} {depth}");
}

/// Cables that fall on each other turn far in a step, where what is left of the momentum residual may drive them apart: these
/// are steps in which the equations without more had up to 2.9 times the energy of the start.
#[test]
fn a_falling_heap_gains_no_energy() {
    let scene = cosserat::scene::builtin("heap-20").unwrap();
    // Rigid joints have no energy: what is left of their gaps within the tolerance would have some at 1e10 N/m.
    let without_gaps = |energy: &measure::Energy| energy.total() - energy.stretch;
    let start = without_gaps(&measure::energy(&scene.model, &scene.state));
    for dt in [0.0097, 0.01085, 0.0109] {
        let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
        let (mut state, mut before) = (scene.state.clone(), start);
        for step in 1..=32 {
            let report = simulation.step(dt).unwrap();
            assert!(report.status <= Status::ConvergedInSubsteps, "step {step} of {dt} s: {:?}", report.status);
            simulation.store(&mut state);
            let energy = measure::energy(&scene.model, &state);
            let now = without_gaps(&energy);
            assert!(now < before + 0.05 * energy.kinetic, "step {step} of {dt} s: {before} {energy:?}");
            before = now;
        }
        assert!(before < 0.6 * start, "{dt} s: {before} of {start} J");
    }
}

#[test]
fn a_snapshot_amid_steps_in_parts_goes_on_as_if_nothing_had_been() {
    let scene = cosserat::scene::builtin("heap-20").unwrap();
    let step = StepParams { formulation: Formulation::Newton, ..StepParams::default() };
    let settings = Settings { step, ..Settings::default() };
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, None).unwrap();
    // Steps so long that heaps fall through many of them in parts.
    let step = |simulation: &mut Simulation| simulation.step(2.0 * scene.run.dt).unwrap().status;
    // Before the first step that takes parts.
    let snapshot = loop {
        let snapshot = simulation.snapshot();
        if step(&mut simulation) == Status::ConvergedInSubsteps {
            break snapshot;
        }
        assert!(simulation.time() < 1.0, "no step takes parts");
    };
    let go_on = |simulation: &mut Simulation| {
        let before = simulation.counters().retries;
        let steps = [0; 5].map(|_| (step(simulation), simulation.counters().retries - before));
        let mut state = scene.state.clone();
        simulation.store(&mut state);
        (steps, state.positions)
    };
    simulation.restore(&snapshot).unwrap();
    let first = go_on(&mut simulation);
    assert_eq!(first.0[0].0, Status::ConvergedInSubsteps);
    for _ in 0..5 {
        step(&mut simulation);
    }
    simulation.restore(&snapshot).unwrap();
    assert!(go_on(&mut simulation) == first);
}
