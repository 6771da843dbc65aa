//! The builtin scenes of rods that run over pulleys.

use cosserat::prelude::*;
use cosserat::scene;
use cosserat::state::OnPulley;

fn run(name: &str) -> (Scene, Vec<(State, Vec<OnPulley>)>) {
    let scene = scene::builtin(name).unwrap();
    let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
    let (mut state, mut on) = (scene.state.clone(), vec![OnPulley::default(); scene.model.pulleys.len()]);
    let mut seen = Vec::new();
    for step in 0..scene.run.steps {
        let status = simulation.step(scene.run.dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "{name}, step {step}: {status:?}");
        simulation.store(&mut state);
        simulation.store_pulleys(&mut on);
        seen.push((state.clone(), on.clone()));
    }
    (scene, seen)
}

fn segments(scene: &Scene, name: &str) -> std::ops::Range<usize> {
    scene.rods.iter().find(|rod| rod.name == name).unwrap().segments.clone()
}

/// The weight sinks four times as far as the block rises.
#[test]
fn a_weight_hoists_a_block_by_four_parts() {
    let (scene, seen) = run("block-and-tackle");
    let (block, rope) = (segments(&scene, "block").start, segments(&scene, "rope"));
    let height = |state: &State, i: usize| state.positions[i].z - scene.state.positions[i].z;
    let (end, _) = &seen[seen.len() - 1];
    let (raised, sunk) = (height(end, block), height(end, rope.end - 1));
    assert!(raised > 0.05, "{raised} m");
    assert!((sunk / raised + 4.0).abs() < 0.04, "{sunk} m, {raised} m");
    // a = g (4 m - M) / (M + 16 m), from when gravity is whole.
    let rate = |k: usize| height(&seen[k + 1].0, block) - height(&seen[k].0, block);
    let dt = scene.run.dt;
    let found = (rate(450) - rate(150)) / (300.0 * dt * dt);
    let theory = 9.81 * (24.0 - 20.0) / (20.0 + 16.0 * 6.0);
    assert!((found / theory - 1.0).abs() < 0.2, "{found} m/s^2, {theory} m/s^2");
}

/// The sheave takes the car up by its rim's way, without slip, and bears the difference of the weights.
#[test]
fn a_sheave_raises_a_car() {
    let (scene, seen) = run("elevator");
    let car = segments(&scene, "car").start;
    let (end, on) = &seen[seen.len() - 1];
    let way = 0.3 * 2.0 * (0.4 + 1.0 + 0.4);
    let raised = end.positions[car].z - scene.state.positions[car].z;
    assert!((raised / way - 1.0).abs() < 0.01, "{raised} m, {way} m");
    assert!((on[0].turned * 0.3 / way - 1.0).abs() < 0.01, "{} rad", on[0].turned);
}
