//! Our values of the paper's settings, from the code that uses them, written as the paper's are.

use std::f64::consts::TAU;

use dataset::Scenario;
use nalgebra::Vector3;
use scene::sampling::{self, Helix, Parameters, Rod};
use scene::{Scene, SceneError, builtin};

/// Our value, or why the scene that has it cannot be read.
pub(super) type Value = Result<String, SceneError>;

/// As short as it can be, to nine digits after the point: 0.02, 45, 1e5.
fn number(value: f64) -> String {
    let rounded = (value * 1e9).round() / 1e9;
    if rounded.abs() >= 1e4 { format!("{rounded:e}") } else { format!("{rounded}") }
}

/// A number with its unit.
pub(super) fn with_unit(value: f64, unit: &str) -> Value {
    Ok(format!("{} {unit}", number(value)))
}

/// A count.
pub(super) fn count(value: usize) -> Value {
    Ok(value.to_string())
}

/// The range of a parameter of a scenario.
pub(super) fn range(scenario: Scenario, key: &str, unit: &str) -> Value {
    let ranges = scenario.ranges();
    let [low, high] = ranges.get(key).copied().unwrap_or([f64::NAN; 2]);
    Ok(format!("{} to {}{unit}", number(low), number(high)))
}

/// A rod, in words.
pub(super) fn rod(rod: &Rod) -> String {
    let Rod { segments, youngs_modulus, angle_deg, length, .. } = *rod;
    let [angle, length, modulus] = [angle_deg, length, youngs_modulus].map(number);
    format!("phi_0 = {angle} deg, N = {segments}, l = {length} m, Y = {modulus} Pa")
}

/// A helix, in words.
pub(super) fn helix(helix: &Helix) -> String {
    let Helix { segments, torsion_modulus, helix_radius, helix_height, winding, .. } = *helix;
    let [radius, height, winding, modulus] = [helix_radius, helix_height, winding, torsion_modulus].map(number);
    format!("HR = {radius} m, HH = {height} m, HW = {winding}, T = {modulus} Pa, N = {segments}")
}

/// A scene of either family, in words.
pub(super) fn parameters(parameters: Parameters) -> Value {
    Ok(match parameters {
        Parameters::Rod(p) => rod(&p),
        Parameters::Helix(p) => helix(&p),
        Parameters::Knot(_) | Parameters::Tree(_) => parameters.to_toml(),
    })
}

/// What a figure of the supplement's dynamic results varies, by `of_rod` or `of_helix`.
pub(super) fn varied(figure: char, of_rod: fn(&Rod) -> f64, of_helix: fn(&Helix) -> String) -> Value {
    let figures = sampling::supplement();
    let scenes = figures.iter().filter(|(letter, _)| *letter == figure).flat_map(|(_, scenes)| scenes);
    let value = |parameters: &Parameters| match parameters {
        Parameters::Rod(p) => number(of_rod(p)),
        Parameters::Helix(p) => of_helix(p),
        Parameters::Knot(_) | Parameters::Tree(_) => parameters.to_toml(),
    };
    Ok(scenes.map(value).collect::<Vec<_>>().join(", "))
}

/// Radius, height and winding number of a helix.
pub(super) fn helix_shape(p: &Helix) -> String {
    format!("({})", [p.helix_radius, p.helix_height, p.winding].map(number).join(", "))
}

/// A helix's number of segments.
pub(super) fn helix_segments(p: &Helix) -> String {
    number(p.segments as f64)
}

/// A helix's torsion modulus.
pub(super) fn helix_modulus(p: &Helix) -> String {
    number(p.torsion_modulus)
}

/// Number of segments of a builtin scene.
pub(super) fn nodes(name: &str) -> Value {
    count(builtin(name)?.model.segments.len())
}

/// Number of rods of a builtin scene.
pub(super) fn rods(name: &str) -> Value {
    count(builtin(name)?.rods.len())
}

/// The helix of "helix-on-plane", as its segments have it: they end on the curve, whose axis is vertical.
pub(super) fn helix_on_plane() -> Value {
    let scene = builtin("helix-on-plane")?;
    let ends: Vec<Vector3<f64>> = ends(&scene);
    let horizontal = |i: usize| ends[i].xy();
    let (a, b, c) = (horizontal(0), horizontal(1), horizontal(2));
    // The circle through three points, relative to the first.
    let (u, v) = (b - a, c - a);
    let centre = nalgebra::Vector2::new(
        v.y * u.norm_squared() - u.y * v.norm_squared(),
        u.x * v.norm_squared() - v.x * u.norm_squared(),
    ) / (2.0 * u.perp(&v));
    let turned = |i: usize| {
        let (from, to) = (horizontal(i) - a - centre, horizontal(i + 1) - a - centre);
        from.perp(&to).atan2(from.dot(&to))
    };
    let turns: f64 = (0..ends.len() - 1).map(turned).sum();
    let height = ends.last().map_or(f64::NAN, |last| last.z - ends[0].z);
    Ok(helix(&Helix {
        segments: scene.model.segments.len(),
        torsion_modulus: scene.model.joints.first().map_or(f64::NAN, |joint| joint.torsion_modulus),
        helix_radius: centre.norm(),
        helix_height: height.abs(),
        winding: turns.abs() / TAU,
        ..Helix::default()
    }))
}

/// Ends of the segments of a scene with one rod, from the first's start on [m].
fn ends(scene: &Scene) -> Vec<Vector3<f64>> {
    let place = |i: usize, side: f64| {
        scene.state.positions[i] + scene.state.axis(i) * (0.5 * side * scene.model.segments[i].length)
    };
    std::iter::once(place(0, -1.0)).chain((0..scene.model.segments.len()).map(|i| place(i, 1.0))).collect()
}

/// The rods of "two-rods".
pub(super) fn two_rods() -> Value {
    let scene = builtin("two-rods")?;
    let lengths = rod::measure::rod_lengths(&scene.model, &scene.state);
    let join = |values: Vec<String>| values.join(" and ");
    let angle = scene.state.axis(0).z.asin().to_degrees();
    Ok(format!(
        "phi_0 = {} deg, N = {}, l = {} m, Y = {} Pa",
        number(angle),
        join(scene.rods.iter().map(|rod| rod.segments.len().to_string()).collect()),
        join(lengths.into_iter().map(number).collect()),
        number(scene.model.joints.first().map_or(f64::NAN, |joint| joint.youngs_modulus))
    ))
}

/// The rope of "knot".
pub(super) fn knot() -> Value {
    let scene = builtin("knot")?;
    let model = &scene.model;
    let joint = |value: fn(&rod::Joint) -> f64| number(model.joints.first().map_or(f64::NAN, value));
    let length: f64 = model.segments.iter().map(|segment| segment.length).sum();
    Ok(format!(
        "N = {}, R = {} m, l = {} m, Y = {} Pa, T = {} Pa",
        model.segments.len(),
        number(model.segments.first().map_or(f64::NAN, |segment| segment.radius)),
        number(length),
        joint(|joint| joint.youngs_modulus),
        joint(|joint| joint.torsion_modulus)
    ))
}
