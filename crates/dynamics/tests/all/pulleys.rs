//! Rods that run over pulleys: theory, conserved quantities, refinement.

use std::ops::Range;

use dynamics::simulation::{Settings, Simulation};
use dynamics::step::Status;
use nalgebra::{UnitQuaternion, Vector3};
use rod::measure::energy;
use rod::{Assembly, Body, Integrator, Load, Material, Model, OnPulley, Pose, Pulley, RestShape, RodSpec, State, Wheel};

use crate::sliding::{G, settings};

const R: f64 = 0.1;

fn soft(density: f64) -> Material {
    Material { youngs_modulus: std::env::var("E").map_or(3e8, |w| w.parse().unwrap()), torsion_modulus: 1e4, density }
}

/// A fixed pulley about the y axis.
fn pulley(model: &mut Model, segments: Range<usize>, centre: Vector3<f64>, wheel: Wheel) {
    let holder = Body::Anchor(model.anchors.len());
    model.anchors.push(Pose { position: centre, orientation: UnitQuaternion::identity() });
    let axis = Vector3::y_axis();
    model.pulleys.push(Pulley { segments, holder, centre: Vector3::zeros(), axis, radius: R, wheel });
}

/// Steps `model` and shows each step's end.
fn run(
    model: &Model,
    state: &State,
    settings: &Settings,
    (dt, steps): (f64, usize),
    mut see: impl FnMut(f64, &State, &[OnPulley]),
) -> Simulation {
    let mut simulation = Simulation::new(model, state, settings, None).unwrap();
    let (mut state, mut on) = (state.clone(), vec![OnPulley::default(); model.pulleys.len()]);
    for step in 0..steps {
        let status = simulation.step(dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(&mut state);
        simulation.store_pulleys(&mut on);
        see(simulation.time(), &state, &on);
    }
    simulation
}

/// Nodes of a rope that comes straight to a wheel about the origin, goes around it by an angle and goes on straight; the middle of the wrap is on
/// top. So many segments on the wheel and on each side, all of one length.
fn around(wrap: f64, on: usize, [before, after]: [usize; 2]) -> Vec<Vector3<f64>> {
    let turn = wrap / on as f64;
    let length = R * turn;
    let rim = 0.5 * length / (0.5 * turn).tan();
    let centre = |k: f64| {
        let angle = turn * k - 0.5 * wrap;
        let (round, along) = (Vector3::new(angle.sin(), 0.0, angle.cos()), Vector3::new(angle.cos(), 0.0, -angle.sin()));
        (round * rim, along)
    };
    let mut nodes = Vec::new();
    let (first, along) = centre(0.0);
    nodes.extend((0..=before).rev().map(|k| first - along * (length * (k as f64 + 0.5))));
    nodes.extend((0..=on).map(|k| {
        let (middle, along) = centre(k as f64);
        middle + along * (0.5 * length)
    }));
    let (last, along) = centre(on as f64);
    nodes.extend((1..=after).map(|k| last + along * (length * (k as f64 + 0.5))));
    nodes
}

/// A taut rope around a held wheel, pulled by forces at its ends.
fn bent(wrap: f64, on: usize, pulls: [f64; 2], friction: f64) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let (step, nodes) = (R * wrap / on as f64, around(wrap, on, [6, 6]));
    let ends = [nodes[0] - nodes[1], nodes[nodes.len() - 1] - nodes[nodes.len() - 2]].map(|x| x.normalize());
    let rod = assembly.rod(&RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, 0.001, soft(1000.0)) });
    for (segment, side, end) in [(rod.start, 0, -0.5), (rod.end - 1, 1, 0.5)] {
        let force = ends[side] * pulls[side];
        assembly.load(Load { segment, offset: end * step, force, torque: Vector3::zeros() });
    }
    assembly.add_mass(rod.start, 1.0).add_mass(rod.end - 1, 1.0);
    assembly.damping(rod::Damping { linear: 5.0, angular: 5.0 });
    let (mut model, state) = assembly.finish();
    pulley(&mut model, rod, Vector3::zeros(), Wheel::Held { friction });
    (model, state)
}

#[test]
fn explore() {
    for wrap in std::env::var("W").map_or(vec![0.5, 1.0, 2.0, 3.0, std::f64::consts::TAU + 1.0], |w| vec![w.parse().unwrap()]) {
        for sign in [1.0_f64, -1.0] {
            let friction = 0.3_f64;
            for share in [0.98, 0.99, 1.01, 1.02] {
                let factor = (friction * wrap).exp() * share;
                let pulls = if sign > 0.0 { [10.0, 10.0 * factor] } else { [10.0 * factor, 10.0] };
                let (model, state) = bent(wrap, 10, pulls, friction);
                let (mut last, mut worst) = (OnPulley::default(), 0.0_f64);
                let mut simulation = run(&model, &state, &settings(Integrator::Bdf2), (0.002, 300), |t, _, on| {
                    worst = worst.max((on[0].torque / last.torque - 1.0).abs());
                    last = on[0];
                    if std::env::var("V").is_ok() {
                        let tension = 0; eprintln!("{t} {on:?} {tension}");
                    }
                });
                eprintln!(
                    "{wrap} {sign} {share}: {last:?} {} iterations",
                    simulation.counters().iterations as f64 / 300.0
                );
            }
        }
    }
}

/// Two weights on a rope over pulleys in a row of this radius, each with its own wheel; the rope's ends hang down.
fn weights(masses: [f64; 2], on: usize, hanging: [usize; 2], density: f64) -> (Model, State, Range<usize>) {
    let mut assembly = Assembly::new(Vector3::z() * -G);
    let nodes = around(std::f64::consts::PI, on, hanging);
    let rope = assembly.rod(&RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, 0.001, soft(density)) });
    assembly.add_mass(rope.start, masses[0]).add_mass(rope.end - 1, masses[1]);
    let (model, state) = assembly.finish();
    (model, state, rope)
}

#[test]
fn atwood() {
    for on in [6, 10, 20] {
        for inertia in [false, true] {
            let (mut model, state, rope) = weights([1.0, 2.0], on, [on * 2, on], 100.0);
            let state = state;
            pulley(&mut model, rope.clone(), Vector3::zeros(), Wheel::Free);
            let _ = inertia;
            let mut ways = Vec::new();
            let before = energy(&model, &state).total();
            let simulation = run(&model, &state, &settings(Integrator::Bdf2), (0.001, 240), |time, state, on| {
                let [first, last] = [rope.start, rope.end - 1].map(|i| state.positions[i].z);
                ways.push((time, 0.5 * (last - first), energy(&model, state).total() - before, on[0]));
                if std::env::var("V").is_ok() {
                    eprintln!("{time} {} {:?} {}", 0.5 * (last - first), on[0], energy(&model, state).total() - before);
                }
            });
            let [a, b, c] = [60, 140, 220].map(|k| ways[k]);
            let acceleration = (c.1 - 2.0 * b.1 + a.1) / (b.0 - a.0).powi(2);
            eprintln!(
                "on {on}: {acceleration} {} energy {} of {} force {:?} iterations {}",
                -G / 3.0,
                c.2 - a.2,
                G * (c.1 - a.1),
                b.3,
                simulation.counters().iterations as f64 / 240.0
            );
        }
    }
}
