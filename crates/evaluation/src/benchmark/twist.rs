//! Ropes with twist and knots: buckling, the plectoneme's link, the knot.

use std::f64::consts::TAU;

use cosserat::assembly::Section;
use cosserat::scene;
use cosserat::state::{Model, State, darboux};
use nalgebra::{UnitQuaternion, Vector3};

use super::quantity::{BenchmarkError, Measured, Quantity};
use super::runs::Runs;
use super::theory::buckling_moment;
use crate::knot;

/// The writhe of an open polygon [turns], closed far away where its ends go straight on along `ways`: Gauss's integral over all pairs
/// of edges, each in closed form (Banchoff 1976; Klenin and Langowski 2000).
fn writhe(nodes: &[Vector3<f64>], ways: [Vector3<f64>; 2]) -> f64 {
    let far = 1e4 * nodes.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum::<f64>();
    let [before, after] = [nodes[0] + ways[0] * far, nodes[nodes.len() - 1] + ways[1] * far];
    let all: Vec<_> = std::iter::once(before).chain(nodes.iter().copied()).chain([after]).collect();
    let mut sum = 0.0;
    for i in 0..all.len() - 1 {
        for k in i + 2..all.len() - 1 {
            sum += solid_angle([all[i], all[i + 1]], [all[k], all[k + 1]]);
        }
    }
    sum / TAU
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

/// Turn of frames about their axis from the first to the last [turns], beside parallel transport.
fn twist(frames: &[UnitQuaternion<f64>]) -> f64 {
    let turn = |pair: &[UnitQuaternion<f64>]| {
        let (s, u) = darboux::relative_rotation(&pair[0], &pair[1]);
        2.0 * (u.z * s.signum()).atan2(s.abs())
    };
    frames.windows(2).map(turn).sum::<f64>() / TAU
}

/// Twist and writhe of a rope whose end faces keep the directions that they have in `first` [turns].
fn twist_and_writhe(model: &Model, first: &State, now: &State) -> [f64; 2] {
    let last = model.segments.len() - 1;
    let held = [0, last].map(|i| first.orientations[i]);
    let frames: Vec<_> = [held[0]].into_iter().chain(now.orientations.iter().copied()).chain([held[1]]).collect();
    [twist(&frames), writhe(&nodes(model, now), [-first.axis(0), first.axis(last)])]
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
    // The square of the rate is M^2 (M^2 - 4 b T) / 16 b^3 of the mass per length on a long rod; on this one it is zero elsewhere.
    let mut rates = Vec::new();
    for share in [1.02, 1.04] {
        let rate = growth(runs, share * right)?;
        rates.push(((share * right).powi(2), (rate / (share * right)).powi(2)));
    }
    let [(x, a), (y, b)] = [rates[0], rates[1]];
    let found = (x - a * (y - x) / (b - a)).sqrt();

    let (mut linked, mut wound, mut step) = (0.0_f64, 0.0, 0);
    let counters = runs.play(&scene, |now| {
        step += 1;
        if step % 10 == 0 {
            let [twist, writhe] = twist_and_writhe(&scene.model, &scene.state, now.state);
            (linked, wound) = (linked.max((twist + writhe).abs()), writhe);
        }
    })?;
    if wound.abs() < 1.0 {
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
        "run.dt_s=0.01".to_owned(),
        "run.steps=900".to_owned(),
    ];
    let scene = scene::builtin_set("plectoneme", &settings)?;
    let mut sizes = Vec::new();
    runs.play(&scene, |now| {
        let aside = now.state.positions.iter().map(|x| x.y * x.y + x.z * x.z).fold(0.0, f64::max).sqrt();
        sizes.push((now.time, aside));
    })?;
    // Over a decade in which it is small, and far beyond what the load alone does.
    let at = |size: f64| {
        let [(t, a), (u, b)] =
            sizes.windows(2).find(|pair| pair[1].1 > size).map_or([(f64::NAN, 1.0); 2], |pair| [pair[0], pair[1]]);
        t + (u - t) * (size / a).ln() / f64::ln(b / a)
    };
    let [from, to] = [1e-4, 1e-3];
    Ok(f64::ln(to / from) / (at(to) - at(from)))
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
