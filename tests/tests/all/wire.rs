//! A steel wire that is pushed onto a floor: an elastica between a clamp and a tip that friction holds.

use cosserat::guess::{GuessKind, Members, Topology};
use cosserat::motion::Reaction;
use cosserat::scene;
use cosserat::simulation::{Formulation, Settings, Simulation, Status, contact_wrenches};
use cosserat::state::{JointForce, Model, Quantity, Reading};

/// Length of the wire, its radius, and by how much the clamp at its upper end is lowered [m].
const LENGTH: f64 = 1.0;
const RADIUS: f64 = 1e-3;
const LOWERED: f64 = 0.1;
const SEGMENTS: usize = 60;
/// Young's modulus [Pa] and density [kg/m^3] of steel.
const STEEL: f64 = 2e11;
const DENSITY: f64 = 7850.0;

fn scene() -> scene::Scene {
    // It begins slightly bent to one side, a tenth of a micrometre above the floor.
    let node = |k: usize| {
        let s = k as f64 / SEGMENTS as f64;
        let x = 0.01 * (1.0 - (std::f64::consts::TAU * s).cos());
        format!("[{x}, 0, {}]", RADIUS + 1e-7 + LENGTH * (1.0 - s))
    };
    let nodes = (0..=SEGMENTS).map(node).collect::<Vec<_>>().join(", ");
    let text = format!(
        r#"
        run = {{ dt_s = 0.005, steps = 4000 }}
        damping = {{ linear_per_s = 5, angular_per_s = 5 }}

        [[obstacles]]
        shape.plane = {{}}
        friction = 0.5

        [[rods]]
        name = "wire"
        radius_m = {RADIUS}
        youngs_modulus_pa = {STEEL}
        torsion_modulus_pa = 8e10
        density_kg_m3 = {DENSITY}
        rest = "straight"
        shape.polyline = {{ nodes_m = [{nodes}] }}

        [[rods.motions]]
        at = "start-face"
        times_s = [0, 8]
        shifts_m = [[0, 0, 0], [0, 0, -{LOWERED}]]
        interpolation = "smooth"

        [[probes]]
        name = "tip"
        rod = "wire"
        at = "end-face"
        quantities = ["position"]

        [[probes]]
        name = "clamp"
        rod = "wire"
        at = "start-face"
        quantities = ["reaction"]
        "#
    );
    scene::parse(&text, "wire.toml").unwrap()
}

/// The post-buckled elastica, clamped above, its tip held but free to turn, and shortened by a tenth, pushes with 20.96 B / L^2 along
/// the line between its ends, and across it with .15 to .17 of that. The tip rolls: it stays within what its radius lets it.
#[test]
fn a_wire_that_is_pushed_onto_a_floor_pushes_as_an_elastica() {
    let scene = scene();
    let model = &scene.model;
    let bending = STEEL * std::f64::consts::PI * RADIUS.powi(4) / 4.0;
    let weight = 9.81 * DENSITY * std::f64::consts::PI * RADIUS.powi(2) * LENGTH;
    let mut settings = Settings::default();
    settings.step.formulation = Formulation::Newton;
    let build = |m: &Model, s: &Members, t: &Topology| GuessKind::StepAdaptive.build(m, s, t);
    let mut simulation = Simulation::new(model, &scene.state, &settings, Some(&build)).unwrap();
    let (mut state, mut before) = (scene.state.clone(), scene.state.clone());
    let mut forces = vec![JointForce::default(); model.joints.len()];
    let (mut contact_forces, mut contacts, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for step in 0..scene.run.steps {
        let earlier = simulation.time();
        before.clone_from(&state);
        let status = simulation.step(scene.run.dt).unwrap().status;
        assert_eq!(status, Status::Converged, "step {step}");
        simulation.store(&mut state);
        if step + 1 < scene.run.steps {
            continue;
        }
        simulation.store_joint_forces(&mut forces);
        simulation.store_contact_forces(&mut contact_forces);
        contact_wrenches(&contact_forces, &state, &mut contacts);
        let time = simulation.time();
        let reactions = Reaction::all(model, [&before, &state], [earlier, time], &forces, &contacts);
        let reading = Reading { model, time, state: &state, forces: &forces, reactions: &reactions };
        let mut read = |quantity: Quantity| {
            let probe = scene.probes.iter().find(|probe| probe.quantities.contains(&quantity)).unwrap();
            probe.read(&reading, &mut values);
            [values[0], values[1], values[2]]
        };
        let [x, y, z] = read(Quantity::Position);
        assert!(x.hypot(y) < 1.2e-3 && (z - RADIUS).abs() < 1e-4, "{x} {y} {z}");
        let [across, aside, push] = read(Quantity::Reaction);
        // Half of the weight hangs on the clamp, half stands on the floor, nearly.
        let theory = 20.96 * bending / LENGTH.powi(2) - 0.5 * weight;
        let iterations = simulation.counters().iterations as f64 / scene.run.steps as f64;
        println!("push {push} N of {theory} N, across {across} N, {iterations} iterations a step");
        assert!((push + theory).abs() < 0.02 * theory, "{push} {theory}");
        assert!((0.15..0.17).contains(&(across / push)), "{across} {push}");
        assert!(aside.abs() < 1e-3 * push.abs(), "{aside}");
        assert!(iterations < 1.5, "{iterations}");
    }
}
