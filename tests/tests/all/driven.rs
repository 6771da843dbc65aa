//! Builtin scenes that are driven from inside: muscles and jets.

use cosserat::prelude::*;
use cosserat::scene::{self, Scene};

/// Places of a segment after each step.
fn run(scene: &Scene, segment: usize) -> Vec<nalgebra::Vector3<f64>> {
    let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
    let (mut state, mut places) = (scene.state.clone(), Vec::new());
    for step in 0..scene.run.steps {
        let status = simulation.step(scene.run.dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(&mut state);
        places.push(state.positions[segment]);
    }
    places
}

#[test]
fn the_eel_swims_forward_and_stays_at_its_depth() {
    let scene = scene::builtin("eel").unwrap();
    let places = run(&scene, 0);
    let second = places[599] - places[499];
    // In a second it advances by less than its waves run back, 0.4 m, and by more than a quarter of that.
    assert!(second.x < -0.1 && second.x > -0.4, "{second}");
    assert!(places.iter().all(|place| place.z.abs() < 1e-6), "water bears it");
}

#[test]
fn the_hose_whips_about_and_hangs_still_with_a_weak_jet() {
    let scene = scene::builtin("hose").unwrap();
    let last = scene.state.positions.len() - 1;
    let farthest = |places: &[nalgebra::Vector3<f64>]| {
        places[places.len() - 400..].iter().map(|place| place.xy().norm()).fold(0.0, f64::max)
    };
    let whips = farthest(&run(&scene, last));
    assert!(whips > 0.3, "{whips} m");
    let weak =
        scene::builtin_set("hose", &["rods.hose.loads[0].forces_n=[[0, 0, 0], [0, 0, 0.8]]".to_owned()]).unwrap();
    let hangs = farthest(&run(&weak, last));
    assert!(hangs < 0.02, "{hangs} m");
}
