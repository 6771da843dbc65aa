//! The builtin scene of a rod inside another one.

use cosserat::prelude::*;
use cosserat::scene;

/// The weight rises by the way by which the wire is pulled, within what the clearance allows, and slowly.
#[test]
fn a_bowden_cable_lifts_a_weight() {
    let scene = scene::builtin("bowden-cable").unwrap();
    let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
    let wire = scene.rods.iter().find(|rod| rod.name == "wire").unwrap().segments.clone();
    let (mut state, mut heights) = (scene.state.clone(), Vec::new());
    for step in 0..scene.run.steps {
        let status = simulation.step(scene.run.dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(&mut state);
        heights.push(state.positions[wire.end - 1].z);
    }
    let raised = heights[heights.len() - 1] - heights[200];
    let clearance = std::f64::consts::PI * scene.model.contacts.sheaths[0].clearance;
    assert!((raised - 0.06).abs() < 2.0 * clearance, "{raised} m");
}
