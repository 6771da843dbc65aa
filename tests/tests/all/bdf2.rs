//! Integrator `bdf2`: what keeps its energy, at which order errors fall, and that nothing blows up.

use acceptance::{Beam, end_of, order, relaxed, run, tight};
use cosserat::assembly::{
    Assembly, BodyShape, Contacts, Friction, Load, Material, Obstacle, ObstacleShape, RigidBody, RodSpec, Surface,
    shape,
};
use cosserat::scene;
use cosserat::simulation::{Formulation, Integrator, Settings, Simulation, Status};
use cosserat::state::{Model, Pose, State, measure};
use nalgebra::{Complex, UnitQuaternion, Vector3};

use crate::bodies::{self, brick};
use crate::dynamics::flying;

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

fn settings(formulation: Formulation, integrator: Integrator) -> Settings {
    let mut settings = Settings::default();
    (settings.step.formulation, settings.step.integrator) = (formulation, integrator);
    settings
}

/// A rope of 2 m in 20 segments, straight, its first segment fixed, `angle_deg` from hanging.
fn rope(angle_deg: f64) -> Assembly {
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 4e5, density: 1000.0 };
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    let nodes = shape::straight(Vector3::zeros(), Vector3::new(sin, 0.0, -cos), 2.0, 20);
    let mut assembly = Assembly::new(GRAVITY);
    let rope = assembly.rod(&RodSpec::new(nodes, 0.01, material));
    assembly.fix(rope.start);
    assembly
}

/// What is left of the energy above that of rest after `duration` [s].
fn energy_kept(angle_deg: f64, settings: &Settings, dt: f64, duration: f64) -> f64 {
    let mut rope = rope(angle_deg);
    *rope.model_mut() = settings.step.formulation.measured(rope.model_mut()).into_owned();
    let (_, state) = rope.clone().finish();
    let (model, rest) = relaxed(rope);
    let energy = |state: &State| measure::energy(&model, state).total() - measure::energy(&model, &rest).total();
    let (_, end) = run(&model, &state, settings, dt, (duration / dt).round() as usize);
    energy(&end) / energy(&state)
}

#[test]
fn a_rope_that_swings_keeps_its_energy() {
    for formulation in Formulation::ALL {
        let kept = Integrator::ALL.map(|integrator| energy_kept(30.0, &settings(formulation, integrator), 0.01, 10.0));
        println!(
            "{formulation}: of the energy of a swing of 30 degrees euler keeps {:.4}, bdf2 {:.4}",
            kept[0], kept[1]
        );
        assert!(kept[1] >= 0.99 && kept[1] <= 1.0 && kept[0] < 0.5, "{formulation}: {kept:?}");
    }
}

#[test]
fn a_rope_that_falls_from_horizontal_goes_as_with_short_steps() {
    let (model, state) = rope(90.0).finish();
    let tip = |integrator, dt: f64| {
        let mut settings = settings(Formulation::Newton, integrator);
        (settings.step.relative_tolerance, settings.step.motion_tolerance) = (1e-8, 1e-8);
        let (_, end) = run(&model, &state, &settings, dt, (0.6 / dt).round() as usize);
        end.positions[model.segments.len() - 1]
    };
    let fine = tip(Integrator::Bdf2, 0.000_625);
    let [euler, bdf2] = Integrator::ALL.map(|integrator| (tip(integrator, 0.01) - fine).norm());
    println!(
        "released horizontally, after 0.6 s: the tip of euler is off by {euler:.4} m, that of bdf2 by {bdf2:.4} m"
    );
    assert!(bdf2 < 0.5 * euler && bdf2 < 0.02, "{euler}, {bdf2}");
    // The tip whips within this second; what that puts into the fastest waves is damped.
    for formulation in Formulation::ALL {
        let [euler, bdf2] =
            Integrator::ALL.map(|integrator| energy_kept(90.0, &settings(formulation, integrator), 0.01, 1.0));
        println!("{formulation}: of the energy of the fall euler keeps {euler:.3} in a second, bdf2 {bdf2:.3}");
        assert!(bdf2 > 0.97 && bdf2 < 1.0 && euler < 0.8, "{formulation}: {euler}, {bdf2}");
    }
}

/// A cantilever that falls from straight.
fn cantilever() -> (Model, State) {
    // Of few segments, whose fastest waves the coarsest steps follow.
    Beam::rubber(5).cantilever(GRAVITY).0.finish()
}

/// A short rod in a few segments, hung by its first one, that swings in circles.
fn pendulum() -> (Model, State) {
    let mut assembly = rope(30.0);
    let state = assembly.state_mut();
    for i in 0..state.len() {
        let lever = state.positions[i].norm();
        state.velocities[i] = Vector3::y() * lever;
    }
    assembly.finish()
}

/// Differences of the final positions between runs whose steps are halved; a run is of `first` times as many steps as
/// `pattern` has, whose parts say how long each is.
fn differences(
    (model, state): &(Model, State),
    settings: &Settings,
    duration: f64,
    first: usize,
    pattern: &[f64],
) -> [f64; 3] {
    let whole: f64 = pattern.iter().sum();
    let ends = [0, 1, 2, 3].map(|k| {
        let rounds = first << k;
        let mut simulation = Simulation::new(model, state, settings, None).expect("a valid model");
        for part in pattern.iter().cycle().take(rounds * pattern.len()) {
            let status = simulation.step(duration * part / (whole * rounds as f64)).expect("a valid step").status;
            assert_eq!(status, Status::Converged);
        }
        let mut end = state.clone();
        simulation.store(&mut end);
        end.positions
    });
    [0, 1, 2].map(|k| ends[k].iter().zip(&ends[k + 1]).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max))
}

#[test]
fn errors_fall_with_the_square_of_the_time_step() {
    let scenes = [("a cantilever that falls", cantilever()), ("a rope that swings in circles", pendulum())];
    for (case, scene) in &scenes {
        for formulation in Formulation::ALL {
            for (integrator, [least, most]) in [(Integrator::Euler, [0.85, 1.15]), (Integrator::Bdf2, [1.9, 2.2])] {
                let mut settings = tight();
                (settings.step.formulation, settings.step.integrator) = (formulation, integrator);
                let found = differences(scene, &settings, 0.5, 200, &[1.0]);
                let orders = [order(found[0], found[1]), order(found[1], found[2])];
                println!("{case}, {formulation}, {integrator}: {found:?} m, orders {orders:?}");
                assert!(orders.iter().all(|order| (least..=most).contains(order)), "{case}, {formulation}: {orders:?}");
            }
        }
    }
}

#[test]
fn so_they_do_where_steps_change_their_length() {
    let mut settings = tight();
    (settings.step.formulation, settings.step.integrator) = (Formulation::Newton, Integrator::Bdf2);
    let found = differences(&pendulum(), &settings, 0.5, 50, &[1.0, 0.5, 0.5, 0.9, 1.7, 1.2]);
    let orders = [order(found[0], found[1]), order(found[1], found[2])];
    println!("steps of changing length: {found:?} m, orders {orders:?}");
    assert!(orders.iter().all(|order| *order > 1.85), "{orders:?}");
}

#[test]
fn what_flies_and_bends_keeps_its_angular_momentum() {
    let (model, state) = flying(Vector3::zeros());
    let before = measure::angular_momentum(&model, &state);
    for formulation in Formulation::ALL {
        let [euler, bdf2] = Integrator::ALL.map(|integrator| {
            let mut settings = tight();
            (settings.step.formulation, settings.step.integrator) = (formulation, integrator);
            [100_usize, 400].map(|steps| {
                let (_, end) = run(&model, &state, &settings, 0.5 / steps as f64, steps);
                let momentum = (measure::angular_momentum(&model, &end) - before).norm() / before.norm();
                let energy = measure::energy(&model, &end).total() / measure::energy(&model, &state).total() - 1.0;
                [momentum, energy]
            })
        });
        println!("a rod that tumbles, {formulation}, changes of momentum and energy: euler {euler:?}, bdf2 {bdf2:?}");
        for (euler, bdf2) in euler.iter().zip(bdf2) {
            assert!(bdf2[0] < 0.05 * euler[0], "{formulation}: {euler:?}, {bdf2:?}");
            assert!(bdf2[1] <= 0.0 && bdf2[1] > 0.3 * euler[1], "{formulation}: {euler:?}, {bdf2:?}");
        }
        // Four times as many steps; the formulations without the momentum residual are of first order in this.
        let least = if formulation.momentum() { 8.0 } else { 2.0 };
        assert!(bdf2[1][0] < bdf2[0][0] / least, "{formulation}: {bdf2:?}");
    }
}

#[test]
fn a_free_top_keeps_energy_and_momentum() {
    // It precesses; true rates are of second order, and those of Euler's rule of first.
    let mut errors = [[0.0; 2]; 2];
    for (k, integrator) in Integrator::ALL.into_iter().enumerate() {
        for (n, steps) in [100_usize, 200].into_iter().enumerate() {
            let mut assembly = Assembly::new(Vector3::zeros());
            assembly.rod(&Beam { length: 0.1, radius: 0.02, ..Beam::rubber(1) }.spec(Vector3::zeros(), Vector3::x()));
            assembly.state_mut().angular_velocities[0] = Vector3::new(10.0, 8.0, 3.0);
            let (model, state) = assembly.finish();
            let settings = settings(Formulation::Newton, integrator);
            let (_, end) = run(&model, &state, &settings, 1.0 / steps as f64, steps);
            let momentum = |state: &State| measure::angular_momentum(&model, state);
            errors[k][n] = (momentum(&end) - momentum(&state)).norm() / momentum(&state).norm();
            let change = measure::energy(&model, &end).total() / measure::energy(&model, &state).total() - 1.0;
            println!("a free top, {integrator}, {steps} steps: momentum {:.1e}, energy {change:.1e}", errors[k][n]);
            assert!(change.abs() < 0.1 * errors[0][n].max(1e-3), "{integrator}: {change}");
        }
    }
    let orders = errors.map(|[coarse, fine]| order(coarse, fine));
    assert!(orders[0] > 0.9 && orders[1] > 1.9 && errors[1][0] < 0.2 * errors[0][0], "{errors:?}, {orders:?}");
}

#[test]
fn a_free_body_with_three_moments_keeps_energy_and_momentum_to_second_order() {
    // It tumbles about all its axes; true rates are of second order, and those of Euler's rule of first.
    let orientation = UnitQuaternion::from_euler_angles(0.3, -0.4, 1.0);
    let mut assembly = Assembly::new(Vector3::zeros());
    let body = assembly.body(brick(3.0), Pose { position: Vector3::zeros(), orientation });
    assembly.state_mut().angular_velocities[body] = orientation * Vector3::new(2.0, 3.0, 6.0);
    let (model, state) = assembly.finish();
    let before = (measure::angular_momentum(&model, &state), measure::energy(&model, &state).total());
    let errors = Integrator::ALL.map(|integrator| {
        [200_usize, 400].map(|steps| {
            let (_, end) = run(&model, &state, &settings(Formulation::Newton, integrator), 1.0 / steps as f64, steps);
            let momentum = (measure::angular_momentum(&model, &end) - before.0).norm() / before.0.norm();
            let energy = (measure::energy(&model, &end).total() / before.1 - 1.0).abs();
            [momentum, energy]
        })
    });
    println!("a brick that tumbles, changes of momentum and energy: euler {:?}, bdf2 {:?}", errors[0], errors[1]);
    let [euler, [coarse, fine]] = errors;
    assert!(order(coarse[0], fine[0]) > 1.9 && order(coarse[1], fine[1]) > 1.8, "{errors:?}");
    assert!(coarse[0] < 0.1 * euler[0][0] && coarse[1] < 1e-3, "{errors:?}");
}

#[test]
fn bodies_on_a_rod_go_on_to_second_order() {
    // A brick and a ball at the ends of a soft rod, thrown and spinning.
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&Beam::rubber(10).spec(Vector3::zeros(), Vector3::x()));
    let ball = RigidBody::new(BodyShape::Sphere { radius: 0.1 }, 0.3);
    for (body, segment, fraction, x) in [(brick(0.5), rod.start, 0.0, -0.1), (ball, rod.end - 1, 1.0, 1.1)] {
        let pose = Pose { position: Vector3::x() * x, orientation: UnitQuaternion::identity() };
        let body = assembly.body(body, pose);
        assembly.join_body(segment, fraction, body, &(Vector3::x() * (fraction - x)));
    }
    let spin = Vector3::new(0.4, 1.0, 2.0);
    let state = assembly.state_mut();
    for i in 0..state.len() {
        state.velocities[i] = Vector3::new(1.0, -2.0, 3.0) + spin.cross(&state.positions[i]);
        state.angular_velocities[i] = spin;
    }
    let scene = assembly.finish();
    let mut settings = tight();
    (settings.step.formulation, settings.step.integrator) = (Formulation::Newton, Integrator::Bdf2);
    let found = differences(&scene, &settings, 0.5, 100, &[1.0]);
    let orders = [order(found[0], found[1]), order(found[1], found[2])];
    println!("two bodies on a rod: {found:?} m, orders {orders:?}");
    assert!(orders.iter().all(|order| (1.9..=2.1).contains(order)), "{orders:?}");
}

#[test]
fn a_body_on_a_stick_swings_as_the_rule_says() {
    for (axis, formulation) in [(Vector3::x(), Formulation::Newton), (Vector3::y(), Formulation::Newton)] {
        let (model, state, exact) = bodies::pendulum(brick(2.0), Vector3::z() * 0.125, axis * 0.01);
        let (dt, steps) = (0.1 / exact, 600_i32);
        // An oscillation exp(i w t) becomes z^n with (3/2 - i w dt) z^2 - 2 z + 1/2 = 0.
        let a = Complex::new(1.5, -exact * dt);
        let z = (Complex::new(1.0, 0.0) + (Complex::new(1.0, 0.0) - a * 0.5).sqrt()) / a;
        let rest = measure::energy(&model, &state).total() - measure::energy(&model, &state).kinetic;
        let across = axis.cross(&Vector3::z());
        let [euler, bdf2] = Integrator::ALL.map(|integrator| {
            let mut settings = tight();
            (settings.step.formulation, settings.step.integrator) = (formulation, integrator);
            let mut simulation = Simulation::new(&model, &state, &settings, None).expect("a valid model");
            let mut now = state.clone();
            let (mut crossings, mut before, mut first) = (Vec::new(), 0.0, 0.0);
            for step in 0..steps + 20 {
                assert_eq!(simulation.step(dt).expect("a valid step").status, Status::Converged);
                simulation.store(&mut now);
                let here = now.positions[1].dot(&across);
                if before * here < 0.0 {
                    crossings.push(f64::from(step) + before / (before - here));
                }
                before = here;
                // It begins with a step of Euler's rule.
                if step == 19 {
                    first = measure::energy(&model, &now).total() - rest;
                }
            }
            let turns = crossings.len() as f64 - 1.0;
            let phase = turns * std::f64::consts::PI / (crossings[crossings.len() - 1] - crossings[0]);
            let kept = (measure::energy(&model, &now).total() - rest) / first;
            (phase, kept)
        });
        let lost = 1.0 - z.norm().powi(2 * steps);
        println!(
            "{formulation}: phase {} rad a step, rule {}; of the energy it loses {} and euler {}, rule {lost}",
            bdf2.0,
            z.arg(),
            1.0 - bdf2.1,
            1.0 - euler.1
        );
        assert!((bdf2.0 / z.arg() - 1.0).abs() < 1e-4, "{formulation}: {} rad", bdf2.0);
        assert!(((1.0 - bdf2.1) / lost - 1.0).abs() < 0.1, "{formulation}: {bdf2:?}");
        assert!(bdf2.1 > 0.95 && euler.1 < 0.05, "{formulation}: {bdf2:?}, {euler:?}");
    }
}

#[test]
fn what_bounces_gains_no_energy() {
    for restitution in [1.0, 0.5, 0.0] {
        for formulation in Formulation::ALL {
            for (segments, tilt) in [(1, 0.0), (5, 0.3)] {
                let mut assembly = Assembly::new(GRAVITY);
                let nodes = shape::straight(Vector3::new(0.0, 0.0, 0.5), Vector3::new(1.0, 0.0, tilt), 0.5, segments);
                assembly.rod(&RodSpec::new(nodes, 0.02, Beam::rubber(1).material));
                let surface = Surface { friction: Friction::new(0.3), restitution };
                let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
                assembly.model_mut().contacts =
                    Contacts { obstacles: vec![Obstacle::new(ground, surface)], ..Contacts::default() };
                let (model, state) = assembly.finish();
                let settings = settings(formulation, Integrator::Bdf2);
                let mut simulation = Simulation::new(&model, &state, &settings, None).expect("a valid model");
                let (mut now, mut highest, mut apex) = (state.clone(), 0.0_f64, 0.0_f64);
                let first = measure::energy(&model, &state).total();
                let mut bounced = false;
                for _ in 0..300 {
                    assert!(simulation.step(0.01).expect("a valid step").status <= Status::ConvergedInSubsteps);
                    simulation.store(&mut now);
                    highest = highest.max(measure::energy(&model, &now).total());
                    bounced |= now.positions[0].z < 0.1;
                    apex = apex.max(if bounced { now.positions[0].z } else { 0.0 });
                }
                println!(
                    "bounce {restitution}, {formulation}, {segments}: {highest:.4} of {first:.4} J, up to {apex:.3} m"
                );
                assert!(highest <= first * 1.001, "{restitution}, {formulation}, {segments}: {highest} of {first}");
                if (segments, restitution) == (1, 1.0) {
                    assert!(apex > 0.4, "it comes back: {apex}");
                }
            }
        }
    }
}

/// A ball on a smooth floor, pushed by 1 N a kilogram: the steps of Euler's rule that follow the impact begin with the
/// velocities that they end with.
#[test]
fn what_slides_after_an_impact_is_pushed_once() {
    let mut assembly = Assembly::new(GRAVITY);
    let pose = Pose { position: Vector3::z() * 0.05, orientation: UnitQuaternion::identity() };
    let ball = assembly.body(RigidBody::new(BodyShape::Sphere { radius: 0.05 }, 1.0), pose);
    assembly.load(Load { segment: ball, offset: 0.0, force: Vector3::x(), torque: Vector3::zeros(), follows: false });
    let floor = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    let smooth = Surface { friction: Friction::new(0.0), restitution: 0.0 };
    assembly.model_mut().contacts = Contacts { obstacles: vec![Obstacle::new(floor, smooth)], ..Contacts::default() };
    let (model, state) = assembly.finish();
    let (_, state) = run(&model, &state, &settings(Formulation::Newton, Integrator::Bdf2), 0.005, 200);
    let (place, speed) = (state.positions[ball].x, state.velocities[ball].x);
    // The steps of Euler's rule lead by half a step's velocity each.
    assert!((speed - 1.0).abs() < 1e-6 && (place - 0.5).abs() < 1e-4, "{place} m, {speed} m/s");
}

/// A rod of `segments` held at its start, straight along x, that ends in a mass of `tip` [kg] and is thrown at `speed` [m/s].
fn held(segments: usize, radius: f64, youngs_modulus: f64, tip: f64, speed: f64) -> (Model, State) {
    let material = Material { youngs_modulus, torsion_modulus: 0.4 * youngs_modulus, density: 1000.0 };
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 2.0, segments);
    let rod = assembly.rod(&RodSpec::new(nodes, radius, material));
    assembly.fix(rod.start).add_mass(rod.end - 1, tip);
    for v in &mut assembly.state_mut().velocities[1..] {
        *v = Vector3::new(-1.0, 0.3, 1.0) * speed;
    }
    assembly.finish()
}

#[test]
fn a_thin_rod_that_tumbles_does_not_spin_about_itself() {
    // A segment is a hundred times as light to turn about its axis as across it.
    let (model, state) = held(20, 0.005, 1e8, 0.0, 3.0);
    let formulation = Formulation::Xpbd;
    let fastest = |dt: f64| {
        let settings = settings(formulation, Integrator::Bdf2);
        let mut simulation = Simulation::new(&model, &state, &settings, None).expect("a valid model");
        let (mut now, mut fastest) = (state.clone(), 0.0_f64);
        for _ in 0..(1.0 / dt) as usize {
            simulation.step(dt).expect("a valid step");
            simulation.store(&mut now);
            let spins =
                now.angular_velocities.iter().zip(&now.orientations).map(|(w, q)| w.dot(&(q * Vector3::z())).abs());
            fastest = fastest.max(spins.fold(0.0, f64::max));
        }
        fastest
    };
    let [coarse, fine] = [0.02, 0.001].map(fastest);
    println!("{formulation}: spin about the axis up to {coarse:.2} rad/s, with short steps {fine:.2} rad/s");
    assert!(coarse < 2.0 * fine, "{formulation}: {coarse}, {fine}");
}

#[test]
fn nothing_blows_up() {
    for (case, (model, state)) in [
        ("a hanging chain", held(40, 0.01, 1e4, 0.0, 0.0)),
        ("a stiff rod, thrown", held(30, 0.02, 1e10, 0.0, 10.0)),
        ("a soft rod, thrown", held(30, 0.02, 1e4, 0.0, 10.0)),
        ("a heavy end", held(30, 0.01, 1e6, 1e3, 0.0)),
        ("a heavier end", held(30, 0.01, 1e6, 1e5, 0.0)),
    ] {
        let formulation = Formulation::Newton;
        for dt in [0.1, 0.03, 0.01, 0.003] {
            let settings = settings(formulation, Integrator::Bdf2);
            let mut simulation = Simulation::new(&model, &state, &settings, None).expect("a valid model");
            let mut now = state.clone();
            let first = measure::energy(&model, &state);
            // What lies 2 m deeper, or what moves: either is at stake.
            let mass: f64 = model.segments.iter().map(|segment| segment.mass()).sum();
            let scale = first.kinetic + 2.0 * 9.81 * mass;
            for step in 0..(3.0 / dt) as usize {
                let status = simulation.step(dt).expect("a valid step").status;
                // What is thrown may lose a turn of its twist.
                assert!(status.is_solved(), "{case}, {formulation}, {dt}, {step}: {status:?}");
                simulation.store(&mut now);
                let gain = (measure::energy(&model, &now).total() - first.total()) / scale;
                assert!(gain < 1e-6, "{case}, {formulation}, dt = {dt}, step {step}: {gain:e}");
            }
            let drift = measure::length_drift(&model, &now, &measure::rod_lengths(&model, &state));
            assert!(drift < 0.01, "{case}, {formulation}, dt = {dt}: {drift}");
        }
    }
}

/// A scene of one rod along x without gravity that begins to turn about z at a rate [rad/s], `rest` its other keys.
fn turning(rate: f64, length: f64, dt: f64, rest: &str) -> scene::Scene {
    const SEGMENTS: usize = 20;
    let velocity = |k: usize| {
        let speed = rate * length / SEGMENTS as f64 * (k as f64 + 0.5);
        format!("{{ segment = {k}, velocity_m_s = [0, {speed}, 0], angular_velocity_rad_s = [0, 0, {rate}] }}")
    };
    let velocities = (0..SEGMENTS).map(velocity).collect::<Vec<_>>().join(", ");
    let text = format!(
        "gravity_m_s2 = [0, 0, 0]\nrun.dt_s = {dt}\n[[rods]]\nshape.straight = {{ direction = [1, 0, 0], length_m = {length}, \
         segments = {SEGMENTS} }}\nvelocities = [{velocities}]\n{rest}"
    );
    scene::parse(&text, "turning.toml").unwrap()
}

/// The state after so long [s] with the settings that programs have by default.
fn by_default(scene: &scene::Scene, duration: f64) -> State {
    run(&scene.model, &scene.state, &Settings::default(), scene.run.dt, (duration / scene.run.dt).round() as usize).1
}

/// Euler's rule leaves 2.6 m/s of 4.9 at 20 ms.
#[test]
fn a_ball_on_a_rope_orbits_at_its_speed_by_default() {
    let rest = "radius_m = 0.01\nyoungs_modulus_pa = 1e6\ndensity_kg_m3 = 300\nmasses = [{ segment = -1, mass_kg = 1 }]\n\
                grips = [{ at = \"start-face\", joint = \"ball\" }]";
    for (dt, allowed) in [(0.02, 6e-3), (0.005, 5e-4)] {
        let scene = turning(2.5, 2.0, dt, rest);
        let [start, end] = [&scene.state, &by_default(&scene, 10.0)].map(|state| state.velocities[19].norm());
        println!("dt {dt}: {end} m/s of {start}");
        assert!((end / start - 1.0).abs() < allowed, "{dt}: {end} {start}");
    }
}

/// Kane, Ryan and Banerjee (1987): a beam that is brought to a constant rate in 15 s is straight from there on, and longer by
/// `rho A w^2 L^3 / 3 E A`. Euler's rule bends it back by more than a metre.
#[test]
fn a_beam_that_is_turned_is_straight_by_default() {
    let (rate, length, line_density, stretch) = (6.0_f64, 10.0_f64, 1.2, 2.8e7);
    let (speeding, duration) = (15.0_f64, 20.0);
    let turn = |t: f64| {
        let (s, period) = (t.min(speeding), std::f64::consts::TAU / speeding);
        rate / speeding * (0.5 * s * s + ((period * s).cos() - 1.0) / period.powi(2)) + rate * (t - s)
    };
    let keys: Vec<f64> = (0..=220).map(|k| 0.1 * f64::from(k)).collect();
    // Each from the one before.
    let by = |&t: &f64| turn(t) - turn((t - 0.1).max(0.0));
    let turns: Vec<String> = keys.iter().map(|t| format!("[0, 0, {}]", by(t).to_degrees())).collect();
    let rest = format!(
        "radius_m = 0.05\nstretch = \"physical\"\nsection.stiffness = {{ bending_n_m2 = [1.4e4, 1.4e4], torsion_n_m2 = 1.4e4, \
         mass_kg_m = {line_density}, polar_inertia_kg_m = 1.2e-3, stretch_n = {stretch}, shear_n = 1e7 }}\n\
         motions = [{{ at = \"start-face\", times_s = {keys:?}, turns_deg = [{}], interpolation = \"smooth\" }}]",
        turns.join(", ")
    );
    let scene = turning(0.0, length, 0.01, &rest);
    let end = by_default(&scene, duration);
    let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn(duration));
    let tip = turned.inverse() * end_of(&scene.model, &end, 19);
    let longer = line_density * rate.powi(2) * length.powi(3) / (3.0 * stretch);
    println!("tip {tip}, longer by {} m, theory {longer}", tip.norm() - length);
    assert!(tip.y.abs() < 0.01 && tip.z.abs() < 1e-9, "{tip}");
    assert!((tip.norm() - length - longer).abs() < 0.01 * longer, "{} {longer}", tip.norm() - length);
}
