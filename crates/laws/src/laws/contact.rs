//! Forces of contacts, and how deep bodies are in each other.

use cosserat::assembly::{Obstacle, ObstacleShape, Sheath, Surface};
use cosserat::internals::collision::{TriangleMesh, closest};
use cosserat::simulation::{ContactForce, StepParams, Touched};
use cosserat::state::{Body, Centreline, Joint, Share, State, measure};
use nalgebra::Vector3;

use crate::law::{Law, ROUNDING, Violation};
use crate::step::Step;

/// How exact the direction of sliding friction is: 2 % of the slip.
const SLIDING: f64 = 0.02;

fn surface(step: &Step<'_>, contact: &ContactForce) -> Option<Surface> {
    match contact.other {
        Touched::Segment(other) => {
            let contacts = &step.model.contacts;
            let is_of = |sheath: &&Sheath| sheath.inner.contains(&contact.segment) && sheath.outer.contains(&other);
            let wall = |sheath: &Sheath| Surface { friction: sheath.friction, restitution: 0.0 };
            contacts.sheaths.iter().find(is_of).map(wall).or(contacts.between_segments)
        }
        Touched::Obstacle(k) => Some(step.model.contacts.obstacles[k].surface),
    }
}

pub(super) fn forces(step: &Step<'_>, violations: &mut Vec<Violation>) {
    if !step.is_solved() {
        return;
    }
    for contact in step.contacts {
        let name = || format!("contact of segment {} with {:?}", contact.segment, contact.other);
        let Some(surface) = surface(step, contact) else {
            step.hold(violations, Law::Cone, f64::INFINITY, 0.0, || format!("{}, which cannot touch", name()));
            continue;
        };
        let size = contact.force.norm();
        let normal = contact.force.dot(&contact.normal);
        step.hold(violations, Law::Cone, -normal, ROUNDING * size, || format!("{} pulls: {normal:.3e} N", name()));
        let across = contact.force - contact.normal * normal;
        let most = surface.friction.at_rest * normal.max(0.0);
        let slight = slight(step, contact);
        // The normal is that of the end, which the last correction has turned within the tolerance.
        let allowed = most + (ROUNDING + StepParams::DEFAULT.contact_tolerance) * size + slight;
        step.hold(violations, Law::Cone, across.norm(), allowed, || {
            format!("{}: friction {:.4e} N, its cone allows {most:.4e} N of {normal:.4e} N", name(), across.norm())
        });
        // Slip within the tolerance of what sticks has any direction.
        let (work, far) = (across.dot(&contact.slip), contact.slip.norm());
        let tolerance = StepParams::DEFAULT.contact_tolerance * radius(step, contact);
        let turned = (ROUNDING + StepParams::DEFAULT.contact_tolerance) * size;
        let allowed = across.norm() * (SLIDING * far + tolerance) + (turned + slight) * (far + tolerance);
        step.hold(violations, Law::Friction, work, allowed, || {
            format!("{}: friction does {work:.3e} J of work, allowed {allowed:.1e} J", name())
        });
    }
}

/// The force that takes the lighter of two segments as far in a step as contacts may be off [N]: by the tolerance, a share of the radius, or
/// as far as gravity takes it.
fn slight(step: &Step<'_>, contact: &ContactForce) -> f64 {
    // The rule of second order takes forces so far.
    let span = if step.is_euler() { step.dt } else { step.dt * 2.0 / 3.0 };
    let far = StepParams::DEFAULT.contact_tolerance * radius(step, contact) / span.powi(2);
    let gravity = step.model.gravity.norm() * (step.dt / span).powi(2);
    let other = match contact.other {
        Touched::Segment(i) => Some(i),
        Touched::Obstacle(_) => None,
    };
    let free = [Some(contact.segment), other].into_iter().flatten().filter(|&i| step.is_free(i));
    let least = free.map(|i| step.model.segments[i].mass()).fold(f64::INFINITY, f64::min);
    least * if gravity > 0.0 { far.min(gravity) } else { far }
}

fn radius(step: &Step<'_>, contact: &ContactForce) -> f64 {
    let own = |i: usize| {
        let segment = &step.model.segments[i];
        // That of the ball which holds a body with faces.
        if segment.surface().is_some() { segment.length.hypot(2.0 * segment.radius) } else { segment.radius }
    };
    let first = own(contact.segment);
    match contact.other {
        Touched::Segment(i) => first.min(own(i)),
        Touched::Obstacle(_) => first,
    }
}

/// Ends of the axis of a segment [m].
pub(super) fn line(step: &Step<'_>, state: &State, i: usize) -> Option<([Vector3<f64>; 2], f64)> {
    let (half, radius) = step.model.segments[i].capsule()?;
    let arm = state.axis(i) * half;
    Some(([state.positions[i] - arm, state.positions[i] + arm], radius))
}

/// An axis at `time` [s] in the frame of an obstacle, in which its shape stays as it is at time 0. A cylinder alone, where it has turned about
/// its own axis, does not say where the edges of its rim are.
pub(super) fn seen_from(obstacle: &Obstacle, time: f64, axis: [Vector3<f64>; 2]) -> [Vector3<f64>; 2] {
    let (pose, pivot) = (obstacle.at(time).pose, obstacle.shape.pivot());
    axis.map(|place| pivot + pose.orientation.inverse() * (place - pose.position))
}

/// Distance of an axis in the frame of an obstacle from its surface [m], negative where it is within one that is round or flat; of meshes
/// of an axis that crosses none of its triangles.
pub(super) fn distance(obstacle: &Obstacle, axis: &[Vector3<f64>; 2]) -> f64 {
    match &obstacle.shape {
        ObstacleShape::HalfSpace { point, normal } => {
            axis.iter().map(|end| normal.dot(&(end - point))).fold(f64::INFINITY, f64::min)
        }
        ObstacleShape::Sphere { centre, radius } => closest::segments(axis, &[*centre, *centre]).distance - radius,
        ObstacleShape::Capsule { start, end, radius } => closest::segments(axis, &[*start, *end]).distance - radius,
        shape => {
            let Some((mesh, orientation)) = shape.surface() else { return f64::INFINITY };
            let pivot = shape.pivot();
            let own = axis.map(|place| orientation.inverse() * (place - pivot));
            let mesh = TriangleMesh::new(&mesh.positions, &mesh.triangles);
            let ends = own.iter().map(|end| mesh.distance(end)).fold(f64::INFINITY, f64::min);
            let edges = mesh.edges().iter().map(|edge| closest::segments(&own, &edge.ends).distance);
            edges.fold(ends, f64::min)
        }
    }
}

/// How wide joints to other segments gape at an end of a segment [m]. Where segments meet, the end of one stands for both, and a joint that does not yield
/// has the compliance of a rigid one: under 8 MN, with which an obstacle presses an end that a grip holds, it gapes by 8e-6 m.
fn gaping(step: &Step<'_>, i: usize) -> f64 {
    let meets = |joint: &&Joint| {
        let others = [(joint.a, joint.b), (joint.b, joint.a)];
        others.iter().any(|pair| matches!(pair, (Body::Segment(own), Body::Segment(_)) if *own == i))
    };
    let gap = |joint: &Joint| measure::stretch_gap(step.model, step.states[1], joint).norm();
    step.joints().map(|(_, joint, _)| joint).filter(meets).map(gap).fold(0.0, f64::max)
}

/// The distance of a segment's centre from the smooth centreline of a sheath [m]; `None` where the nearest place is beyond a mouth.
fn from_centreline(sheath: &Sheath, line: &Centreline, state: &State, i: usize) -> Option<f64> {
    let point = |place: f64| {
        let share = |share: Share| {
            let k = sheath.outer.start + share.segment;
            state.positions[k] * share.position[0] + state.axis(k) * share.axis[0]
        };
        line.at(place).into_iter().map(share).sum::<Vector3<f64>>()
    };
    let distance = |place: f64| (state.positions[i] - point(place)).norm();
    // The nearest of eight places a segment, then the nearest place by it.
    let count = 8 * line.segments();
    let step = line.length() / count as f64;
    let nearest = (0..=count).min_by(|&a, &b| distance(a as f64 * step).total_cmp(&distance(b as f64 * step)))?;
    if nearest == 0 || nearest == count {
        return None;
    }
    let [mut from, mut to] = [nearest as f64 - 1.0, nearest as f64 + 1.0].map(|k| k * step);
    for _ in 0..60 {
        let [a, b] = [from + (to - from) / 3.0, to - (to - from) / 3.0];
        if distance(a) < distance(b) { to = b } else { from = a }
    }
    Some(distance(0.5 * (from + to)))
}

/// How deep axes with their radii are in each other, and in obstacles.
pub(super) fn depth(step: &Step<'_>, violations: &mut Vec<Violation>) {
    let model = step.model;
    if !step.is_solved() || model.contacts.is_empty() || model.contacts.allow_overlap {
        return;
    }
    let [before, after] = step.states;
    let tolerance = StepParams::DEFAULT.contact_tolerance;
    let count = model.segments.len();
    let lines: Vec<_> = (0..count).map(|i| line(step, after, i)).collect();
    let earlier: Vec<_> = (0..count).map(|i| line(step, before, i)).collect();
    for (k, obstacle) in model.contacts.obstacles.iter().enumerate() {
        for i in (0..count).filter(|&i| step.is_free(i)) {
            let (Some((axis, radius)), Some((old, _))) = (lines[i], earlier[i]) else { continue };
            // What was let go in another stays there until it is pushed out.
            let apart = |time: f64, axis| distance(obstacle, &seen_from(obstacle, time, axis));
            if radius - apart(step.time - step.dt, old) > 2.0 * tolerance * radius {
                continue;
            }
            let found = radius - apart(step.time, axis);
            if found <= tolerance * radius {
                continue;
            }
            let rounding = 1e-12 * (axis[0].norm() + radius) + gaping(step, i);
            step.hold(violations, Law::Depth, found, tolerance * radius * 1.01 + rounding, || {
                let kind = obstacle.shape.kind();
                format!(
                    "segment {i} is {:.3e} radii deep in obstacle {k} ({kind}), status {}",
                    found / radius,
                    step.status.name()
                )
            });
        }
    }
    for (k, sheath) in model.contacts.sheaths.iter().enumerate() {
        let line = sheath.centreline(model);
        for i in sheath.inner.clone().filter(|&i| step.is_free(i) || sheath.outer.clone().any(|j| step.is_free(j))) {
            let [old, new] = [before, after].map(|state| from_centreline(sheath, &line, state, i));
            let radius = model.segments[i].radius;
            let room = sheath.bore(model) - radius;
            let was_inside = old.is_some_and(|old| old < room + 2.0 * tolerance * radius);
            let (true, Some(new)) = (was_inside, new) else { continue };
            let allowed = tolerance * radius * 1.01 + 1e-9 * radius;
            step.hold(violations, Law::Depth, new - room, allowed, || {
                format!("segment {i} is {:.3e} radii deep in the wall of sheath {k}", (new - room) / radius)
            });
        }
    }
    if model.contacts.between_segments.is_none() {
        return;
    }
    for i in 0..count {
        for j in i + 1..count {
            if step.excluded.contains(model, i, j) {
                continue;
            }
            let (Some((a, r)), Some((b, s))) = (lines[i], lines[j]) else { continue };
            let (Some((a_old, _)), Some((b_old, _))) = (earlier[i], earlier[j]) else { continue };
            let least = r.min(s);
            let found = r + s - closest::segments(&a, &b).distance;
            if found > tolerance * least && r + s - closest::segments(&a_old, &b_old).distance > 2.0 * tolerance * least
            {
                continue;
            }
            let rounding = 1e-12 * (a[0].norm() + r + s);
            step.hold(violations, Law::Depth, found, tolerance * least * 1.01 + rounding, || {
                format!(
                    "segments {i} and {j} are {:.3e} radii deep in each other, status {}",
                    found / least,
                    step.status.name()
                )
            });
        }
    }
}
