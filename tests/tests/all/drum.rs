//! The scene `drum`: a sheave's groove drives a rope by friction, up to the law of Euler and Eytelwein for a wedge.

use std::f64::consts::{PI, TAU};

use cosserat::assembly::Friction;
use cosserat::guess::{GuessKind, Members, Topology};
use cosserat::scene::{self, Scene};
use cosserat::simulation::{Formulation, Settings, Simulation, Status};
use cosserat::state::{Body, JointForce, Model, State};

const GRAVITY: f64 = 9.81;
/// Masses of load and counterweight [kg], the first two segments.
const MASSES: [f64; 2] = [10.0, 4.0];
/// Radius of the rope, and from the sheave's axis to the rope's [m].
const ROPE: f64 = 0.005;
const REACH: f64 = 0.16;
/// Angle of the rope's segments on the sheave, which touch it in their middles [rad].
const PITCH: f64 = PI / 16.0;
/// Sine of the angle between the middle plane of the groove and its sides.
const WEDGE: f64 = 0.8;

/// Runs so many steps; `look` sees the time, the state and what load and counterweight pull with [N].
fn run(scene: &Scene, formulation: Formulation, steps: usize, mut look: impl FnMut(f64, &State, [f64; 2])) {
    let mut settings = Settings::default();
    settings.step.formulation = formulation;
    let build = |m: &Model, s: &Members, t: &Topology| GuessKind::StepAdaptive.build(m, s, t);
    let guess = formulation.momentum().then_some(&build as _);
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, guess).unwrap();
    let joints = &scene.model.joints;
    let of = |body| joints.iter().position(|joint| [joint.a, joint.b].contains(&Body::Segment(body))).unwrap();
    let held = [0, 1].map(of);
    let (mut now, mut forces) = (scene.state.clone(), vec![JointForce::default(); joints.len()]);
    for step in 0..steps {
        let report = simulation.step(scene.run.dt).unwrap();
        assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
        simulation.store(&mut now);
        simulation.store_joint_forces(&mut forces);
        look(simulation.time(), &now, held.map(|joint| forces[joint].force.norm()));
    }
    let deepest = simulation.counters().deepest_penetration;
    assert!(deepest <= settings.step.contact_tolerance, "{deepest}");
}

/// The load rises as the rope's axis is carried along, and pulls with its weight and its inertia all the time.
#[test]
fn the_sheave_hoists_the_load_by_friction() {
    let scene = scene::builtin("drum").unwrap();
    // A turn in 3.5 s, by a cubic with no speed at both ends; the rope's axis is a polygon around the sheave.
    let way = TAU * REACH * (0.5 * PITCH).tan() / (0.5 * PITCH);
    let (begin, duration) = (0.5, 3.5);
    // What a contact's tolerance lets slip in each step is a thousandth of the rope's radius.
    let creep = Settings::default().step.contact_tolerance * ROPE * scene.run.steps as f64;
    let (mut worst, mut aside, mut swings) = (0.0_f64, 0.0_f64, 0.0_f64);
    let (mut hoisting, mut resting) = (Vec::new(), Vec::new());
    run(&scene, Formulation::default(), scene.run.steps, |time, now, pull| {
        let s = ((time - begin) / duration).clamp(0.0, 1.0);
        let risen = now.positions[0].z - scene.state.positions[0].z;
        worst = worst.max((risen - way * s * s * (3.0 - 2.0 * s)).abs());
        aside = now.positions.iter().fold(aside, |aside, x| aside.max(x.y.abs()));
        swings = swings.max((now.positions[0].x - REACH).abs());
        // The second derivative of the cubic, up on one side and down on the other.
        let a = way * (6.0 - 12.0 * s) / (duration * duration);
        let balance =
            |a: f64| [pull[0] / (MASSES[0] * (GRAVITY + a)) - 1.0, pull[1] / (MASSES[1] * (GRAVITY - a)) - 1.0];
        if 0.02 < s && s < 0.98 {
            hoisting.push(balance(a));
        } else if time > begin + duration + 0.2 {
            resting.push(balance(0.0));
        }
    });
    let mean = |side: usize| hoisting.iter().map(|balance| balance[side]).sum::<f64>() / hoisting.len() as f64;
    let [load, counterweight] = [mean(0), mean(1)];
    let rest = resting.iter().flatten().fold(0.0_f64, |worst, balance| worst.max(balance.abs()));
    println!("off the way by {worst:.1e} of {way:.3} m, aside by {aside:.1e} m, swings by {swings:.1e} m");
    println!("pulls are off by {load:.1e} and {counterweight:.1e} on the way, by {rest:.1e} at rest");
    assert!(worst < creep, "{worst} m of {creep} m");
    assert!(aside < 0.1 * ROPE && swings < ROPE, "out of the groove by {aside} m, swings by {swings} m");
    // Each segment that comes onto the sheave or leaves it shakes the pulls, which are right in the mean.
    assert!(load.abs().max(counterweight.abs()) < 0.01 && rest < 0.01, "{load} {counterweight} {rest}");
}

/// At a coefficient of 0.15 the groove holds a ratio of 1.78 of the 2.5 there are: the load comes down as fast as on
/// Atwood's machine with that ratio between both sides.
#[test]
fn on_a_smoother_sheave_the_load_comes_down() {
    let mut scene = scene::builtin("drum").unwrap();
    let friction = 0.15;
    for sphere in &mut scene.model.contacts.obstacles {
        sphere.surface.friction = Friction::new(friction);
    }
    // The lever arm of friction is from the axis to where the rope touches the sides of its groove.
    let ratio = (friction * PI / WEDGE * (REACH - ROPE * WEDGE) / REACH).exp();
    let rope = &scene.rods[2].segments;
    let hangs = |side: f64| {
        let below =
            rope.clone().filter(|&i| scene.state.positions[i].x * side > 0.0 && scene.state.positions[i].z < 0.0);
        below.map(|i| scene.model.segments[i].mass()).sum::<f64>()
    };
    let [down, up] = [MASSES[0] + hangs(1.0), MASSES[1] + hangs(-1.0)];
    let expected = GRAVITY * (down - ratio * up) / (down + ratio * up);
    let (mut first, mut found) = (None, 0.0);
    run(&scene, Formulation::Newton, 40, |time, now, _| {
        let v = -now.velocities[0].z;
        let (begin, slow) = *first.get_or_insert((time, v));
        found = (v - slow) / (time - begin);
    });
    println!("comes down with {found:.3} m/s^2, expected {expected:.3}");
    assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
}
