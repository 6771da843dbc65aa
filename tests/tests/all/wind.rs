//! Rods in air against theory, and what wind must never do.

use acceptance::{Beam, run, tight};
use cosserat::assembly::{Air, Assembly, Damping, Gusts, Material, Wind};
use cosserat::simulation::{Formulation, Settings, Simulation, Status};
use cosserat::state::{Model, State, measure};
use evaluation::stress;
use nalgebra::Vector3;

const GRAVITY: f64 = 9.81;

/// Air at rest.
fn still(normal_drag: f64, tangential_drag: f64) -> Air {
    Air { density: 1.2, normal_drag, tangential_drag, wind: Wind::steady(Vector3::zeros()) }
}

#[test]
fn rods_fall_at_their_terminal_speed() {
    let beam = |segments| Beam {
        length: 0.3,
        radius: 0.002,
        material: Material { youngs_modulus: 1e9, torsion_modulus: 1e9, density: 300.0 },
        segments,
    };
    for segments in [1, 10] {
        for (direction, which) in [(Vector3::x(), "across"), (Vector3::z(), "along")] {
            for dt in [0.005, 0.02, 0.1] {
                let beam = beam(segments);
                let air = still(1.1, 0.05);
                let drag = if which == "across" { air.normal_drag } else { air.tangential_drag };
                let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -GRAVITY));
                assembly.rod(&beam.spec(Vector3::zeros(), direction));
                assembly.air(air);
                let (model, state) = assembly.finish();
                let profile = 1.2 * drag * 2.0 * beam.radius * beam.length;
                let weight = beam.line_density() * beam.length * GRAVITY;
                let expected = (2.0 * weight / profile).sqrt();
                // In 5 v / g the speed tanh(g t / v) v comes within 1e-4 of v.
                let steps = (5.0 * expected / GRAVITY / dt) as usize;
                let (_, end) = run(&model, &state, &Settings::default(), dt, steps);
                for v in &end.velocities {
                    let error = v.norm() / expected - 1.0;
                    assert!(error.abs() < 0.01, "{segments} segments, {which}, dt = {dt}: {error}");
                    assert!((v / v.norm() + Vector3::z()).norm() < 1e-6, "{v}");
                }
            }
        }
    }
}

/// Horizontal force of the air on a model at rest [N], by the formula.
fn drag_force(model: &Model, state: &State, wind: Vector3<f64>) -> f64 {
    let air = model.air.as_ref().unwrap();
    let of = |i: usize| {
        let segment = &model.segments[i];
        let axis = state.axis(i);
        let along = axis * wind.dot(&axis);
        let across = wind - along;
        let c = air.density * segment.radius * segment.length;
        (across * (across.norm() * air.normal_drag) + along * (along.norm() * air.tangential_drag)) * c
    };
    (0..model.segments.len()).map(of).sum::<Vector3<f64>>().dot(&wind.normalize())
}

/// Drag [N] on an upright rod, clamped at its foot, that steady wind of a speed [m/s] has bent.
fn bent_drag(beam: &Beam, speed: f64) -> f64 {
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::z()));
    let wind = Vector3::x() * speed;
    assembly.clamp_start(&rod).air(Air { wind: Wind::steady(wind), ..still(1.0, 0.0) });
    // Only that it comes to rest.
    assembly.damping(Damping { linear: 2.0, angular: 0.0 });
    let (model, state) = assembly.finish();
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
    let mut end = state.clone();
    for _ in 0..6000 {
        simulation.step(0.002).unwrap();
    }
    simulation.store(&mut end);
    let fastest = end.velocities.iter().map(|v| v.norm()).fold(0.0, f64::max);
    assert!(fastest < 1e-3 * speed, "still moving at {fastest} m/s in {speed} m/s");
    drag_force(&model, &end, wind)
}

/// Large deflections make drag grow as U^(2 + V) with the Vogel exponent V = -2/3 (Alben, Shelley and Zhang 2002).
#[test]
fn flexible_rods_reconfigure() {
    let slope = |beam: &Beam, speed: f64| {
        let ratio: f64 = 1.1;
        (bent_drag(beam, speed * ratio) / bent_drag(beam, speed / ratio)).ln() / (2.0 * ratio.ln())
    };
    let material = Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 20.0 };
    let beam = Beam { length: 1.0, radius: 0.001, material, segments: 100 };
    // Cauchy number rho C U^2 r L^3 / B.
    let speed = |cauchy: f64| (cauchy * beam.bending() / (1.2 * beam.radius * beam.length.powi(3))).sqrt();
    let flexible = slope(&beam, speed(1e4));
    let stiff = slope(&beam, speed(1e-2));
    println!("slopes: flexible {flexible:.4}, stiff {stiff:.4}");
    assert!((flexible - 4.0 / 3.0).abs() < 0.05, "{flexible}");
    assert!((stiff - 2.0).abs() < 0.02, "{stiff}");
}

/// A flexible rod that swings down from its clamp, as light as its drag counts.
fn swinging(segments: usize) -> Assembly {
    let beam = Beam {
        radius: 0.003,
        material: Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 200.0 },
        ..Beam::rubber(segments)
    };
    beam.cantilever(Vector3::new(0.0, 0.0, -GRAVITY)).0
}

#[test]
fn air_at_rest_only_takes_energy() {
    for formulation in Formulation::ALL {
        for dt in [0.002, 0.02] {
            let mut assembly = swinging(30);
            assembly.air(still(1.1, 0.05));
            let (model, mut state) = assembly.finish();
            let mut settings = tight();
            settings.step.formulation = formulation;
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            let energy = |state: &State| measure::energy(&model, state).total();
            let at_stake = model.segments.iter().map(|s| s.mass()).sum::<f64>() * GRAVITY;
            let mut before = energy(&state);
            for step in 0..(2.0 / dt) as usize {
                simulation.step(dt).unwrap();
                simulation.store(&mut state);
                let now = energy(&state);
                assert!(now - before < 1e-9 * at_stake, "{formulation}, dt = {dt}, step {step}: {before} J to {now} J");
                before = now;
            }
        }
    }
}

/// The stability table's tree of 70 rods.
fn tree() -> (Model, State) {
    let case = stress::cases().into_iter().find(|case| case.name.starts_with("70-rod tree")).unwrap();
    (case.model, case.state)
}

/// A hair of 0.1 mm, clamped upright.
fn hair() -> (Model, State) {
    let keratin = Material { youngs_modulus: 4e9, torsion_modulus: 1e9, density: 1300.0 };
    let beam = Beam { length: 0.2, radius: 5e-5, material: keratin, segments: 40 };
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -GRAVITY));
    let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::z()));
    assembly.clamp_start(&rod);
    assembly.finish()
}

fn gale() -> Wind {
    let gusts = Gusts { strength: 0.3, length: 2.0, time: 1.0, seed: 3 };
    Wind::new(Vector3::new(60.0, 0.0, 0.0), Some(gusts), None)
}

/// Newton alone does not solve every step of the hair, and says so: in 0.02 s the air passes it six times.
#[test]
fn storms_break_nothing() {
    for (name, (mut model, first)) in [("tree", tree()), ("hair", hair())] {
        for wind in [Wind::steady(Vector3::x() * 60.0), gale()] {
            for formulation in Formulation::ALL {
                model.air = Some(Air { wind: wind.clone(), ..still(1.1, 0.01) });
                let mut state = first.clone();
                let lengths = measure::rod_lengths(&model, &state);
                let mut settings = Settings::default();
                settings.step.formulation = formulation;
                let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
                for step in 0..20 {
                    let status = simulation.step(0.02).unwrap().status;
                    let is_stubborn = name == "hair" && formulation == Formulation::Newton;
                    let worst = if is_stubborn { Status::OutOfIterations } else { Status::ConvergedInSubsteps };
                    assert!(status <= worst, "{name}, {formulation}, step {step}: {status:?}");
                    simulation.store(&mut state);
                    let fastest = state.velocities.iter().map(|v| v.norm()).fold(0.0, f64::max);
                    assert!(fastest < 120.0, "{name}, {formulation}, step {step}: {fastest} m/s");
                    let drift = measure::length_drift(&model, &state, &lengths);
                    let allowed = if status == Status::OutOfIterations { 1e-2 } else { 1e-4 };
                    assert!(drift < allowed, "{name}, {formulation}, step {step}: {drift}, {status:?}");
                }
            }
        }
    }
}

#[test]
fn wind_has_the_same_bits_on_any_number_of_threads() {
    let mut many = Assembly::new(Vector3::new(0.0, 0.0, -GRAVITY));
    for k in 0..30 {
        let beam = Beam { radius: 0.002 + 1e-4 * f64::from(k), ..Beam::rubber(10 + k as usize % 2) };
        let rod = many.rod(&beam.spec(Vector3::y() * f64::from(k), Vector3::x()));
        many.fix(rod.start);
    }
    many.air(Air { wind: gale(), ..still(1.1, 0.01) });
    let (model, state) = many.finish();
    let end = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
            for step in 0..20 {
                let status = simulation.step(0.01).unwrap().status;
                // Thin rods in a gale lose turns of their twist.
                assert!(status.is_solved(), "step {step}: {status:?}");
            }
            let mut end = state.clone();
            simulation.store(&mut end);
            end
        })
    };
    assert_eq!(end(1), end(2));
}

/// Halved steps see the wind of their own time: two steps of half the length are what one that gives up comes to.
#[test]
fn halved_steps_see_the_wind_of_their_time() {
    let mut assembly = swinging(20);
    assembly.air(Air { wind: Wind::new(Vector3::x() * 30.0, None, Some(0.05)), ..still(1.1, 0.01) });
    let (model, state) = assembly.finish();
    let end = |halvings, dt: f64, steps| {
        let mut settings = Settings::default();
        // Out of reach: every step goes to rounding, none converges, and all that may be halved are.
        (settings.step.relative_tolerance, settings.step.absolute_tolerance, settings.step.motion_tolerance) =
            (1e-300, 1e-300, 1e-300);
        settings.step.max_iterations = 200;
        settings.step.max_halvings = halvings;
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        for _ in 0..steps {
            simulation.step(dt).unwrap();
        }
        let mut state = state.clone();
        simulation.store(&mut state);
        (state, simulation.counters().retries)
    };
    let (halved, retries) = end(1, 0.02, 10);
    let (short, _) = end(0, 0.01, 20);
    assert_eq!(retries, 10);
    for (x, y) in halved.positions.iter().zip(&short.positions) {
        assert!((x - y).norm() < 1e-9, "{x} {y}");
    }
}

#[test]
fn no_air_no_drag() {
    let (model, state) = swinging(10).finish();
    let (simulation, _) = run(&model, &state, &Settings::default(), 0.01, 10);
    let counters = simulation.counters();
    assert_eq!((counters.drag_evaluations, counters.times.drag), (0, std::time::Duration::ZERO));
    let mut assembly = swinging(10);
    assembly.air(still(0.0, 0.0));
    let (model, state) = assembly.finish();
    let (simulation, _) = run(&model, &state, &Settings::default(), 0.01, 10);
    assert_eq!(simulation.counters().drag_evaluations, 100);
    assert!(!simulation.counters().times.drag.is_zero());
}
