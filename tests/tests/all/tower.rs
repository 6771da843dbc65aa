//! The shipped tower stands: 20 layers of round rods that only friction holds.

use cosserat::scene;
use cosserat::simulation::{Settings, Simulation, Status, StepParams, Touched};
use cosserat::state::State;

/// Layers of the tower, and the radius of its rods [m].
const LAYERS: f64 = 20.0;
const RADIUS: f64 = 0.005;

/// The way of the segment that has moved furthest from one state to another, along each axis [m].
fn moved(from: &State, to: &State) -> [f64; 3] {
    let ways = || from.positions.iter().zip(&to.positions).map(|(a, b)| (b - a).abs());
    [0, 1, 2].map(|axis| ways().map(|way| way[axis]).fold(0.0, f64::max))
}

/// Round rods are rollers: nothing but the contacts' tolerance holds a layer that rolls on the one below. A step may leave an error
/// of the tolerance in each layer, and what rolls keeps rolling.
#[test]
fn a_tower_of_twenty_layers_stands() {
    let scene = scene::builtin("tower").unwrap();
    let model = &scene.model;
    let weight = model.gravity.norm() * model.segments.iter().map(|s| s.mass()).sum::<f64>();
    // How long it takes to come to rest at the start is another matter: from one tolerance near 1e-5 to the next, means of outer
    // iterations are from 2.9 to 4.4.
    for (contact_tolerance, middle, most) in [(1e-3, 2.0, 3.0), (1e-5, 3.0, 5.0)] {
        let step = StepParams { contact_tolerance, ..StepParams::default() };
        let settings = Settings { step, ..Settings::default() };
        let mut simulation = Simulation::new(model, &scene.state, &settings, None).unwrap();
        let (mut state, mut forces, mut up) = (scene.state.clone(), Vec::new(), 0.0);
        let (mut iterations, mut before) = (Vec::new(), 0);
        for step in 1..=scene.run.steps {
            let status = simulation.step(scene.run.dt).unwrap().status;
            assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
            let all = simulation.counters().segment_iterations;
            iterations.push((all - before) as f64 / model.segments.len() as f64);
            before = all;
            simulation.store_contact_forces(&mut forces);
            let ground = forces.iter().filter(|force| matches!(force.other, Touched::Obstacle(_)));
            up += ground.map(|force| force.force.z).sum::<f64>() / weight / scene.run.steps as f64;
        }
        simulation.store(&mut state);
        let [x, y, z] = moved(&scene.state, &state);
        let mean = iterations.iter().sum::<f64>() / iterations.len() as f64;
        let median = *iterations.select_nth_unstable_by(scene.run.steps / 2, f64::total_cmp).1;
        println!(
            "tolerance {contact_tolerance}: {up:.4} of the weight, moved by {x:.1e}, {y:.1e}, {z:.1e} m, {median} outer iterations, {mean:.2} in the mean"
        );
        assert!((up - 1.0).abs() < 0.005, "{up}");
        // Each layer sinks by the tolerance at most; sag is a hundred times less.
        assert!(z < 1.1 * LAYERS * contact_tolerance * RADIUS, "{z}");
        let error = LAYERS * contact_tolerance * RADIUS * scene.run.steps as f64;
        assert!(x.max(y) < 2.0 * error, "{x} {y}");
        assert!(median <= middle && mean < most, "{median} {mean}");
    }
}
