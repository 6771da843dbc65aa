//! Ropes with twist and knots: buckling, the plectoneme's link, the knot.

use nalgebra::Vector3;
use rod::{Model, Section, State, darboux};

use super::quantity::{BenchmarkError, Measured, Quantity};
use super::runs::Runs;
use super::theory::buckling_moment;
use crate::knot;

/// The writhe of an open polygon [turns], closed straight on at both ends and far away: Gauss's integral over all pairs of edges, each in
/// closed form (Banchoff 1976; Klenin and Langowski 2000).
fn writhe(nodes: &[Vector3<f64>]) -> f64 {
    let far = 1e4 * nodes.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum::<f64>();
    let [first, last] = [[nodes[1], nodes[0]], [nodes[nodes.len() - 2], nodes[nodes.len() - 1]]];
    let on = |[from, to]: [Vector3<f64>; 2]| to + (to - from).normalize() * far;
    let all: Vec<_> = std::iter::once(on(first)).chain(nodes.iter().copied()).chain([on(last)]).collect();
    let mut sum = 0.0;
    for i in 0..all.len() - 1 {
        for k in i + 2..all.len() - 1 {
            sum += solid_angle([all[i], all[i + 1]], [all[k], all[k + 1]]);
        }
    }
    2.0 * sum / (4.0 * std::f64::consts::PI)
}

/// Signed area of the directions in which two edges are seen crossing.
fn solid_angle([a, b]: [Vector3<f64>; 2], [c, d]: [Vector3<f64>; 2]) -> f64 {
    let corners = [c - a, d - a, d - b, c - b];
    let normals = [0, 1, 2, 3].map(|k| corners[k].cross(&corners[(k + 1) % 4]));
    if normals.iter().any(|n| n.norm_squared() == 0.0) {
        return 0.0;
    }
    let normals = normals.map(|n| n.normalize());
    let area: f64 = (0..4).map(|k| normals[k].dot(&normals[(k + 1) % 4]).clamp(-1.0, 1.0).asin()).sum();
    area.abs() * (d - c).cross(&(b - a)).dot(&(c - a)).signum()
}

/// Turn of the material frames about the axis from the first to the last segment [turns], beside parallel transport.
fn twist(state: &State) -> f64 {
    let pairs = state.orientations.windows(2);
    let turn = |pair: &[nalgebra::UnitQuaternion<f64>]| {
        let (s, u) = darboux::relative_rotation(&pair[0], &pair[1]);
        2.0 * (u.z * s.signum()).atan2(s.abs())
    };
    pairs.map(turn).sum::<f64>() / std::f64::consts::TAU
}

/// Nodes between the segments, and both ends.
fn nodes(model: &Model, state: &State) -> Vec<Vector3<f64>> {
    let end = |i: usize, side: f64| state.positions[i] + state.axis(i) * (side * 0.5 * model.segments[i].length);
    let last = model.segments.len() - 1;
    (0..=last).map(|i| end(i, -1.0)).chain([end(last, 1.0)]).collect()
}

/// A twisted rope in tension: the twist at which it buckles, from how fast it does at two larger ones, and link, which stays when it
/// winds about itself.
pub(super) fn plectoneme(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("plectoneme")?;
    let section = Section::Circle { radius: scene.model.segments[0].radius };
    let joint = &scene.model.joints[0];
    let bending = joint.youngs_modulus * section.second_moments()[0];
    let torsion = joint.torsion_modulus * section.torsion_constant();
    let tension = scene.model.loads[0].force.x;
    let right = buckling_moment(bending, 1.0, tension) / torsion;
    // Squares of the rates of growth fall to zero with the square of the twist.
    let mut rates = Vec::new();
    for share in [1.1, 1.2] {
        let rate = growth(runs, share * right)?;
        rates.push(((share * right).powi(2), rate * rate));
    }
    let [(x, a), (y, b)] = [rates[0], rates[1]];
    let found = (x - a * (y - x) / (b - a)).sqrt();

    let (mut linked, mut writhes) = (0.0_f64, 0.0);
    let mut step = 0;
    let counters = runs.play(&scene, |now| {
        step += 1;
        if step % 10 == 0 {
            writhes = writhe(&nodes(&scene.model, now.state));
            linked = linked.max((writhes + twist(now.state)).abs());
        }
    })?;
    if writhes.abs() < 1.0 {
        linked = f64::NAN;
    }
    let tolerance = runs.settings().step.contact_tolerance;
    Ok(vec![
        Quantity::new("twist at which it buckles [rad/m]", [found, right], 0.01, "Greenhill 1883, clamped ends")
            .beside("PyElastica 1.1 % with 50 elements; MuJoCo diverges"),
        Quantity::new(
            "change of link, twist + writhe [turns]",
            [linked, 0.0],
            1e-4,
            "kept (Calugareanu, White, Fuller)",
        ),
        Quantity::new("deepest overlap [radii]", [counters.deepest_penetration, 0.0], tolerance, "contact tolerance"),
    ])
}

/// The rate [1/s] at which a small deflection grows without damping, at this twist [rad/m].
fn growth(runs: &mut Runs<'_>, twist: f64) -> Result<f64, BenchmarkError> {
    let settings = [
        format!("rods.rope.rest.darboux_per_m=[0, 0, {}]", -twist),
        "damping.linear_per_s=0".to_owned(),
        "run.dt_s=0.005".to_owned(),
        "run.steps=400".to_owned(),
    ];
    let scene = scene::builtin_set("plectoneme", &settings)?;
    let mut sizes = Vec::new();
    runs.play(&scene, |now| {
        let aside = now.state.positions.iter().map(|x| x.y * x.y + x.z * x.z).fold(0.0, f64::max).sqrt();
        sizes.push((now.time, aside));
    })?;
    // Over the last two decades of what is small still.
    let at = |size: f64| sizes.iter().find(|(_, aside)| *aside > size).map_or(f64::NAN, |(time, _)| *time);
    let [from, to] = [3e-5, 3e-3];
    Ok((to / from as f64).ln() / (at(to) - at(from)))
}

/// The knotted rope is pulled tight: it stays a trefoil, and lies beside itself.
pub(super) fn knotted(runs: &mut Runs<'_>) -> Measured {
    let scene = scene::builtin("knot")?;
    let (mut worst, mut step) = (0.0_f64, 0);
    let last = scene.model.segments.len() - 1;
    let counters = runs.play(&scene, |now| {
        step += 1;
        if step % 10 == 0 {
            let found = knot::determinant(&nodes(&scene.model, now.state)[1..=last]);
            worst = if (found - 3.0).abs() > (worst - 3.0).abs() || worst == 0.0 { found } else { worst };
        }
    })?;
    let tolerance = runs.settings().step.contact_tolerance;
    Ok(vec![
        Quantity::new("determinant of the knot", [worst, 3.0], 1e-6, "trefoil"),
        Quantity::new("deepest overlap [radii]", [counters.deepest_penetration, 0.0], tolerance, "contact tolerance"),
    ])
}
