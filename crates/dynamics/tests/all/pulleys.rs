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
    Material { youngs_modulus: 1e8, torsion_modulus: 1e4, density }
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

/// Nodes at equal distances along a path that comes straight to a wheel about the origin, goes around it by an angle and goes on straight; the
/// middle of the wrap is on top.
fn around(wrap: f64, [before, after]: [f64; 2], step: f64) -> Vec<Vector3<f64>> {
    let round = |angle: f64| Vector3::new(angle.sin(), 0.0, angle.cos());
    let along = |angle: f64| Vector3::new(angle.cos(), 0.0, -angle.sin());
    let at = |s: f64| {
        let angle = (s / R).clamp(-0.5 * wrap, 0.5 * wrap);
        round(angle) * R + along(angle) * (s - R * angle)
    };
    let total = before + after + R * wrap;
    let count = (total / step).round() as usize;
    (0..=count).map(|k| at(total * k as f64 / count as f64 - before - 0.5 * R * wrap)).collect()
}

/// A taut rope around a held wheel, pulled by forces at its ends.
fn bent(wrap: f64, pulls: [f64; 2], friction: f64, [before, after, step]: [f64; 3]) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = around(wrap, [before, after], step);
    let ends = [nodes[0] - nodes[1], nodes[nodes.len() - 1] - nodes[nodes.len() - 2]].map(|x| x.normalize());
    let rod = assembly.rod(&RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, 0.001, soft(1000.0)) });
    for (segment, side, end) in [(rod.start, 0, -0.5), (rod.end - 1, 1, 0.5)] {
        let force = ends[side] * pulls[side];
        assembly.load(Load { segment, offset: end * step, force, torque: Vector3::zeros() });
    }
    assembly.damping(rod::Damping { linear: 5.0, angular: 5.0 });
    let (mut model, state) = assembly.finish();
    pulley(&mut model, rod, Vector3::zeros(), Wheel::Held { friction });
    (model, state)
}

#[test]
fn explore() {
    for wrap in [0.5, 1.0, 2.0, 3.0, std::f64::consts::TAU + 1.0] {
        for sign in [1.0_f64, -1.0] {
            let friction = 0.3_f64;
            let step = R * wrap / 10.0;
            let step = step.min(0.05);
            for share in [0.98, 0.99, 1.01, 1.02] {
                let factor = (friction * wrap).exp() * share;
                let pulls = if sign > 0.0 { [10.0, 10.0 * factor] } else { [10.0 * factor, 10.0] };
                let (model, state) = bent(wrap, pulls, friction, [4.0 * step, 4.3 * step, step]);
                let mut last = OnPulley::default();
                let mut simulation = run(&model, &state, &settings(Integrator::Bdf2), (0.002, 300), |t, _, on| {
                    last = on[0];
                    if std::env::var("V").is_ok() {
                        eprintln!("{t} {on:?}");
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
