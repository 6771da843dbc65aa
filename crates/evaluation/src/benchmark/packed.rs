//! Ropes that lie on each other: piles, packings, coils.

use std::f64::consts::PI;

use cosserat::scene;
use cosserat::simulation::Touched;
use cosserat::state::measure;

use super::quantity::{Measured, Quantity, median};
use super::runs::Runs;

/// Five cables fall into a heap: what the ground bears at the end, energy, overlap.
pub(super) fn pile(runs: &mut Runs<'_>) -> Measured {
    // Round cables on level ground would roll on for ever.
    let damping = ["damping.linear_per_s=8", "damping.angular_per_s=8", "rods.cable.heap.seed=5"].map(str::to_owned);
    let steps = ["run.steps=400".to_owned()];
    let scene = scene::builtin_set("heap-5", &[&damping[..], &steps].concat())?;
    let model = &scene.model;
    let weight = model.segments.iter().map(|s| s.mass()).sum::<f64>() * model.gravity.norm();
    let first = measure::energy(model, &scene.state).total();
    let (mut borne, mut highest, mut kinetic) = (Vec::new(), f64::NEG_INFINITY, f64::NAN);
    let until = scene.run.steps as f64 * scene.run.dt;
    let counters = runs.play(&scene, |now| {
        let energy = measure::energy(model, now.state);
        (highest, kinetic) = (highest.max(energy.total() - first), energy.kinetic);
        if now.time > 0.8 * until {
            let ground = now.contacts.iter().filter(|contact| matches!(contact.other, Touched::Obstacle(_)));
            borne.push(ground.map(|contact| contact.force.z).sum::<f64>());
        }
    })?;
    let tolerance = runs.settings().step.contact_tolerance;
    let drop = first.abs();
    Ok(vec![
        Quantity::new("what the ground bears at rest [N]", [median(borne), weight], 0.01, "weight"),
        Quantity::new("kinetic energy at the end, share of the fall's", [kinetic / drop, 0.0], 1e-3, "rest"),
        Quantity::new(
            "rise of energy, share of the fall's",
            [highest.max(0.0) / drop, 0.0],
            1e-3,
            "contacts take energy alone",
        ),
        Quantity::new("deepest overlap [radii]", [counters.deepest_penetration, 0.0], tolerance, "contact tolerance"),
    ])
}

/// Round rods in a trough come to rest in rows of four and three.
pub(super) fn packing(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("packing")?;
    let (count, radius) = (scene.rods.len() as f64, scene.model.segments[0].radius);
    let mut top = f64::NAN;
    let counters = runs.play(&scene, |now| {
        top = now.state.positions.iter().map(|x| x.z).fold(0.0, f64::max) + radius;
    })?;
    let share = |height: f64| count * PI * radius * radius / (8.0 * radius * height);
    let right = (2.0 + 4.0 * 3.0_f64.sqrt()) * radius;
    let tolerance = runs.settings().step.contact_tolerance;
    Ok(vec![
        Quantity::new("volume fraction", [share(top), share(right)], 1e-3, "densest packing of circles, 4-3-4-3-4"),
        Quantity::new("deepest overlap [radii]", [counters.deepest_penetration, 0.0], tolerance, "contact tolerance"),
    ])
}

/// A rope lowered on to the ground coils: how large the coils are, of five ropes that are wound a little differently.
///
/// In which sense a rope coils, and where it changes that, hangs on the last digit, and with it how much it bends by a tenth; the
/// median of five does not.
pub(super) fn coiling(runs: &mut Runs<'_>) -> Measured {
    let (mut diameters, mut deepest) = (Vec::new(), 0.0_f64);
    for winding in [1.0, 1.5, 2.0, 2.5, 3.0] {
        let scene = scene::builtin_set("coiling", &[format!("rods.rope.shape.helix.winding={winding}")])?;
        let mut diameter = f64::NAN;
        // Three diameters above the ground, where coils lie on each other.
        let lies = 6.0 * scene.model.segments[0].radius;
        let counters = runs.play(&scene, |now| {
            let pairs = now.state.positions.windows(2).filter(|pair| pair[1].z < lies);
            let ways: Vec<_> = pairs.map(|pair| (pair[1] - pair[0]).xy()).collect();
            let turn = |pair: &[nalgebra::Vector2<f64>]| pair[0].perp(&pair[1]).atan2(pair[0].dot(&pair[1])).abs();
            let length: f64 = ways.iter().map(|way| way.norm()).sum();
            diameter = 2.0 * length / ways.windows(2).map(turn).sum::<f64>();
        })?;
        diameters.push(diameter);
        deepest = deepest.max(counters.deepest_penetration);
    }
    let tolerance = runs.settings().step.contact_tolerance;
    Ok(vec![
        Quantity::new(
            "diameter of coils: 2 / mean curvature [m]",
            [median(diameters), 0.287],
            0.05,
            "refined runs of the same ropes, dt = 1.25 ms",
        )
        .beside("coils of 16 cm in PyElastica, 10 cm in MuJoCo (of another rope)"),
        Quantity::new("deepest overlap [radii]", [deepest, 0.0], tolerance, "contact tolerance"),
    ])
}
