//! Scenes under load, in rotation and in contact whose right values theory gives.

use std::f64::consts::PI;
use std::fmt::Write as _;

use cosserat::scene::{self, Scene, SceneError};
use cosserat::state::measure::angular_momentum;
use cosserat::state::{JointForce, State};
use nalgebra::Vector3;

use crate::benchmark::Atwood;

/// What is simulated at a moment.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Poses and velocities.
    pub state: State,
    /// What joints transmit, one a joint.
    pub forces: Vec<JointForce>,
}

/// Error of a run by its last frame.
pub type Error = fn(&Scene, &Frame) -> f64;

/// A scene with a right value.
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// What is measured, and what the error is relative to.
    pub quantity: &'static str,
    /// Right value, with where it comes from.
    pub right: &'static str,
    /// Whether it takes more than a second or two.
    pub is_long: bool,
    pub(super) scene: fn() -> Result<Scene, SceneError>,
    pub(super) error: Error,
}

/// All cases.
pub fn cases() -> Vec<Case> {
    vec![
        Case {
            name: "wire-on-floor",
            quantity: "force at the clamp, to its norm",
            right: "3.129 N down and .5254 N across: Newton's method at tolerances from 1e-6 to .5; the elastica gives 3.13 N",
            is_long: true,
            scene: wire_on_floor,
            error: |scene, last| {
                let force = last.forces[scene.model.joints_of(&scene.rods[0].segments)[0]].force;
                let right = Vector3::new(-0.525_4, 0.0, -3.129_0);
                (force - right).norm().min((force + right).norm()) / right.norm()
            },
        },
        Case {
            name: "ball-in-orbit",
            quantity: "angular momentum about the pin, to that at the start",
            right: "that at the start: no force has a moment about the pin",
            is_long: false,
            scene: ball_in_orbit,
            error: |scene, last| {
                let [before, after] =
                    [&scene.state, &last.state].map(|state| angular_momentum(&scene.model, state).norm());
                (after / before - 1.0).abs()
            },
        },
        Case {
            name: "beam-spun-up",
            quantity: "place of the tip, to the length",
            right: "straight, and stretched by 5.14e-4 m (centrifugal force, Wu and Haug 1988)",
            is_long: false,
            scene: beam_spun_up,
            error: |scene, last| {
                let tip = scene.model.segments.len() - 1;
                let angle = turned(scene.run.dt * scene.run.steps as f64);
                // The centre of the last segment, half of one from the free end, which hardly stretches.
                let radius = scene.state.positions[tip].x + 5.14e-4;
                let right = Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
                (last.state.positions[tip] - right).norm() / 10.0
            },
        },
        Case {
            name: "mooring-line",
            quantity: "tension at the fairlead, to itself",
            right: "2.43639e6 N: the elastic catenary",
            is_long: true,
            scene: mooring_line,
            error: |scene, last| {
                let joints = scene.model.joints_of(&scene.rods[0].segments);
                (last.forces[joints[joints.len() - 1]].force.norm() / 2.436_39e6 - 1.0).abs()
            },
        },
        Case {
            name: "atwood",
            quantity: "way of the heavier weight, to itself",
            right: "Atwood's machine with the rope's weight",
            is_long: false,
            scene: || scene::builtin("atwood"),
            error: |scene, last| {
                let way = (last.state.positions[0].z - scene.state.positions[0].z).abs();
                (way / Atwood::of(scene).fallen(scene.run.dt * scene.run.steps as f64) - 1.0).abs()
            },
        },
    ]
}

/// A steel wire of 1 m and 1 mm in radius stands on a floor with friction, bent a little; its upper, clamped end sinks by a tenth.
fn wire_on_floor() -> Result<Scene, SceneError> {
    let at = |k: u32| f64::from(k) / 60.0;
    let node = |k| [0.01 * (1.0 - (2.0 * PI * at(k)).cos()), 0.0, 1.001_000_1 - at(k)];
    let nodes: Vec<[f64; 3]> = (0..=60).map(node).collect();
    let text = format!(
        r#"
run = {{ dt_s = 0.005, steps = 4000 }}
damping = {{ linear_per_s = 5, angular_per_s = 5 }}
[[obstacles]]
shape.plane = {{}}
friction = 0.5
[[rods]]
name = "wire"
radius_m = 0.001
youngs_modulus_pa = 2e11
torsion_modulus_pa = 8e10
density_kg_m3 = 7850
rest = "straight"
shape.polyline = {{ nodes_m = {nodes:?} }}
[[rods.motions]]
at = "start-face"
times_s = [0, 8]
shifts_m = [[0, 0, 0], [0, 0, -0.1]]
interpolation = "smooth"
"#
    );
    scene::parse(&text, "wire-on-floor")
}

/// A ball of 1 kg flies around a pin on a rope of 2 m, at 2.5 rad/s, without gravity.
fn ball_in_orbit() -> Result<Scene, SceneError> {
    let mut velocities = String::new();
    for k in 0..20 {
        let speed = 0.25 * (f64::from(k) + 0.5);
        let _ = write!(
            velocities,
            "{{ segment = {k}, velocity_m_s = [0, {speed}, 0], angular_velocity_rad_s = [0, 0, 2.5] }}, "
        );
    }
    let text = format!(
        r#"
gravity_m_s2 = [0, 0, 0]
run = {{ dt_s = 0.02, steps = 500 }}
[[rods]]
name = "rope"
radius_m = 0.01
youngs_modulus_pa = 1e6
density_kg_m3 = 300
shape.straight = {{ start_m = [0, 0, 0], direction = [1, 0, 0], length_m = 2, segments = 20 }}
masses = [{{ segment = -1, mass_kg = 1 }}]
velocities = [{velocities}]
grips = [{{ at = "start-face", joint = "ball" }}]
"#
    );
    scene::parse(&text, "ball-in-orbit")
}

/// By how much the beam's root has turned [rad] after `t` seconds: it is spun up over 15 s to 6 rad/s (Wu and Haug 1988).
fn turned(t: f64) -> f64 {
    let (until, speed) = (15.0, 6.0);
    let wave = 2.0 * PI / until;
    if t < until {
        speed / until * (0.5 * t * t + ((wave * t).cos() - 1.0) / (wave * wave))
    } else {
        speed * (t - 0.5 * until)
    }
}

/// A flexible beam of 10 m is spun up about its root, without gravity.
fn beam_spun_up() -> Result<Scene, SceneError> {
    let times: Vec<f64> = (0..=220).map(|k| 0.1 * f64::from(k)).collect();
    // Turns are from one keyframe to the next.
    let turn = |&t: &f64| [0.0, 0.0, (turned(t) - turned((t - 0.1).max(0.0))).to_degrees()];
    let turns: Vec<[f64; 3]> = times.iter().map(turn).collect();
    let text = format!(
        r#"
gravity_m_s2 = [0, 0, 0]
run = {{ dt_s = 0.01, steps = 2000 }}
[[rods]]
name = "beam"
radius_m = 0.05
stretch = "physical"
section.stiffness = {{ bending_n_m2 = [1.4e4, 1.4e4], torsion_n_m2 = 1.4e4, mass_kg_m = 1.2, polar_inertia_kg_m = 1.2e-3, stretch_n = 2.8e7, shear_n = 1e7 }}
shape.straight = {{ start_m = [0, 0, 0], direction = [1, 0, 0], length_m = 10, segments = 20 }}
[[rods.motions]]
at = "start-face"
times_s = {times:?}
turns_deg = {turns:?}
interpolation = "smooth"
"#
    );
    scene::parse(&text, "beam-spun-up")
}

/// A mooring line of 850 m hangs from its fairlead to the seabed and lies on it up to its anchor.
fn mooring_line() -> Result<Scene, SceneError> {
    let (radius, depth, anchor, fairlead) = (0.1665, 200.0, -837.6, [-58.0, -14.0]);
    // Part of it lies, part of it rises in an arc of a parabola: it comes to rest by itself.
    let touch = -337.0;
    let node = |k: u32| {
        let share = f64::from(k) / 100.0;
        let x = anchor + share * (fairlead[0] - anchor);
        let up = ((x - touch) / (fairlead[0] - touch)).max(0.0);
        [x, 0.0, -depth + (depth + fairlead[1]) * up * up]
    };
    let nodes: Vec<[f64; 3]> = (0..=100).map(node).collect();
    let text = format!(
        r#"
gravity_m_s2 = [0, 0, -9.81]
run = {{ dt_s = 0.05, steps = 2400 }}
damping = {{ linear_per_s = 0.5, angular_per_s = 0.5 }}
[[obstacles]]
shape.plane = {{ point_m = [0, 0, {}] }}
[[rods]]
name = "line"
radius_m = {radius}
stretch = "physical"
section.stiffness = {{ bending_n_m2 = [1e3, 1e3], torsion_n_m2 = 1e3, mass_kg_m = 595.7306826354959, stretch_n = 3.27e9, shear_n = 3.27e9 }}
shape.polyline = {{ nodes_m = {nodes:?} }}
rest = "straight"
rest_length_m = 850
[[rods.grips]]
at = "start-face"
joint = "ball"
[[rods.grips]]
at = "end-face"
joint = "ball"
"#,
        -depth - radius - 1e-3
    );
    scene::parse(&text, "mooring-line")
}
