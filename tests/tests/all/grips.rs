//! Builtin scenes with pins and grips that let go, against theory.

use std::f64::consts::{PI, TAU};

use cosserat::assembly::{Damping, Load};
use cosserat::scene;
use cosserat::simulation::{Formulation, Integrator, Settings, Simulation, Status, StepParams};
use cosserat::state::{Body, State, measure};
use nalgebra::Vector3;

#[test]
fn the_pendulum_swings_as_theory_says() {
    let scene = scene::builtin("pendulum").unwrap();
    for formulation in Formulation::ALL {
        let step = StepParams { formulation, integrator: Integrator::Euler, ..StepParams::DEFAULT };
        let settings = Settings { step, ..Settings::default() };
        let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, None).unwrap();
        let mut state = scene.state.clone();
        let last = scene.rods[0].segments.end - 1;
        let (mut before, mut crossings) = (state.positions[last].x, Vec::new());
        for _ in 0..scene.run.steps {
            let time = simulation.time();
            assert_eq!(simulation.step(scene.run.dt).unwrap().status, Status::Converged);
            simulation.store(&mut state);
            let x = state.positions[last].x;
            if before * x < 0.0 {
                crossings.push(time + scene.run.dt * before / (before - x));
            }
            before = x;
        }
        // A slender rod, 2 pi sqrt(2 l / 3 g), and for swings by 10 degrees 1 + angle^2 / 16 of it; implicit Euler takes
        // (w dt)^2 / 3 and lets the swings decay at the rate w^2 dt / 2.
        let period = TAU * (2.0_f64 / (3.0 * 9.81)).sqrt();
        let angle = PI / 18.0;
        let found = crossings[2] - crossings[0];
        let ratio = found / period;
        assert!(ratio > 1.0 && ratio < 1.0 + angle * angle / 16.0 + 1e-3, "{formulation}: {found} s of {period} s");
    }
}

#[test]
fn the_arms_lay_the_cable_down_and_let_it_go() {
    let scene = scene::builtin("two-arms").unwrap();
    let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
    let mut state = scene.state.clone();
    for _ in 0..scene.run.steps {
        simulation.step(scene.run.dt).unwrap();
    }
    simulation.store(&mut state);
    for body in [Body::Anchor(0), Body::Anchor(1)] {
        assert_eq!(simulation.is_held(body), Some(false));
    }
    let mut model = scene.model.clone();
    simulation.store_model(&mut model);
    assert_eq!(model.open, [0, 1]);
    // No part of it is in the ground, at z = -0.6 m, and none is above the arms that it was let go from.
    for (i, x) in state.positions.iter().enumerate() {
        assert!(x.z > -0.595 && x.z < -0.5, "segment {i} at z = {} m", x.z);
    }
    let ends = [0, state.positions.len() - 1].map(|i| state.positions[i].z);
    assert!(ends.iter().all(|z| *z < -0.58 + 1e-3), "the ends have come down: {ends:?}");
}

/// A free bar of mass m in weightlessness is taken by its end. A gripper that is 10 cm off keeps it where it is; one that it
/// snaps to pulls it there by the spring along it, k = 40 N/m: after half a period, pi sqrt(m / k), it is as far beyond.
#[test]
fn what_snaps_is_pulled_to_the_gripper_by_its_springs() {
    let text = |snap: bool| {
        format!(
            "gravity_m_s2 = [0, 0, 0]\n[[rods]]\nradius_m = 0.01\nyoungs_modulus_pa = 1e8\ndensity_kg_m3 = 1000\n\
             shape.straight = {{ length_m = 1, segments = 5 }}\n[[rods.grips]]\nat = \"end-face\"\n\
             stiffness_n_m = [40, 40]\n[[rods.motions]]\nat = \"end-face\"\nfrom_s = 0.1\ntimes_s = [0]\n\
             positions_m = [[1.1, 0, 0]]\nsnap = {snap}\n"
        )
    };
    let mass = 1000.0 * PI * 1e-4;
    let half_period = PI * (mass / 40.0_f64).sqrt();
    for (snap, expected) in [(false, 0.0), (true, 0.2)] {
        let scene = scene::parse(&text(snap), "x.toml").unwrap();
        let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
        let mut state = scene.state.clone();
        let dt = half_period / 1000.0;
        let start = (0.1 / dt).ceil() as usize;
        for _ in 0..start + 1000 {
            assert_eq!(simulation.step(dt).unwrap().status, Status::Converged);
        }
        simulation.store(&mut state);
        let moved = state.positions[0].x - scene.state.positions[0].x;
        println!("snap = {snap}: {moved} m");
        // Implicit Euler damps a swing by w^2 dt / 2 = pi^2 / 2000 of it in half a period, and begins half a step early.
        assert!((moved - expected).abs() < 0.002, "{moved} {expected}");
        assert!(state.positions.iter().all(|x| x.yz().norm() < 1e-9));
    }
}

/// A rod along x that something holds at its start, after so many steps.
fn held(grip: &str, steps: usize) -> State {
    let text = format!(
        "run = {{ dt_s = 0.005, steps = {steps} }}\ndamping = {{ linear_per_s = 5 }}\n[[rods]]\nname = \"rod\"\n\
         radius_m = 0.01\nyoungs_modulus_pa = 1e9\ndensity_kg_m3 = 1000\nshape.straight = {{ length_m = 0.5, segments = 10 \
         }}\n[[rods.grips]]\nat = \"start-face\"\n{grip}\n"
    );
    let scene = scene::parse(&text, "held.toml").unwrap();
    let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
    let mut state = scene.state.clone();
    for step in 0..steps {
        assert_eq!(simulation.step(scene.run.dt).unwrap().status, Status::Converged, "step {step}");
    }
    simulation.store(&mut state);
    state
}

#[test]
fn what_a_hinge_lets_go_falls_as_what_a_clamp_lets_go() {
    let [hinge, clamp] = ["joint = \"hinge\"\nuntil_s = 0.1", "until_s = 0.1"].map(|grip| held(grip, 60));
    for (a, b) in hinge.positions.iter().zip(&clamp.positions) {
        assert!((a - b).norm() < 1e-6, "{a} {b}");
    }
}

/// A spring about the hinge's axis bears the rod's weight: k angle = m g l / 2.
#[test]
fn a_spring_about_a_hinge_bears_the_rod() {
    let state = held("joint = \"hinge\"\naxis = [0, 1, 0]\nstiffness_n_m_rad = [inf, 10]", 600);
    let mass = 1000.0 * PI * 1e-4 * 0.5;
    let expected = 0.5 * mass * 9.81 * 0.5 / 10.0;
    let found = (-state.axis(0).z).asin();
    assert!((found / expected - 1.0).abs() < 0.02, "{found} rad instead of {expected}");
}

/// A stiff bar of 20 cm that springs of 300, 200 and 100 N/m along d1, d2 and d3 hold at one face, where it is pulled; `lines` are
/// the grip's. With the bar's axes as columns, and the place of the face from its segment's centre [m].
fn on_springs(face: &str, lines: &str, force: Vector3<f64>) -> (scene::Scene, nalgebra::Matrix3<f64>, Load) {
    let text = format!(
        "gravity_m_s2 = [0, 0, 0]\n[[rods]]\nradius_m = 0.01\nyoungs_modulus_pa = 1e11\ndensity_kg_m3 = 1000\n\
         shape.straight = {{ direction = [1, 2, -1], length_m = 0.2, segments = 2 }}\n[[rods.grips]]\nat = \"{face}\"\n\
         stiffness_n_m = [300, 200, 100]\n{lines}\n"
    );
    let mut scene = scene::parse(&text, "x.toml").unwrap();
    let axes = scene.state.orientations[0].to_rotation_matrix().into_inner();
    let (segment, offset) = if face == "start-face" { (0, -0.05) } else { (1, 0.05) };
    let load = Load { segment, offset, force: axes * force, torque: Vector3::zeros(), follows: false };
    scene.model.loads.push(load);
    (scene, axes, load)
}

fn to_the_last_digits(formulation: Formulation) -> Settings {
    let (relative_tolerance, absolute_tolerance) = (1e-10, 1e-10);
    let step = StepParams {
        relative_tolerance,
        motion_tolerance: relative_tolerance,
        absolute_tolerance,
        max_iterations: 60,
        formulation,
        ..StepParams::DEFAULT
    };
    Settings { step, ..Settings::default() }
}

/// At rest each spring has yielded by its part of the load over its stiffness, F / k, and holds F^2 / 2 k.
#[test]
fn a_bar_on_three_springs_yields_along_each_by_force_over_stiffness() {
    let (force, stiffness) = (Vector3::new(3.0, -2.0, 1.0), Vector3::new(300.0, 200.0, 100.0));
    let formulation = Formulation::Newton;
    for face in ["start-face", "end-face"] {
        let (mut scene, axes, Load { segment, offset, .. }) = on_springs(face, "", force);
        // The weakest swings at 40 rad/s: about critical.
        scene.model.damping = Damping { linear: 80.0, angular: 80.0 };
        let settings = to_the_last_digits(formulation);
        let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, None).unwrap();
        let mut state = scene.state.clone();
        for _ in 0..400 {
            assert_eq!(simulation.step(0.005).unwrap().status, Status::Converged);
        }
        simulation.store(&mut state);
        let place = |state: &State| state.positions[segment] + state.axis(segment) * offset;
        let yielded = axes.transpose() * (place(&state) - place(&scene.state));
        let expected = force.component_div(&stiffness);
        assert!((yielded - expected).norm() < 1e-6, "{face}, {formulation}: {yielded} {expected}");
        let energy = measure::energy(&scene.model, &state).stretch;
        assert!((energy / (0.5 * force.dot(&expected)) - 1.0).abs() < 1e-4, "{face}, {formulation}: {energy} J");
    }
}

/// What three springs let go is driven by the load alone, F dt a step.
#[test]
fn springs_that_let_go_hold_nothing_back() {
    let (scene, _, load) = on_springs("end-face", "until_s = 0.0975", Vector3::new(3.0, -2.0, 1.0));
    let settings = to_the_last_digits(Formulation::Newton);
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, None).unwrap();
    let (mut before, mut after) = (scene.state.clone(), scene.state.clone());
    for step in 0..60 {
        std::mem::swap(&mut before, &mut after);
        assert_eq!(simulation.step(0.005).unwrap().status, Status::Converged);
        simulation.store(&mut after);
        let momentum = |state| measure::linear_momentum(&scene.model, state);
        let rest = (momentum(&after) - momentum(&before)) / 0.005 - load.force;
        // The first step that begins later than they let go is the 21st.
        assert_eq!(rest.norm() < 1e-6, step >= 20, "step {step}: {rest} N");
    }
}

/// A straight rod bent to a whole circle, whose ends are held with one pose, of which one is then turned about its tangent:
/// it leaves its plane at a twist of 2 pi sqrt(3) B / C (Michell 1889), with B / C = 1 / 2.
#[test]
fn a_ring_that_its_grip_twists_leaves_its_plane_at_michells_angle() {
    let out_of_plane = |ratio: f64| {
        let angle = 360.0 * 3.0_f64.sqrt() * 0.5 * ratio;
        let push = |segment: usize, force: f64| format!("{{ segment = {segment}, force_n = [0, {force}, 0] }}");
        let pushes =
            [(12, 1e-8), (37, -1e-8), (62, 1e-8), (87, -1e-8)].map(|(segment, force)| push(segment, force)).join(", ");
        let text = format!(
            "gravity_m_s2 = [0, 0, 0]\nrun = {{ dt_s = 0.02, steps = 5000 }}\ndamping = {{ linear_per_s = 2 }}\n[[rods]]\nradius_m = \
             0.01\nyoungs_modulus_pa = 1e7\ntorsion_modulus_pa = 1e7\ndensity_kg_m3 = 10\nrest = \"straight\"\nclamp = [\"start-face\", \
             \"end-face\"]\nloads = [{pushes}]\nshape.arc = {{ radius_m = 1, angle_deg = 360, segments = 100 }}\n[[rods.motions]]\nat = \
             \"end-face\"\ntimes_s = [0, 20]\nturns_deg = [[0, 0, 0], [{angle}, 0, 0]]\n"
        );
        let scene = scene::parse(&text, "ring.toml").unwrap();
        let settings = Settings {
            step: StepParams { formulation: Formulation::Newton, ..StepParams::DEFAULT },
            ..Settings::default()
        };
        let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, None).unwrap();
        let mut state = scene.state.clone();
        for step in 0..scene.run.steps {
            assert_eq!(simulation.step(scene.run.dt).unwrap().status, Status::Converged, "step {step}");
        }
        simulation.store(&mut state);
        state.positions.iter().map(|place| place.y.abs()).fold(0.0, f64::max)
    };
    let (below, above) = (out_of_plane(0.99), out_of_plane(1.01));
    println!("out of the plane by {below} m below Michell's angle, by {above} m above");
    assert!(below < 5e-3 && above > 0.1, "{below} m, {above} m");
}
