//! Motion against theory: natural frequencies, numerical damping, momenta.

use std::f64::consts::PI;

use acceptance::vibration::bending_mode;
use acceptance::{Beam, assert_order, by_euler, run, tight};
use cosserat::assembly::{Assembly, Damping, RestShape, RodSpec, Section, Stretch, shape};
use cosserat::scene;
use cosserat::simulation::{Formulation, Settings, Simulation, Status};
use cosserat::state::{JointForce, Model, State, measure};
use nalgebra::{UnitQuaternion, Vector3};

/// A decaying oscillation.
struct Oscillation {
    /// Circular frequency [rad/s].
    frequency: f64,
    /// Rate at which the amplitude decays [1/s].
    decay: f64,
}

/// Follows `coordinate` through `half_periods` zero crossings.
fn oscillation(
    model: &Model,
    state: &State,
    dt: f64,
    half_periods: usize,
    coordinate: impl Fn(&State) -> f64,
) -> Oscillation {
    let mut simulation = Simulation::new(model, state, &by_euler(tight()), None).unwrap();
    let mut state = state.clone();
    let (mut crossings, mut peaks, mut peak) = (Vec::new(), Vec::new(), 0.0_f64);
    let mut before = coordinate(&state);
    let mut step = 0;
    while crossings.len() <= half_periods {
        assert_eq!(simulation.step(dt).unwrap().status, Status::Converged);
        simulation.store(&mut state);
        let now = coordinate(&state);
        if before * now < 0.0 {
            crossings.push((step as f64 + before / (before - now)) * dt);
            peaks.push(std::mem::take(&mut peak));
        }
        peak = peak.max(now.abs());
        (before, step) = (now, step + 1);
        assert!(step < 100_000, "no oscillation");
    }
    let time = crossings[half_periods] - crossings[0];
    let decay = (peaks[1] / peaks[half_periods]).ln() / (time / half_periods as f64 * (half_periods - 1) as f64);
    Oscillation { frequency: PI * half_periods as f64 / time, decay }
}

/// Oscillations at three time steps and two discretisations against theory. Implicit Euler turns omega into
/// `atan(omega dt) / dt` and damps at the rate `ln(1 + (omega dt)^2) / 2 dt`.
fn check_mode(case: &str, exact: f64, mode: impl Fn(usize, f64) -> Oscillation) {
    let by_step = [0.1, 0.05, 0.025].map(|phase| (phase, mode(80, phase / exact)));
    let relative = |frequency: f64| frequency / exact - 1.0;
    let errors = by_step.each_ref().map(|(_, found)| relative(found.frequency));
    println!("{case}: relative errors at N = 80, omega dt = 0.1, 0.05, 0.025: {errors:.5?}");
    assert!(errors[1].abs() < 1e-2 && errors[2].abs() < 1e-2, "{case}: {errors:?}");
    for (phase, found) in &by_step {
        let dt = phase / exact;
        let decay = (1.0 + phase * phase).ln() / (2.0 * dt);
        assert!((found.decay / decay - 1.0).abs() < 0.02, "{case}: decay {} instead of {decay}", found.decay);
    }
    // The time step's own error is of second order in the frequency, of first order in the damping.
    let in_time = [0, 1].map(|k| errors[k] - errors[k + 1]);
    assert_order(&format!("{case}, change with omega dt"), &in_time, 2.0);
    let damping = by_step.each_ref().map(|(_, found)| found.decay / exact);
    assert_order(&format!("{case}, numerical damping"), &damping, 1.0);
    // Without it: tan(omega dt) / dt is what the discrete rod does.
    let in_space = [20, 40, 80].map(|segments| {
        let dt = 0.05 / exact;
        relative((mode(segments, dt).frequency * dt).tan() / dt)
    });
    assert_order(&format!("{case}, rod of N = 20, 40, 80"), &in_space, 2.0);
    assert!(in_space[2].abs() < 5e-3);
}

#[test]
fn bending_frequencies_of_a_cantilever() {
    for (mode, beta) in [1.875104, 4.694091, 7.854757].into_iter().enumerate() {
        // So slender that rotary inertia (Rayleigh) lowers no frequency by more than 1e-5.
        let slender = |segments| Beam { radius: 0.001, ..Beam::rubber(segments) };
        let beam = slender(1);
        let exact = beta * beta * (beam.bending() / beam.line_density()).sqrt() / beam.length.powi(2);
        check_mode(&format!("bending mode {}", mode + 1), exact, |segments, dt| {
            let beam = slender(segments);
            let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
            let weights: Vec<f64> = rod.map(|i| bending_mode(beta, (i as f64 + 0.5) / segments as f64).0).collect();
            let small = 1e-4 * beam.length * exact;
            let state = assembly.state_mut();
            for (i, weight) in weights.iter().enumerate() {
                let slope = bending_mode(beta, (i as f64 + 0.5) / segments as f64).1 / beam.length;
                state.velocities[i] = Vector3::z() * (small * weight);
                state.angular_velocities[i] = -Vector3::y() * (small * slope);
            }
            let (model, state) = assembly.finish();
            oscillation(&model, &state, dt, 4, |state| {
                weights.iter().zip(&state.positions).map(|(weight, x)| weight * x.z).sum()
            })
        });
    }
}

#[test]
fn first_torsional_frequency() {
    let beam = Beam::rubber(1);
    let exact = 0.5 * PI / beam.length * (beam.material.torsion_modulus / beam.material.density).sqrt();
    check_mode("torsion", exact, |segments, dt| {
        let beam = Beam::rubber(segments);
        let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
        let weights: Vec<f64> = rod.map(|i| (0.5 * PI * (i as f64 + 0.5) / segments as f64).sin()).collect();
        let state = assembly.state_mut();
        for (i, weight) in weights.iter().enumerate() {
            state.angular_velocities[i] = Vector3::x() * (1e-3 * exact * weight);
        }
        let (model, state) = assembly.finish();
        let rest = state.orientations[0];
        oscillation(&model, &state, dt, 4, |state| {
            weights.iter().zip(&state.orientations).map(|(weight, q)| weight * (rest.inverse() * q).imag().z).sum()
        })
    });
}

/// A taut string between clamped faces. With the speed `c = sqrt(T / m)`, m the mass of a metre as it is stretched, a string has
/// the circular frequencies `n pi c / L`. N rigid segments move as finite elements with linear shapes and their consistent mass
/// do, `c N / L sqrt(6 (1 - cos k) / (2 + cos k))` with `k = n pi / N`, which is higher by k^2 / 24: 3e-4 for n = 3. Where the bending
/// stiffness B holds the ends, over `sqrt(B / T)`, is here a sixteenth of a segment: all of it would raise them by 0.1 %. The
/// time step's share is taken out as in [`check_mode`].
#[test]
fn frequencies_of_a_taut_string() {
    let (strain, segments) = (0.01, 120);
    let beam = Beam { radius: 1e-4, ..Beam::rubber(segments) };
    let stiffness = beam.material.youngs_modulus * Section::Circle { radius: beam.radius }.area();
    let tension = stiffness * strain;
    let mut assembly = Assembly::new(Vector3::zeros());
    let straight = beam.spec(Vector3::zeros(), Vector3::x());
    let string = assembly.rod(&RodSpec { stretch: Stretch::Physical, strains: vec![strain], ..straight });
    assembly.clamp_start(&string).clamp_end(&string);
    let (model, state) = assembly.finish();
    assert!((model.anchors[1].position - model.anchors[0].position - Vector3::x()).norm() < 1e-12);

    let (simulation, end) = run(&model, &state, &tight(), 1e-3, 1);
    let mut forces = vec![JointForce::default(); model.joints.len()];
    simulation.store_joint_forces(&mut forces);
    for (force, joint) in forces.iter().zip(&model.joints) {
        let pull = force.tension(&model, &end, joint);
        assert!((pull / tension - 1.0).abs() < 1e-6, "{pull} N instead of {tension} N");
    }

    for n in [1.0, 2.0, 3.0] {
        let speed = (tension * (1.0 + strain) / beam.line_density()).sqrt();
        let cos = (n * PI / segments as f64).cos();
        let exact = speed * segments as f64 * (6.0 * (1.0 - cos) / (2.0 + cos)).sqrt();
        assert!((exact / (n * PI * speed) - 1.0).abs() < 3e-4);
        let (mut state, small, dt) = (state.clone(), 1e-5 * exact, 0.02 / exact);
        let phase = |i: usize| n * PI * (i as f64 + 0.5) / segments as f64;
        for i in string.clone() {
            state.velocities[i] = Vector3::z() * (small * phase(i).sin());
            state.angular_velocities[i] = -Vector3::y() * (small * n * PI * phase(i).cos());
        }
        let found = oscillation(&model, &state, dt, 4, |state| {
            state.positions.iter().enumerate().map(|(i, x)| phase(i).sin() * x.z).sum()
        });
        let error = (found.frequency * dt).tan() / dt / exact - 1.0;
        println!("taut string, n = {n}: {error:.1e}");
        assert!(error.abs() < 2e-4, "n = {n}: {error}");
    }
}

/// A rigid bar that swings about its end: omega^2 = m g (l / 2) / (m l^2 / 3 + m r^2 / 4).
#[test]
fn compound_pendulum() {
    let (gravity, beam) = (9.81, Beam { radius: 0.05, ..Beam::rubber(1) });
    let exact = (gravity * 0.5 / (1.0 / 3.0 + 0.25 * beam.radius.powi(2))).sqrt();
    let errors = [0.04, 0.02, 0.01].map(|phase| {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -gravity));
        let rod = assembly.rod(&beam.spec(Vector3::zeros(), -Vector3::z()));
        assembly.clamp_start(&rod);
        assembly.model_mut().joints[0].bend_compliance *= 1e12;
        let small = 1e-4;
        let state = assembly.state_mut();
        state.velocities[0] = Vector3::x() * (0.5 * small);
        state.angular_velocities[0] = -Vector3::y() * small;
        let (model, state) = assembly.finish();
        oscillation(&model, &state, phase / exact, 4, |state| state.positions[0].x).frequency / exact - 1.0
    });
    assert_order("compound pendulum", &errors, 2.0);
    assert!(errors[2].abs() < 1e-4);
}

/// A rod that is bent against its rest shape, flies, spins and swings, with nothing to hold on to.
pub(crate) fn flying(gravity: Vector3<f64>) -> (Model, State) {
    let mut assembly = Assembly::new(gravity);
    let nodes = shape::helix(Vector3::new(0.3, -0.2, 0.1), 0.4, 0.5, 0.7, 20);
    assembly.rod(&RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, 0.02, Beam::rubber(1).material) });
    let spin = Vector3::new(3.0, -2.0, 4.0);
    let state = assembly.state_mut();
    for i in 0..state.len() {
        state.velocities[i] = Vector3::new(0.5, 0.2, -0.3) + spin.cross(&state.positions[i]);
        state.angular_velocities[i] = spin + state.axis(i) * 2.0;
    }
    assembly.finish()
}

#[test]
fn linear_momentum_is_kept_to_rounding() {
    let (model, state) = flying(Vector3::zeros());
    let before = measure::linear_momentum(&model, &state);
    for formulation in Formulation::ALL {
        let mut settings = Settings::default();
        settings.step.formulation = formulation;
        let (_, end) = run(&model, &state, &settings, 0.01, 100);
        let change = (measure::linear_momentum(&model, &end) - before).norm() / before.norm();
        println!("linear momentum, {formulation}: relative change {change:.1e}");
        assert!(change < 1e-12, "{formulation}: {change}");
    }
}

/// Angular momentum about the origin, with the segments' share as the discrete free motion keeps it:
/// `(2 / dt) R (s I u - u x I u)` for the last step's relative rotation (s, u) (Moser and Veselov 1991).
pub(crate) fn discrete_angular_momentum(model: &Model, state: &State, dt: f64) -> Vector3<f64> {
    let of_segment = |i: usize| {
        let (segment, q) = (&model.segments[i], state.orientations[i]);
        let w = state.angular_velocities[i];
        let half = 0.5 * dt * w.norm();
        let u = q.inverse() * w * if half > 0.0 { 0.5 * dt * half.sin() / half } else { 0.0 };
        let s = (1.0 - u.norm_squared()).sqrt();
        let round = Vector3::new(segment.transverse_inertia(), segment.transverse_inertia(), segment.axial_inertia());
        let turning = u.component_mul(&segment.body.as_ref().map_or(round, |body| body.inertia));
        let spin = q * (turning * s - u.cross(&turning)) * (2.0 / dt);
        state.positions[i].cross(&state.velocities[i]) * segment.mass() + spin
    };
    (0..state.len()).map(of_segment).sum()
}

#[test]
fn angular_momentum_drifts_at_first_order() {
    let (model, state) = flying(Vector3::zeros());
    let before = measure::angular_momentum(&model, &state);
    for formulation in Formulation::ALL {
        let drifts = [200, 400, 800, 1600].map(|steps| {
            let dt = 0.5 / steps as f64;
            let mut settings = by_euler(tight());
            settings.step.formulation = formulation;
            let (_, end) = run(&model, &state, &settings, dt, steps);
            (discrete_angular_momentum(&model, &end, dt) - before).norm() / before.norm()
        });
        assert_order(&format!("angular momentum over 0.5 s, dt = 2.5 ms and halves, {formulation}"), &drifts, 1.0);
    }
}

#[test]
fn a_free_segment_keeps_its_angular_momentum_to_rounding() {
    // A needle, and a disc: transverse inertia larger and smaller than the axial one.
    for (length, radius) in [(1.0, 0.02), (0.1, 0.5)] {
        for spin in [Vector3::new(1.0, 2.0, 3.0), Vector3::new(25.0, -10.0, 20.0)] {
            let mut assembly = Assembly::new(Vector3::zeros());
            let beam = Beam { length, radius, ..Beam::rubber(1) };
            assembly.rod(&beam.spec(Vector3::zeros(), Vector3::new(1.0, 0.3, -0.2)));
            assembly.state_mut().angular_velocities[0] = spin;
            let (model, state) = assembly.finish();
            for (dt, steps) in [(0.02, 1), (0.02, 1000)] {
                let before = discrete_angular_momentum(&model, &state, dt);
                let (_, end) = run(&model, &state, &by_euler(Settings::default()), dt, steps);
                let change = (discrete_angular_momentum(&model, &end, dt) - before).norm() / before.norm();
                println!("free segment l = {length}, r = {radius}, |w| dt = {:.2}: {change:.1e}", spin.norm() * dt);
                assert!(change < 1e-11, "l = {length}, w = {spin:?}, {steps} steps: {change}");
            }
        }
    }
}

#[test]
fn free_fall_is_exact() {
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let (dt, steps) = (0.01, 100);
    for formulation in Formulation::ALL {
        let mut assembly = Assembly::new(gravity);
        assembly.rod(&RodSpec::new(shape::helix(Vector3::zeros(), 0.4, 0.5, 1.5, 20), 0.02, Beam::rubber(1).material));
        let thrown = Vector3::new(1.0, 2.0, 3.0);
        assembly.state_mut().velocities.fill(thrown);
        let (model, state) = assembly.finish();
        let mut settings = by_euler(Settings::default());
        settings.step.formulation = formulation;
        let (_, end) = run(&model, &state, &settings, dt, steps);
        // Symplectic Euler: sum of g dt^2 k for k = 1 .. n.
        let (n, time) = (steps as f64, dt * steps as f64);
        let path = thrown * time + gravity * (0.5 * dt * dt * n * (n + 1.0));
        for i in 0..state.len() {
            assert!((end.positions[i] - state.positions[i] - path).norm() < 1e-12);
            assert!((end.velocities[i] - thrown - gravity * time).norm() < 1e-10);
            assert!(end.orientations[i].angle_to(&state.orientations[i]) < 1e-7);
        }
    }
}

#[test]
fn damping_decays_at_its_rate() {
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&Beam::rubber(10).spec(Vector3::zeros(), Vector3::x()));
    assembly.damping(Damping { linear: 3.0, angular: 0.0 });
    assembly.state_mut().velocities.fill(Vector3::new(1.0, -2.0, 0.5));
    let (model, state) = assembly.finish();
    let (_, end) = run(&model, &state, &by_euler(Settings::default()), 0.01, 50);
    for v in &end.velocities {
        assert!((v / (-1.5_f64).exp() - Vector3::new(1.0, -2.0, 0.5)).norm() < 1e-11);
    }

    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&Beam::rubber(1).spec(Vector3::zeros(), Vector3::x()));
    assembly.damping(Damping { linear: 0.0, angular: 3.0 });
    assembly.state_mut().angular_velocities[0] = Vector3::new(20.0, 5.0, -7.0);
    let (model, state) = assembly.finish();
    let dt = 0.01;
    let before = discrete_angular_momentum(&model, &state, dt);
    let (_, end) = run(&model, &state, &by_euler(Settings::default()), dt, 50);
    let change = discrete_angular_momentum(&model, &end, dt) / (-1.5_f64).exp() - before;
    assert!(change.norm() < 1e-11 * before.norm(), "{change}");
}

/// However fast a free segment spins, it neither gains nor loses; beyond half a turn a step, the step is divided.
#[test]
fn a_fast_spin_keeps_its_energy() {
    for spin in [30.0, 60.0, 99.0, 150.0, 1000.0] {
        let mut assembly = Assembly::new(Vector3::zeros());
        assembly.rod(&Beam { length: 0.1, radius: 0.05, ..Beam::rubber(1) }.spec(Vector3::zeros(), Vector3::x()));
        assembly.state_mut().angular_velocities[0] = Vector3::new(0.0, spin, 0.0);
        let (model, state) = assembly.finish();
        let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).expect("a valid model");
        for _ in 0..20 {
            let status = simulation.step(0.02).expect("a valid step").status;
            let is_told = spin * 0.02 < std::f64::consts::PI;
            assert_eq!(status, if is_told { Status::Converged } else { Status::ConvergedInSubsteps });
        }
        let mut end = state.clone();
        simulation.store(&mut end);
        let change = measure::energy(&model, &end).kinetic / measure::energy(&model, &state).kinetic - 1.0;
        println!("free segment, {spin} rad/s: energy changes by {change:.1e}");
        assert!(change.abs() < 1e-9, "{spin} rad/s: {change}");
    }
}

/// A rod that only spins about a fixed axis as one piece shows the rate of its segments' spins.
#[test]
fn a_rod_that_spins_about_its_axis_keeps_spinning() {
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&Beam::rubber(10).spec(Vector3::zeros(), Vector3::x()));
    assembly.state_mut().angular_velocities.fill(Vector3::x() * 10.0);
    let (model, state) = assembly.finish();
    let dt = 0.01;
    let (_, end) = run(&model, &state, &tight(), dt, 100);
    for i in 0..state.len() {
        assert!((end.angular_velocities[i] - Vector3::x() * 10.0).norm() < 1e-9);
        let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 100.0 * 10.0 * dt) * state.orientations[i];
        assert!(end.orientations[i].angle_to(&turned) < 1e-7);
    }
}

/// Steps of a rod of two segments, one of them fixed, the other one turned about the rod by 310 degrees; and their statuses.
fn past_half_a_turn(more: &str, of_rod: &str) -> Vec<Status> {
    let text = format!(
        "gravity_m_s2 = [0, 0, 0]\n{more}\n[[rods]]\nname = \"rod\"\nradius_m = 0.01\nyoungs_modulus_pa = 1e7\nfixed_segments = [0]\n\
         shape.straight = {{ direction = [1, 0, 0], length_m = 0.2, segments = 2 }}\n{of_rod}\n[[rods.motions]]\nat = \"end-segment\"\n\
         times_s = [0, 0.6]\nturns_deg = [[0, 0, 0], [310, 0, 0]]\ninterpolation = \"linear\"\n"
    );
    let scene = scene::parse(&text, "turned.toml").expect("a scene");
    let mut simulation =
        Simulation::new(&scene.model, &scene.state, &by_euler(Settings::default()), None).expect("a model");
    (0..60).map(|_| simulation.step(0.01).expect("a step").status).collect()
}

/// Where a strain begins again on the other side, so that a turn is lost, the status of that step says so, alone, in lanes, and where it may touch. By the
/// paper's measure, whose moment is zero there, only where its energy jumps.
#[test]
fn a_joint_past_half_a_turn_shows_where_its_energy_jumps() {
    let told = |more: &str, of_rod: &str| {
        let statuses = past_half_a_turn(more, of_rod);
        let past: Vec<usize> = (0..statuses.len()).filter(|&k| statuses[k] == Status::PastHalfTurn).collect();
        let others = statuses.iter().filter(|status| **status != Status::PastHalfTurn);
        assert!(others.clone().all(|status| *status == Status::Converged), "{more} {of_rod}: {statuses:?}");
        past
    };
    let shifts: Vec<String> = (1..8).map(|k| format!("[0, {k}, 0]")).collect();
    let copies = format!("copies = [{{ rods = [\"rod\"], shifts_m = [{}] }}]", shifts.join(", "));
    for more in ["", &copies, "contact = {}"] {
        assert_eq!(told(&format!("bending = \"paper\"\n{more}"), ""), [0; 0], "{more}");
        for of_rod in [
            "",
            "rest = { darboux_per_m = [0, 0, 3] }",
            "inner_damping = { twist_s = 0.01 }",
            "yield = { moment_n_m = 1, torque_n_m = 1 }",
        ] {
            assert_eq!(told(more, of_rod), [34], "{more} {of_rod}");
        }
    }
}
