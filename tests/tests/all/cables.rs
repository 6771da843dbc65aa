//! Hung cables and plucked strings of scene files against theory.

use std::f64::consts::PI;

use acceptance::tight;
use cosserat::assembly::Section;
use cosserat::scene::{self, Scene};
use cosserat::simulation::{Formulation, Simulation, Status};
use cosserat::state::{JointForce, State};
use cosserat::statics::{StaticParams, equilibrium};
use nalgebra::Vector3;

/// The scene at rest, and what its joints transmit then.
fn at_rest(mut scene: Scene) -> (Scene, Vec<JointForce>) {
    let report = equilibrium(&scene.model, &mut scene.state, &StaticParams::default()).unwrap();
    assert!(report.converged, "{report:?}");
    // A short step of implicit Euler from rest moves nothing and says what the joints transmit.
    let mut settings = tight();
    settings.step.formulation = Formulation::Newton;
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, None).unwrap();
    simulation.step(1e-3).unwrap();
    let mut forces = vec![JointForce::default(); scene.model.joints.len()];
    simulation.store_joint_forces(&mut forces);
    (scene, forces)
}

/// Parameter a of the catenary `z = a cosh(x / a)` of a length between ends that are `d` [m] apart along x and `h` in height:
/// `sqrt(length^2 - h^2) = 2 a sinh(d / 2 a)`, by bisection.
fn parameter(length: f64, d: f64, h: f64) -> f64 {
    let along = (length * length - h * h).sqrt();
    let (mut low, mut high) = (0.01 * d, 1e4 * d);
    for _ in 0..200 {
        let a = (low * high).sqrt();
        *(if 2.0 * a * (0.5 * d / a).sinh() > along { &mut low } else { &mut high }) = a;
    }
    low
}

#[test]
fn a_hung_cable_has_the_sag_and_the_tension_of_the_catenary() {
    let first = scene::builtin("hung-cable").unwrap();
    let (length, d, h) = (22.0, 20.0, 3.0);
    let a = parameter(length, d, h);
    // From the lowest point to the start: tanh((x_start + x_end) / 2 a) = h / length.
    let middle = a * (h / length).atanh();
    let (start, end) = (middle - 0.5 * d, middle + 0.5 * d);
    let height = |x: f64| a * (x / a).cosh();
    let lowest = a - height(start);
    let segment = &first.model.segments[0];
    let weight = segment.density * Section::Circle { radius: segment.radius }.area() * 9.81;

    let (scene, forces) = at_rest(first.clone());
    let found = scene.state.positions.iter().map(|x| x.z).fold(0.0, f64::min);
    assert!((found / lowest - 1.0).abs() < 1e-3, "{found} m, a catenary {lowest} m");
    let joints = scene.model.joints_of(&scene.rods[0].segments);
    for (joint, x) in [(joints[0], start), (joints[joints.len() - 1], end)] {
        let (pull, tension) = (forces[joint].force.norm(), weight * height(x));
        assert!((pull / tension - 1.0).abs() < 1e-3, "{pull} N, a catenary {tension} N");
    }
    // It starts there already, but for what its bending stiffness changes.
    let moved =
        first.state.positions.iter().zip(&scene.state.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(moved < 2e-3, "{moved} m");
}

#[test]
fn a_cable_that_is_too_short_pulls_as_its_strain_says() {
    let text = "gravity_m_s2 = [0, 0, 0]\n[[rods]]\nstretch = \"physical\"\nradius_m = 0.01\nyoungs_modulus_pa = 1e9\n\
                clamp = [\"start-face\", \"end-face\"]\n\
                shape.hung = { from_m = [0, 0, 1], to_m = [3, 4, 1], length_m = 4.9, segments = 20 }";
    let (scene, forces) = at_rest(scene::parse(text, "taut.toml").unwrap());
    let expected = 1e9 * Section::Circle { radius: 0.01 }.area() * (5.0 / 4.9 - 1.0);
    for (force, joint) in forces.iter().zip(&scene.model.joints) {
        let pull = force.tension(&scene.model, &scene.state, joint);
        assert!((pull / expected - 1.0).abs() < 1e-6, "{pull} N, not {expected} N");
    }
    for (anchor, end) in scene.model.anchors.iter().zip([Vector3::z(), Vector3::new(3.0, 4.0, 1.0)]) {
        assert!((anchor.position - end).norm() < 1e-12);
    }
    let mass: f64 = scene.model.segments.iter().map(|segment| segment.mass()).sum();
    assert!((mass / (100.0 * Section::Circle { radius: 0.01 }.area() * 4.9) - 1.0).abs() < 1e-12);
}

/// Two cables that cross, in tension: they begin in balance.
#[test]
fn taut_cables_that_are_joined_where_they_cross_stay_there() {
    let cable = |name: &str, start: &str, direction: &str| {
        format!(
            "[[rods]]\nname = \"{name}\"\nstretch = \"physical\"\nstrain = 0.05\nyoungs_modulus_pa = 1e7\nradius_m = 0.01\n\
             clamp = [\"start-face\", \"end-face\"]\n\
             shape.straight = {{ length_m = 2, segments = 25, start_m = {start}, direction = {direction} }}\n"
        )
    };
    let text = format!(
        "gravity_m_s2 = [0, 0, 0]\n{}{}[[joins]]\na = {{ rod = \"x\", segment = 12, fraction = 0.5 }}\n\
         b = {{ rod = \"y\", segment = 12, fraction = 0.5 }}",
        cable("x", "[-1, 0, 0]", "[1, 0, 0]"),
        cable("y", "[0, -1, 0]", "[0, 1, 0]")
    );
    let before = scene::parse(&text, "cross.toml").unwrap();
    let (scene, _) = at_rest(before.clone());
    for (a, b) in before.state.positions.iter().zip(&scene.state.positions) {
        assert!((a - b).norm() < 1e-9, "{a} {b}");
    }
}

/// The first mode of a plucked string, from its zero crossings after it was let go: `sqrt(T / m) / 2 L`, m being the mass of a
/// metre as it is stretched. The wire's bending stiffness raises it by no more than `2 sqrt(B / T) / L`, 0.2 %.
#[test]
fn a_plucked_string_sounds_at_its_pitch() {
    let Scene { model, mut state, run, .. } = scene::builtin("plucked-string").unwrap();
    let segment = &model.segments[0];
    let section = Section::Circle { radius: segment.radius };
    let (tension, length) = (73.0, 0.65);
    let strain = tension / (2e11 * section.area());
    let pitch = 0.5 / length * (tension * (1.0 + strain) / (segment.density * section.area())).sqrt();
    let stiff = 2.0 * (2e11 * section.second_moments()[0] / tension).sqrt() / length;
    assert!(stiff < 2.5e-3, "{stiff}");
    assert!((pitch - 331.0).abs() < 1.0, "{pitch} Hz: the description is wrong");

    let mut simulation = Simulation::new(&model, &state, &tight(), None).unwrap();
    let count = state.len() as f64;
    let mode = |state: &State| -> f64 {
        let weight = |i: usize| (PI * (i as f64 + 0.5) / count).sin();
        state.positions.iter().enumerate().map(|(i, x)| weight(i) * x.y).sum()
    };
    let (mut crossings, mut before) = (Vec::new(), 0.0);
    for step in 0..run.steps {
        assert_eq!(simulation.step(run.dt).unwrap().status, Status::Converged);
        simulation.store(&mut state);
        let now = mode(&state);
        if step > 501 && before * now < 0.0 {
            crossings.push((step as f64 + before / (before - now)) * run.dt);
        }
        before = now;
    }
    let last = crossings.len() - 1;
    assert!(last > 10, "{crossings:?}");
    // What implicit Euler makes of it is taken out.
    let found = PI * last as f64 / (crossings[last] - crossings[0]);
    let found = (found * run.dt).tan() / run.dt / (2.0 * PI);
    println!("plucked string: {found:.2} Hz, a string's {pitch:.2} Hz");
    assert!((-5e-4..stiff + 5e-4).contains(&(found / pitch - 1.0)), "{found} Hz, not {pitch} Hz");
}
