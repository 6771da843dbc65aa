//! Rods that run inside other rods: theory, conserved quantities.

use std::ops::Range;
use std::sync::Arc;

use dynamics::simulation::Simulation;
use dynamics::step::Status;
use nalgebra::Vector3;
use rod::{
    Assembly, Body, Driven, Friction, Integrator, Interpolation, JointForce, Load, Material, Model, Motion, Pose,
    RestShape, RodSpec, Sheath, State,
};

use crate::sliding::settings;

/// Radii of the rods inside and outside, and the clearance of the two [m].
const INNER: f64 = 0.5e-3;
const OUTER: f64 = 2e-3;
const CLEARANCE: f64 = 0.5e-3;

fn rope(youngs_modulus: f64) -> Material {
    Material { youngs_modulus, torsion_modulus: 0.4 * youngs_modulus, density: 1000.0 }
}

/// The way along x up to 0, then on a circle of radius `r` towards z by the angle `turn`, then straight on: its point at a distance [m].
fn way(r: f64, turn: f64, s: f64) -> Vector3<f64> {
    let angle = (s / r).clamp(0.0, turn);
    let end = Vector3::new(angle.sin(), 0.0, 1.0 - angle.cos()) * r;
    end + Vector3::new(angle.cos(), 0.0, angle.sin()) * (s - angle * r)
}

/// Nodes on a way from one distance to another, in so many segments.
fn nodes(way: impl Fn(f64) -> Vector3<f64>, [from, to]: [f64; 2], segments: usize) -> Vec<Vector3<f64>> {
    (0..=segments).map(|k| way(from + (to - from) * k as f64 / segments as f64)).collect()
}

fn spec(nodes: Vec<Vector3<f64>>, radius: f64, youngs_modulus: f64) -> RodSpec {
    RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, radius, rope(youngs_modulus)) }
}

fn sheath(model: &mut Model, inner: &Range<usize>, outer: &Range<usize>, friction: f64) {
    let (inner, outer, friction) = (inner.clone(), outer.clone(), Friction::new(friction));
    model.contacts.sheaths.push(Sheath { inner, outer, clearance: CLEARANCE, friction });
}

/// A rope through a fixed sheath that turns by an angle, with 12 segments in the turn; a load pulls its start, its end is led at a speed
/// [m/s] along the rope.
fn through(turn: f64, friction: f64, load: f64, speed: f64) -> (Model, State, Range<usize>) {
    let r = 0.1;
    let length = r * turn / 12.0;
    let mut assembly = Assembly::new(Vector3::zeros());
    let along = |s: f64| way(r, turn, s);
    let outer = assembly.rod(&spec(nodes(along, [-2.0 * length, r * turn + 2.0 * length], 16), OUTER, 1e9));
    outer.clone().for_each(|i| _ = assembly.fix(i));
    let own = 0.83 * length;
    let inner = nodes(along, [-18.0 * own, r * turn + 18.0 * own], 36 + (12.0 / 0.83) as usize);
    let inner = assembly.rod(&spec(inner, INNER, 1e7));
    let pull = -Vector3::x() * load;
    assembly.load(Load { segment: inner.start, offset: -0.5 * own, force: pull, torque: Vector3::zeros() });
    assembly.clamp_end(&inner);
    assembly.damping(rod::Damping { linear: 5.0, angular: 5.0 });
    let (mut model, state) = assembly.finish();
    let from = model.anchors[0];
    let axis = Vector3::new(turn.cos(), 0.0, turn.sin());
    let at = |time: f64, way: f64| (time, Pose { position: from.position + axis * way, ..from });
    let ramp = (1..=10).map(|k| 0.1 * f64::from(k) * 0.1).map(|t| at(t, 0.5 * speed * t * t / 0.1));
    let keys: Vec<_> = [at(0.0, 0.0)].into_iter().chain(ramp).chain([at(10.1, 0.05 * speed + 10.0 * speed)]).collect();
    let motion = Motion::through(&keys, Interpolation::Linear).unwrap();
    model.motions.push(Driven::new(Body::Anchor(0), Arc::new(motion)));
    sheath(&mut model, &inner, &outer, friction);
    (model, state, inner)
}

/// Steps `model` and shows each step's end, with the forces of its joints.
fn run(
    model: &Model,
    state: &State,
    integrator: Integrator,
    (dt, steps): (f64, usize),
    mut see: impl FnMut(f64, &State, &[JointForce]),
) -> Simulation {
    let mut simulation = Simulation::new(model, state, &settings(integrator), None).unwrap();
    let (mut state, mut forces) = (state.clone(), vec![JointForce::default(); model.joints.len()]);
    for step in 0..steps {
        let status = simulation.step(dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(&mut state);
        simulation.store_joint_forces(&mut forces);
        see(simulation.time(), &state, &forces);
    }
    simulation
}

/// A rope that is led through a curved sheath needs exp(mu theta) times the tension at its other end, or that share of it where it is let in.
#[test]
fn a_rope_slides_at_the_capstan_factor() {
    for turn in [1.0_f64, 2.0] {
        for friction in [0.0, 0.2, 0.5] {
            for speed in [0.05, -0.05] {
                let load = 10.0;
                let (model, state, _) = through(turn, friction, load, speed);
                let mut seen = Vec::new();
                let simulation = run(&model, &state, Integrator::Bdf2, (0.002, 500), |time, _, forces| {
                    if time > 0.5 {
                        seen.push(forces[model.joints.len() - 1].force.norm());
                    }
                });
                let mean = seen.iter().sum::<f64>() / seen.len() as f64;
                let expected = load * (friction * turn * speed.signum()).exp();
                let jump = seen.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
                let [low, high] = [f64::min as fn(f64, f64) -> f64, f64::max]
                    .map(|which| seen.iter().copied().reduce(which).unwrap());
                println!(
                    "turn {turn} mu {friction} speed {speed}: {} of {}, swing {}, jump {}, {} iterations a step, retries {}",
                    mean / expected,
                    expected,
                    (high - low) / mean,
                    jump / mean,
                    simulation.counters().iterations as f64 / simulation.counters().steps as f64,
                    simulation.counters().retries
                );
                assert!(
                    (mean / expected - 1.0).abs() < 0.03,
                    "{turn} rad, {friction}, {speed} m/s: {mean} N, {expected} N"
                );
            }
        }
    }
}
