//! Rods that hang and bend: catenary, cantilever, extremes of stiffness and time step.

use cosserat::scene;
use cosserat::state::JointForce;
use cosserat::statics::{StaticParams, equilibrium};
use nalgebra::Vector3;

use super::quantity::{Measured, Quantity};
use super::runs::Runs;
use super::theory::Catenary;

/// A wire rope between two grips begins at rest and stays: lowest point, and pulls at both ends.
pub(super) fn catenary(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("hung-cable")?;
    let curve = Catenary::new(22.0, 20.0, 3.0);
    let segment = &scene.model.segments[0];
    let weight = segment.mass() / segment.length * scene.model.gravity.norm();
    let joints = scene.model.joints_of(&scene.rods[0].segments);
    let (mut lowest, mut pulls) = (0.0, [0.0; 2]);
    runs.play(&scene, |now| {
        lowest = now.state.positions.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
        let pull = |joint: Option<&usize>| joint.map_or(&JointForce::default(), |&k| &now.forces[k]).force.norm();
        pulls = [pull(joints.first()), pull(joints.last())];
    })?;
    let [start, end] = curve.ends.map(|x| curve.height(x));
    let source = "catenary";
    Ok(vec![
        Quantity::new("lowest point below the start [m]", [-lowest, start - curve.a], 1e-3, source)
            .beside("MuJoCo 1.2 %, PyElastica 0.014 % (of a cable that stretches)"),
        Quantity::new("pull at the start [N]", [pulls[0], weight * start], 1e-3, source),
        Quantity::new("pull at the end [N]", [pulls[1], weight * end], 1e-3, source),
    ])
}

/// A beam bends under its own weight, `rho g A L^3 / B = 10`, and comes to rest.
pub(super) fn cantilever(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("heavy-cantilever")?;
    let last = scene.model.segments.len() - 1;
    let mut tip = Vector3::zeros();
    runs.play(&scene, |now| {
        tip = now.state.positions[last] + now.state.axis(last) * (0.5 * scene.model.segments[last].length);
    })?;
    let source = "heavy elastica, by shooting";
    Ok(vec![
        Quantity::new("drop of the tip [m]", [-tip.z, 0.700_20], 1e-3, source)
            .beside("PyElastica 7.3 % with 20 elements, 1.8 % with 80 (of a beam with a load)"),
        Quantity::new("reach of the tip [m]", [tip.x, 0.656_35], 1e-3, source),
    ])
}

/// A rod at its clamp, from 1 to 1e12 Pa and from 10 us to 1 s a step: where it comes to rest, how it falls, and steps lost.
pub(super) fn extremes(runs: &mut Runs<'_>) -> Measured {
    let with = |modulus: &str, more: &[&str]| {
        let modulus = format!("rods.rod.youngs_modulus_pa={modulus}");
        let settings = std::iter::once(modulus).chain(more.iter().map(|&setting| setting.to_owned()));
        scene::builtin_set("bending-rod", &settings.collect::<Vec<_>>())
    };
    let (mut lost, mut quantities) = (0, Vec::new());
    let rests = [
        ("rest at 1 Pa, 0.02 s [rod lengths off]", "1", ["run.dt_s=0.02", "run.steps=400"]),
        ("rest at 1 Pa, 1 s [rod lengths off]", "1", ["run.dt_s=1", "run.steps=40"]),
        ("rest at 1e5 Pa, 1 s [rod lengths off]", "1e5", ["run.dt_s=1", "run.steps=40"]),
        ("rest at 1e12 Pa, 0.02 s [rod lengths off]", "1e12", ["run.dt_s=0.02", "run.steps=400"]),
        ("rest at 1e12 Pa, 1 s [rod lengths off]", "1e12", ["run.dt_s=1", "run.steps=40"]),
    ];
    for (name, modulus, more) in rests {
        let scene = with(modulus, &[more[0], more[1], "damping.linear_per_s=4"])?;
        let mut rest = scene.state.clone();
        let found = equilibrium(&scene.model, &mut rest, &StaticParams::default())?;
        let mut off = f64::NAN;
        let counters = runs.play(&scene, |now| {
            let pairs = now.state.positions.iter().zip(&rest.positions);
            off = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / 4.0;
        })?;
        lost += counters.not_converged + counters.non_finite;
        let off = if found.converged { off } else { f64::NAN };
        quantities.push(Quantity::new(name, [off, 0.0], 1e-4, "equilibrium by Newton's method"));
    }
    // A soft rod's end falls freely: nothing of its clamp has come there yet.
    let scene = with("1", &["run.dt_s=1e-5", "run.steps=500"])?;
    let last = scene.model.segments.len() - 1;
    let (mut fallen, mut time) = (f64::NAN, 0.0);
    let counters = runs.play(&scene, |now| {
        (fallen, time) = (scene.state.positions[last].z - now.state.positions[last].z, now.time);
    })?;
    lost += counters.not_converged + counters.non_finite;
    let free = 0.5 * scene.model.gravity.norm() * time * time;
    quantities.push(Quantity::new("way of the end at 1 Pa, 10 us [m]", [fallen, free], 5e-3, "free fall"));
    quantities.push(Quantity::new("steps not solved", [lost as f64, 0.0], 0.0, "none"));
    Ok(quantities)
}
