//! Euler and Eytelwein's capstan: a rope over a fixed drum holds while its two pulls differ by less than
//! `exp(mu theta)`.

use std::f64::consts::{PI, TAU};

use cosserat::assembly::{Assembly, Friction, Load, Material, Obstacle, ObstacleShape, RestShape, RodSpec, Surface};
use cosserat::guess::{GuessKind, Members, Topology};
use cosserat::simulation::{Formulation, Settings, Simulation, Status};
use cosserat::state::{Model, State};
use nalgebra::Vector3;

const FRICTION: f64 = 0.3;
/// Radius of the drum [m].
const DRUM: f64 = 0.1;
/// Pull at the slack side [N] on a rope's area [m^2], so that ropes of all radii move alike.
const SLACK: f64 = 640.0;
const DT: f64 = 0.01;
const STEPS: usize = 100;

/// A soft rope wound over a drum through `angle` [rad], pulled with [`SLACK`] at its start and `pull` times that at its
/// end.
fn model(angle: f64, radius: f64, pull: f64) -> (Model, State) {
    let tail = 8;
    let slack = SLACK * PI * radius * radius;
    // 48 segments a turn, which touch the drum in their middles.
    let arc = (48.0 * angle / TAU).ceil() as usize;
    let step = angle / arc as f64;
    let reach = (DRUM + radius) / (0.5 * step).cos();
    // More than half a turn climbs, so that the tails keep apart.
    let pitch = if angle > PI { 4.0 * radius / TAU } else { 0.0 };
    let node = |k: f64| {
        let at = step * k;
        Vector3::new(reach * at.cos(), pitch * at, reach * at.sin())
    };
    let (first, last) = (node(-0.5), node(arc as f64 + 0.5));
    let (start, end) = (first - node(0.5), last - node(arc as f64 - 0.5));
    let mut nodes: Vec<_> = (1..=tail).rev().map(|k| first + start * k as f64).collect();
    nodes.extend((0..=arc + 1).map(|k| node(k as f64 - 0.5)));
    nodes.extend((1..=tail).map(|k| last + end * k as f64));
    let material = Material { youngs_modulus: 1e4, torsion_modulus: 1e4, density: 1000.0 };
    let mut assembly = Assembly::new(Vector3::zeros());
    let rope = assembly.rod(&RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, radius, material) });
    let pulled = |segment, direction: Vector3<f64>, side: f64, force: f64| Load {
        segment,
        offset: side * 0.5 * direction.norm(),
        force: direction.normalize() * force,
        torque: Vector3::zeros(),
        follows: false,
    };
    assembly.load(pulled(rope.start, start, -1.0, slack));
    assembly.load(pulled(rope.end - 1, end, 1.0, slack * pull));
    let (mut model, state) = assembly.finish();
    let shape = ObstacleShape::Capsule { start: -Vector3::y(), end: Vector3::y(), radius: DRUM };
    let surface = Surface { friction: Friction::new(FRICTION), restitution: 0.0 };
    model.contacts.obstacles.push(Obstacle::new(shape, surface));
    (model, state)
}

/// Speeds [m/s] at which the slack end is drawn in, after half of the time and after all of it.
fn speeds(angle: f64, radius: f64, pull: f64, formulation: Formulation) -> [f64; 2] {
    let (model, state) = model(angle, radius, pull);
    let mut settings = Settings::default();
    settings.step.formulation = formulation;
    let build = |m: &Model, s: &Members, t: &Topology| GuessKind::StepQuadratic.build(m, s, t);
    let guess = formulation.momentum().then_some(&build as _);
    let mut simulation = Simulation::new(&model, &state, &settings, guess).unwrap();
    let mut now = state.clone();
    let inwards = state.axis(0);
    let mut half = || {
        for step in 0..STEPS / 2 {
            let report = simulation.step(DT).unwrap();
            assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
        }
        simulation.store(&mut now);
        now.velocities[0].dot(&inwards)
    };
    [half(), half()]
}

/// A rope of `radius` [m] rests at 0.95 of the `limit` of its pulls' ratio and slides ever faster at 1.05 of it.
fn holds_up_to(limit: f64, angle: f64, radius: f64) {
    let [_, below] = speeds(angle, radius, 0.95 * limit, Formulation::Newton);
    let [half, above] = speeds(angle, radius, 1.05 * limit, Formulation::Newton);
    println!("{angle:.2} rad, {radius} m: {below:.1e} m/s below the limit, {half:.4} then {above:.4} m/s above");
    // What a contact's tolerance lets slip is a thousandth of a radius a step.
    assert!(below.abs() < 1e-3 * radius / DT, "{below}");
    assert!(half > 0.03 && above > 1.8 * half, "{half} {above}");
}

#[test]
fn a_thin_rope_holds_up_to_the_exponential_of_the_angle() {
    for degrees in [90.0_f64, 180.0, 360.0] {
        let angle = degrees.to_radians();
        holds_up_to((FRICTION * angle).exp(), angle, 0.001);
    }
}

/// Friction acts at the rope's surface: about the drum's axis its lever arm is R, that of the tension R + r.
#[test]
fn a_thick_rope_holds_less() {
    let (radius, angle) = (0.005, TAU);
    holds_up_to((FRICTION * angle * DRUM / (DRUM + radius)).exp(), angle, radius);
}
