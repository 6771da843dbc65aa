//! A straight rope with a loose overhand knot, that is an open trefoil.
//!
//! The knot is the torus knot T(2, 3), opened where it is farthest from the torus's axis: there both ends leave along the
//! tangent, pass each other side by side, and then blend into one line. Half a turn about the knot's axis of symmetry
//! maps the rope on itself, its ends swapped.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::rotation_between;

/// Rope that a knot takes, its blends into the straight rope included, in units of its loop; a rope must be that long.
pub const KNOT_ROPE: f64 = 8.8;
/// Segments that are as long as a knot's loop; with fewer the polygon is too coarse for the knot.
pub const KNOT_SEGMENTS: f64 = 8.0;
/// How near two strands of a knot come (their centrelines), in units of its loop.
pub const KNOT_CLEARANCE: f64 = 0.18;

/// Radius of the torus's centre circle, with the radius of its tube as the unit of length.
const MAJOR: f64 = 3.0;
/// A knot's loop, the torus's outer diameter, in that unit.
const LOOP: f64 = 2.0 * (MAJOR + 1.0);
/// How far each end passes beside the middle line of both.
const ASIDE: f64 = 1.0;
/// Angle of the torus knot over which an end leaves the torus.
const LEAVES: f64 = 0.6;
/// Angle, at the speed of the outermost point, over which an end blends into the middle line.
const BLENDS: f64 = 1.4;

/// `segments + 1` nodes [m] of a rope of `length` [m] from `start` along `direction` (any length but zero), with an open
/// overhand knot at its middle, whose loops are `loop_diameter` [m] wide.
///
/// All segments have the same length. Both ends lie on one line; along world x the knot hangs below it. No two strands of
/// the knot come nearer than [`KNOT_CLEARANCE`] loops. `length` must be at least [`KNOT_ROPE`] loops, and `segments` at
/// least [`KNOT_SEGMENTS`] a loop's length of rope.
pub fn knot(
    start: Vector3<f64>,
    direction: Vector3<f64>,
    loop_diameter: f64,
    length: f64,
    segments: usize,
) -> Vec<Vector3<f64>> {
    let unit = loop_diameter / LOOP;
    let half = first_half(length / segments as f64 / unit, segments);
    let middle = usize::from(segments.is_multiple_of(2));
    let swapped = |p: &Vector3<f64>| Vector3::new(-p.x, -p.y, p.z);
    let local = half.iter().rev().copied().chain(half.iter().skip(middle).map(swapped));
    let turn = rotation_between(&Vector3::x(), &direction.normalize());
    let first = half.last().copied().unwrap_or_default();
    local.map(|p| start + turn * (p - first) * unit).collect()
}

/// Nodes from the rope's middle to its start, `chord` apart; the middle one is among them if `segments` is even.
fn first_half(chord: f64, segments: usize) -> Vec<Vector3<f64>> {
    let mut t = PI;
    let mut nodes = Vec::with_capacity(segments / 2 + 1);
    if segments.is_multiple_of(2) {
        nodes.push(curve(t));
    } else {
        t = back(t, |p| 2.0 * p.x.hypot(p.y), chord);
        nodes.push(curve(t));
    }
    while nodes.len() < segments / 2 + 1 {
        let last = nodes[nodes.len() - 1];
        t = back(t, |p| (p - last).norm(), chord);
        nodes.push(curve(t));
    }
    nodes
}

/// The angle before `t` at which `distance` of the curve's point is `chord`: secant method.
fn back(t: f64, distance: impl Fn(Vector3<f64>) -> f64, chord: f64) -> f64 {
    const ROUNDS: usize = 40;
    let error = |t| distance(curve(t)) - chord;
    let step = chord / (2.0 * MAJOR);
    let (mut before, mut now) = (t - 0.5 * step, t - step);
    let (mut error_before, mut error_now) = (error(before), error(now));
    for _ in 0..ROUNDS {
        if error_now == error_before || error_now.abs() <= 1e-15 * chord {
            break;
        }
        let next = now - error_now * (now - before) / (error_now - error_before);
        (before, error_before) = (now, error_now);
        (now, error_now) = (next, error(next));
    }
    now
}

/// The curve's first half, angle `t` at most pi: along the rope, aside, and outwards from the torus.
fn curve(t: f64) -> Vector3<f64> {
    // The outermost point's velocity: 2 (MAJOR + 1) about the torus's axis, 3 about its tube.
    let (around, tube) = (2.0 * (MAJOR + 1.0), 3.0);
    let speed = f64::hypot(around, tube);
    let end = Vector3::new(speed * t, ASIDE * smooth(1.0 + t / BLENDS), 0.0);
    if t <= 0.0 {
        return end;
    }
    let radius = MAJOR + (3.0 * t).cos();
    let (x, y, z) = (radius * (2.0 * t).cos(), radius * (2.0 * t).sin(), (3.0 * t).sin());
    let on_torus = Vector3::new((around * y + tube * z) / speed, (around * z - tube * y) / speed, x - (MAJOR + 1.0));
    end.lerp(&on_torus, smooth(t / LEAVES))
}

/// From 0 at 0 to 1 at 1 with two continuous derivatives.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x.powi(3) * (10.0 + x * (6.0 * x - 15.0))
}
