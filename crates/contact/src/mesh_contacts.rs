//! Contacts with the faces and edges of triangle meshes.
//!
//! A segment's axis and a mesh are nearest at an end of the axis and inside of a face, or at the axis and an edge: the end is
//! held off the face, and the axis off the edge as off a capsule without a radius. A segment stays on the side of a face on
//! which it is at the start of the step. The round side of a cylinder is an edge along its axis that has a radius: it comes after
//! the edges of the mesh.

use collision::mesh::{Edge, Face, RoundSide};
use collision::sweep::first_touch;
use collision::{Aabb, MovingCapsule};
use kernels::math::Vec3;
use nalgebra::Vector3;
use rod::Friction;

use super::convert::{to_kernel, to_nalgebra};
use super::geometry::Contact;
use super::key::{Feature, Partner};
use super::shape::{Carrier, Poses, Shape, Side, are_parallel};
use crate::params::NarrowPhaseParams;

/// How far beside a face a place may be and still belong to it, relative to the segment's radius: no gap is left between two
/// faces.
pub(super) const BESIDE: f64 = 1e-6;
/// Sine of the angle by which the direction to a segment may leave those for which an edge stands.
pub(super) const ASKEW: f64 = 1e-3;
/// Cosine of the angle below which two normals are nearly the same.
pub(super) const ALIKE: f64 = 0.7;

impl Contact {
    /// Whether a mesh is part of it.
    pub fn is_of_mesh(&self) -> bool {
        self.key.1.whole() != self.key.1 || matches!(self.key.2, Feature::Corner(_) | Feature::Edge(_))
    }

    /// Evaluates a contact with a part of a mesh.
    pub(super) fn with_part(&mut self, own: &Side, mesh: &Carrier<'_>, poses: Poses) {
        match self.key.1 {
            Partner::Face(_, k) | Partner::BodyFace(_, k) => {
                if let Some(face) = mesh.mesh.faces().get(k as usize) {
                    self.with_face(own, mesh, face, usize::from(self.key.2 == Feature::Own(1)));
                }
            }
            Partner::Edge(_, k) | Partner::BodyEdge(_, k) => {
                if let Some(edge) = mesh.mesh.edges().get(k as usize) {
                    self.with_edge(own, mesh, edge, self.key.2, poses);
                } else if let Some(side) = mesh.mesh.round_side() {
                    self.with_round_side(own, mesh, side, self.key.2, poses);
                }
            }
            Partner::Segment(_) | Partner::Obstacle(_) | Partner::Corner(..) | Partner::Sheath(_) => {}
        }
    }

    /// Evaluates the contact of one end, 0 or 1, with a face.
    pub(super) fn with_face(&mut self, own: &Side, mesh: &Carrier<'_>, face: &Face, end: usize) {
        let (from, to) = (mesh.to_mesh(0, own.ends_before[end]), mesh.to_mesh(1, own.ends[end]));
        let heights = [&from, &to].map(|place| face.height(place));
        let mut side = if heights[0] < 0.0 { -1.0 } else { 1.0 };
        let mut place = to;
        if side * heights[1] < 0.0 {
            // Where it has come through, it counts where.
            place = from + (to - from) * (heights[0] / (heights[0] - heights[1]));
            if !face.holds(&place, BESIDE * own.radius) && mesh.mesh.is_outside(&from, heights[1]) {
                // It came around the face, and touches its other side.
                (side, place) = (-side, to);
            }
        }
        let height = side * heights[1];
        self.is_duplicate = !face.holds(&place, BESIDE * own.radius);
        let (mut normal, mut gap) = (face.normal * side, height - own.radius);
        if self.is_duplicate {
            let apart = to - face.nearest(&to);
            let distance = apart.norm();
            if height > 0.0 {
                (normal, gap) = (apart / distance, distance - own.radius);
            } else {
                // It came around the face, and does not touch it.
                gap = distance;
            }
        }
        let normal = mesh.turned(&normal);
        let place = own.ends[end] - normal * (own.radius + 0.5 * gap);
        let other = mesh.body.is_some().then(|| mesh.side(&[face.corners[0]; 2]));
        self.set(own, other.as_ref(), normal, gap, place);
    }

    /// Evaluates a contact with an edge.
    pub(super) fn with_edge(&mut self, own: &Side, mesh: &Carrier<'_>, edge: &Edge, feature: Feature, poses: Poses) {
        // What has passed through the edge is held off in any direction.
        if let Some(direction) = self.between(own, &mesh.side(&edge.ends), feature, poses) {
            self.is_duplicate |= edge.outward.iter().any(|out| mesh.turned(out).dot(direction) < -ASKEW);
        }
    }
}

impl Contact {
    /// Evaluates a contact with the round side of a cylinder: as with a capsule, but none with its ends.
    fn with_round_side(&mut self, own: &Side, mesh: &Carrier<'_>, side: &RoundSide, feature: Feature, poses: Poses) {
        let other = Side { radius: side.radius, ..mesh.side(&side.ends) };
        if let Some(direction) = self.between(own, &other, feature, poses) {
            self.is_duplicate |= mesh.turned(&Vector3::z()).dot(direction).abs() > ASKEW;
        }
    }
}

/// A segment over a step, in the axes of a mesh.
pub(super) struct SweptCapsule {
    capsule: MovingCapsule,
    /// How far from its way it looks for what it may touch, and how far it may leave the way [m].
    reach: f64,
    slack: f64,
}

impl SweptCapsule {
    /// A way with `slack` [m] about it.
    pub(super) fn new(capsule: MovingCapsule, slack: f64) -> Self {
        Self { reach: capsule.radius, slack, capsule }
    }

    pub(super) fn ends(&self) -> [Vector3<f64>; 4] {
        let ([a, b], [c, d]) = (self.capsule.from, self.capsule.to);
        [a, b, c, d]
    }

    pub(super) fn room(&self, places: &[Vector3<f64>]) -> Aabb {
        let low = places.iter().fold(places[0], |low, place| low.inf(place));
        let high = places.iter().fold(places[0], |high, place| high.sup(place));
        Aabb { min: low.add_scalar(-self.reach), max: high.add_scalar(self.reach) }
    }

    /// Whether one end may touch a face.
    pub(super) fn end_meets(&self, end: usize, face: &Face) -> bool {
        let places = [&self.capsule.from[end], &self.capsule.to[end]];
        let [before, after] = places.map(|place| face.height(place));
        let is_near = before * after <= 0.0 || before.abs().min(after.abs()) <= self.reach;
        let is_beside = |k: usize| {
            let beyond = |place: &Vector3<f64>| face.outward[k].dot(&(place - face.corners[k])) > self.slack;
            places.into_iter().all(beyond)
        };
        is_near && !(0..3).any(is_beside)
    }

    /// Whether the axis may touch the round side of a cylinder.
    fn meets_round(&self, side: &RoundSide) -> bool {
        let [bottom, top] = side.ends.map(|end| end.z);
        let ends = self.ends();
        let is_beside = ends.iter().all(|place| place.z < bottom - self.slack)
            || ends.iter().all(|place| place.z > top + self.slack);
        let still = MovingCapsule { from: side.ends, to: side.ends, radius: side.radius };
        !is_beside && first_touch(&self.capsule, &still).is_some()
    }

    /// Whether the axis may touch an edge.
    pub(super) fn meets(&self, edge: &Edge) -> bool {
        let is_beside =
            |out: &Vector3<f64>| self.ends().iter().all(|place| out.dot(&(place - edge.ends[0])) < -self.slack);
        let still = MovingCapsule { from: edge.ends, to: edge.ends, radius: 0.0 };
        !edge.outward.iter().any(is_beside) && first_touch(&self.capsule, &still).is_some()
    }
}

/// Appends the possible contacts of segment `index`, whose ends go from `from` to `to` in the world, with the mesh of `whole`.
pub(super) fn detect(
    (index, shape): (u32, &Shape),
    [from, to]: [[Vec3<f64>; 2]; 2],
    (whole, carrier): (Partner, &Carrier<'_>),
    (friction, params): (Friction, &NarrowPhaseParams),
    out: &mut Vec<Contact>,
) {
    let mesh = carrier.mesh;
    let slack = params.search_room * shape.radius;
    let reach = shape.radius + slack;
    let local = |when: usize, ends: [Vec3<f64>; 2]| ends.map(|end| carrier.to_mesh(when, end));
    let way = SweptCapsule::new(MovingCapsule { from: local(0, from), to: local(1, to), radius: reach }, slack);
    let contact = |partner, feature| Contact::new((index, partner, feature), friction, shape.radius);
    let face = |k| match whole.segment() {
        Some(i) => Partner::BodyFace(i, k),
        None => Partner::Face(whole.obstacle().unwrap_or_default(), k),
    };
    let edge = |k| match whole.segment() {
        Some(i) => Partner::BodyEdge(i, k),
        None => Partner::Edge(whole.obstacle().unwrap_or_default(), k),
    };
    for end in (0..2).filter(|&end| shape.ends[end]) {
        let room = way.room(&[way.capsule.from[end], way.capsule.to[end]]);
        mesh.face_tree().overlaps(&room, |k| {
            if !mesh.is_round_face(k as usize) && way.end_meets(end, &mesh.faces()[k as usize]) {
                out.push(contact(face(k), Feature::Own(end as u8)));
            }
        });
    }
    let mut with_edge = |k: u32, ends: &[Vector3<f64>; 2]| {
        let ends = ends.each_ref().map(|end| carrier.to_world(0, end));
        let stands = |feature: &&Feature| match **feature {
            Feature::Own(end) => shape.ends[end as usize],
            _ => true,
        };
        let features: &[Feature] =
            if are_parallel(from, ends, params.parallel) { &Feature::PARALLEL } else { &[Feature::Nearest] };
        out.extend(features.iter().filter(stands).map(|&feature| contact(edge(k), feature)));
    };
    mesh.edge_tree().overlaps(&way.room(&way.ends()), |k| {
        let own = &mesh.edges()[k as usize];
        if !mesh.is_round_edge(k as usize) && way.meets(own) {
            with_edge(k, &own.ends);
        }
    });
    if let Some(side) = mesh.round_side().filter(|side| way.meets_round(side)) {
        with_edge(mesh.edges().len() as u32, &side.ends);
    }
}

/// Whether a mesh is so far from a box in the world that nothing in that touches it.
pub(super) fn is_out_of_reach(carrier: &Carrier<'_>, room: &Aabb) -> bool {
    let (middle, half) = ((room.min + room.max) * 0.5, (room.max - room.min).norm() * 0.5);
    let seen = |when| {
        let middle = carrier.to_mesh(when, to_kernel(&middle));
        Aabb { min: middle.add_scalar(-half), max: middle.add_scalar(half) }
    };
    // All that lies between counts: the mesh may pass the box within the step.
    let way = seen(0).union(&seen(1));
    carrier.mesh.face_tree().bounds().is_none_or(|bounds| !bounds.overlaps(&way))
}

/// Whether ends are still where a search for parts saw them, within its slack.
pub(super) fn stay(ends: [Vec3<f64>; 2], seen: &[Vec3<f64>; 2], slack: f64) -> bool {
    ends.iter().zip(seen).all(|(&end, &seen)| to_nalgebra(end - seen).norm() <= slack)
}

/// The deepest contact so far of those that are alike.
pub struct Deepest {
    segment: u32,
    whole: Partner,
    sector: u8,
    normal: Vec3<f64>,
    gap: f64,
    contact: usize,
}

/// Lets contacts with meshes wait that do not press yet, for a deeper one of the same part of the segment and of nearly the
/// same normal: a fine mesh has many under a segment, of which one or two come to press. `gap` is that which a contact would
/// have without a change, by its index [m], `sector` says on which part of the segment it is, or that it does not wait; what waits and is
/// too deep afterwards has its turn in the next iteration.
pub fn let_wait(
    contacts: &mut [Contact],
    gap: impl Fn(&Contact) -> f64,
    sector: impl Fn(&Contact) -> Option<u8>,
    deepest: &mut Vec<Deepest>,
) {
    deepest.clear();
    for k in 0..contacts.len() {
        let contact = &mut contacts[k];
        let (segment, partner, _) = contact.key;
        let whole = partner.whole();
        let Some(sector) = sector(contact) else { continue };
        contact.is_deferred = false;
        let is_known = contact.impulse != Vec3::zero() || contact.guess != [0.0; 3];
        if is_known || contact.is_duplicate {
            continue;
        }
        let own = Deepest { segment, whole, sector, normal: contact.normal, gap: gap(contact), contact: k };
        if deepest.first().is_some_and(|first| first.segment != segment) {
            deepest.clear();
        }
        let is_alike = |other: &&mut Deepest| {
            (other.whole, other.sector) == (whole, sector) && other.normal.dot(own.normal) > ALIKE
        };
        match deepest.iter_mut().find(is_alike) {
            None => deepest.push(own),
            Some(other) if own.gap < other.gap => {
                contacts[other.contact].is_deferred = true;
                *other = own;
            }
            Some(_) => contacts[k].is_deferred = true,
        }
    }
}
