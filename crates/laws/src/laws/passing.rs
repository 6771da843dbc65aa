//! Whether axes pass through each other or into obstacles, by brute force over all pairs.
//!
//! Ends of axes go on straight lines from one state to the next. Two axes cross where their four ends lie in one plane, within
//! both their lengths, which is looked for in many parts of the step.

use cosserat::assembly::{Obstacle, ObstacleShape};
use cosserat::internals::collision::TriangleMesh;
use nalgebra::Vector3;

use super::contact::{distance, line, seen_from};
use crate::law::{Law, Violation};
use crate::step::Step;

/// Parts of a step in which each pair is looked at.
const PARTS: usize = 48;

type Swept = [[Vector3<f64>; 2]; 2];

fn at(axis: &Swept, t: f64) -> [Vector3<f64>; 2] {
    [0, 1].map(|end| axis[0][end].lerp(&axis[1][end], t))
}

fn volume(a: &Swept, b: &Swept, t: f64) -> f64 {
    let (a, b) = (at(a, t), at(b, t));
    (b[0] - a[0]).dot(&(a[1] - a[0]).cross(&(b[1] - b[0])))
}

/// Whether two lines in one plane cross within both their ends.
fn within(a: &[Vector3<f64>; 2], b: &[Vector3<f64>; 2]) -> bool {
    let (u, v, w) = (a[1] - a[0], b[1] - b[0], b[0] - a[0]);
    let normal = u.cross(&v);
    let area = normal.norm_squared();
    if area < 1e-20 * u.norm_squared() * v.norm_squared() {
        return false;
    }
    let (s, t) = (w.cross(&v).dot(&normal) / area, w.cross(&u).dot(&normal) / area);
    (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)
}

fn cross(a: &Swept, b: &Swept) -> bool {
    let mut low = (0.0, volume(a, b, 0.0));
    for part in 1..=PARTS {
        let time = part as f64 / PARTS as f64;
        let high = (time, volume(a, b, time));
        if low.1 * high.1 <= 0.0 && low.1 != high.1 {
            let (mut from, mut to) = (low.0, high.0);
            for _ in 0..50 {
                let middle = 0.5 * (from + to);
                if volume(a, b, middle) * low.1 > 0.0 { from = middle } else { to = middle }
            }
            if within(&at(a, to), &at(b, to)) {
                return true;
            }
        }
        low = high;
    }
    false
}

pub(super) fn passing(step: &Step<'_>, violations: &mut Vec<Violation>) {
    let model = step.model;
    // In parts of a step bodies go other swept, and where it is not solved anything may be.
    if !step.is_whole() || model.contacts.is_empty() || model.contacts.allow_overlap {
        return;
    }
    let swept: Vec<Option<Swept>> = (0..model.segments.len())
        .map(|i| {
            let [before, after] = step.states.map(|state| line(step, state, i).map(|(axis, _)| axis));
            Some([before?, after?])
        })
        .collect();
    for (k, obstacle) in model.contacts.obstacles.iter().enumerate() {
        let times = [step.time - step.dt, step.time];
        for i in (0..model.segments.len()).filter(|&i| step.is_free(i)) {
            let Some(axis) = &swept[i] else { continue };
            if let Some(message) = enters(obstacle, times, axis) {
                let message = format!("the axis of segment {i} {message} obstacle {k} ({})", obstacle.shape.kind());
                violations.push(Violation { law: Law::Passing, step: step.number, ratio: f64::INFINITY, message });
            }
        }
    }
    if model.contacts.between_segments.is_none() {
        return;
    }
    for i in 0..model.segments.len() {
        for j in i + 1..model.segments.len() {
            let (Some(a), Some(b)) = (&swept[i], &swept[j]) else { continue };
            let (x, y) = (bounds(a), bounds(b));
            let apart = (0..3).any(|k| x[0][k] > y[1][k] || y[0][k] > x[1][k]);
            if !apart && !step.excluded.contains(model, i, j) && cross(a, b) {
                let message = format!("the axes of segments {i} and {j} pass through each other");
                violations.push(Violation { law: Law::Passing, step: step.number, ratio: f64::INFINITY, message });
            }
        }
    }
}

fn bounds(axis: &Swept) -> [Vector3<f64>; 2] {
    let [a, b, c, d] = [axis[0][0], axis[0][1], axis[1][0], axis[1][1]];
    [a.inf(&b).inf(&c.inf(&d)), a.sup(&b).sup(&c.sup(&d))]
}

/// Whether an axis that was outside of an obstacle is in it after the step, or passes through it on its axis; at these times [s].
fn enters(obstacle: &Obstacle, times: [f64; 2], axis: &Swept) -> Option<&'static str> {
    let own = [0, 1].map(|when| seen_from(obstacle, times[when], axis[when]));
    match &obstacle.shape {
        ObstacleShape::HalfSpace { .. } | ObstacleShape::Sphere { .. } | ObstacleShape::Capsule { .. } => {
            let [before, after] = own.each_ref().map(|axis| distance(obstacle, axis));
            if before > 0.0 && after < 0.0 {
                return Some("is inside of");
            }
            let ways = times.map(|time| match obstacle.shape_at(time) {
                ObstacleShape::Capsule { start, end, .. } => Some([start, end]),
                _ => None,
            });
            let [Some(from), Some(to)] = ways else { return None };
            cross(axis, &[from, to]).then_some("passes through the axis of")
        }
        shape => {
            let (mesh, turn) = shape.surface()?;
            let local = own.map(|axis| axis.map(|place| turn.inverse() * (place - shape.pivot())));
            let corners = |triangle: &[u32; 3]| triangle.map(|i| mesh.positions[i as usize]);
            let crosses = |axis: &[Vector3<f64>; 2]| mesh.triangles.iter().any(|t| pierces(axis, &corners(t)));
            if !crosses(&local[0]) && crosses(&local[1]) {
                return Some("goes through the surface of");
            }
            let mesh = TriangleMesh::new(&mesh.positions, &mesh.triangles);
            let is_in = |axis: &[Vector3<f64>; 2]| axis.iter().any(|end| mesh.encloses(end));
            (!is_in(&local[0]) && is_in(&local[1])).then_some("is inside of")
        }
    }
}

/// Whether a line goes through a triangle.
fn pierces(line: &[Vector3<f64>; 2], [a, b, c]: &[Vector3<f64>; 3]) -> bool {
    let normal = (b - a).cross(&(c - a));
    let [from, to] = line.map(|place| normal.dot(&(place - a)));
    if from * to >= 0.0 {
        return false;
    }
    let place = line[0].lerp(&line[1], from / (from - to));
    [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(&(place - *p)).dot(&normal) > 0.0)
}
