//! Which contacts are possible in a step: broad phase over the ways of all segments, and what to hold apart of each pair.

use collision::{Aabb, SpatialHash};
use nalgebra::Vector3;
use rod::{Contacts, Model, ObstacleShape, Surface};

use super::convert::{to_kernel, to_nalgebra};
use super::exclusion::PairFilter;
use super::geometry::{Contact, Feature, Partner, Shape, World};
use crate::connected_set::ConnectedSet;
use crate::contact_params::ContactParams;
use crate::kernel::math::Vec3;

/// Finds the possible contacts of a step.
pub(crate) struct Detector {
    shapes: Vec<Shape>,
    contacts: Contacts,
    filter: PairFilter,
    params: ContactParams,
    hash: SpatialHash,
    /// Boxes of all segments' ways with room, then of all bounded obstacles.
    boxes: Vec<Aabb>,
    /// Bounded obstacles, in the order of their boxes.
    bounded: Vec<u32>,
    pairs: Vec<[u32; 2]>,
}

impl Detector {
    /// A detector for a model whose segments are found at `shapes`, of those pairs that pass the `filter`.
    pub(crate) fn new(model: &Model, shapes: Vec<Shape>, filter: PairFilter, params: ContactParams) -> Self {
        let contacts = model.contacts.clone();
        let is_bounded = |&i: &u32| contacts.obstacles[i as usize].shape.capsule().is_some();
        let bounded = (0..contacts.obstacles.len() as u32).filter(is_bounded).collect();
        let (hash, boxes, pairs) = (SpatialHash::new(), Vec::new(), Vec::new());
        Self { shapes, contacts, filter, params, hash, boxes, bounded, pairs }
    }

    /// Everything that can touch.
    pub(crate) fn world(&self) -> World<'_> {
        World { shapes: &self.shapes, obstacles: &self.contacts.obstacles }
    }

    /// Notes whether a segment moves freely from now on.
    pub(crate) fn set_free(&mut self, segment: usize, free: bool) {
        self.shapes[segment].free = free;
        self.filter.set_free(segment, free);
    }

    /// Whether every segment is still within the box of the last search.
    pub(crate) fn covers(&self, components: &[ConnectedSet]) -> bool {
        self.shapes.iter().zip(&self.boxes).all(|(shape, room)| {
            let component = &components[shape.component as usize].component;
            let ends = shape.place(&component.poses[shape.body as usize]);
            !shape.free || ends.iter().all(|&end| within(room, to_nalgebra(end), shape.radius))
        })
    }

    /// Replaces `out` by the possible contacts on the ways of all segments from their start over the prediction to where
    /// they are, in the order of their keys.
    pub(crate) fn detect(&mut self, components: &[ConnectedSet], out: &mut Vec<Contact>) {
        self.boxes.clear();
        for shape in &self.shapes {
            let component = &components[shape.component as usize].component;
            let body = shape.body as usize;
            let poses = [&component.start[body], &component.predicted[body], &component.poses[body]];
            let ends = poses.into_iter().flat_map(|pose| shape.place(pose)).map(to_nalgebra);
            self.boxes.push(around(ends, shape.radius * (1.0 + self.params.search_room)));
        }
        out.clear();
        self.with_half_spaces(out);
        let bounded = self.bounded.iter().filter_map(|&i| self.contacts.obstacles[i as usize].shape.capsule());
        self.boxes.extend(bounded.map(|(ends, radius)| around(ends.into_iter(), radius)));
        if self.filter.has_pairs(self.bounded.len()) {
            self.hash.rebuild(&self.boxes);
            let mut pairs = std::mem::take(&mut self.pairs);
            pairs.clear();
            self.hash.pairs(|a, b| self.filter.contains(a, b), &mut pairs);
            for &[a, b] in &pairs {
                self.add_pair(a, b, components, out);
            }
            self.pairs = pairs;
        }
        out.sort_unstable_by_key(|contact| contact.key);
    }

    fn add_pair(&self, a: u32, b: u32, components: &[ConnectedSet], out: &mut Vec<Contact>) {
        let ends = |i: u32| {
            let shape = &self.shapes[i as usize];
            shape.place(&components[shape.component as usize].component.start[shape.body as usize])
        };
        let own = &self.shapes[a as usize];
        let segments = self.shapes.len() as u32;
        let (partner, other, radius) = if b < segments {
            (Partner::Segment(b), ends(b), self.shapes[b as usize].radius.min(own.radius))
        } else {
            let index = self.bounded[(b - segments) as usize];
            let Some((axis, _)) = self.contacts.obstacles[index as usize].shape.capsule() else { return };
            (Partner::Obstacle(index), axis.map(|end| to_kernel(&end)), own.radius)
        };
        let friction = self.surface(partner).friction;
        let parallel = are_parallel(ends(a), other, self.params.parallel);
        let features: &[Feature] = if parallel { &Feature::PARALLEL } else { &[Feature::Nearest] };
        let stands = |feature: &&Feature| match **feature {
            Feature::Nearest => true,
            Feature::Own(end) => own.ends[end as usize],
            Feature::Partners(end) => match partner {
                Partner::Segment(b) => self.shapes[b as usize].ends[end as usize],
                Partner::Obstacle(_) => true,
            },
        };
        let contact = |&feature: &Feature| Contact::new((a, partner, feature), friction, radius);
        out.extend(features.iter().filter(stands).map(contact));
    }

    fn with_half_spaces(&self, out: &mut Vec<Contact>) {
        for (i, obstacle) in self.contacts.obstacles.iter().enumerate() {
            let ObstacleShape::HalfSpace { point, normal } = &obstacle.shape else { continue };
            for (a, (shape, room)) in self.shapes.iter().zip(&self.boxes).enumerate() {
                // The room's corner that lies deepest.
                let corner = Vector3::from_fn(|k, _| if normal[k] > 0.0 { room.min[k] } else { room.max[k] });
                if !shape.free || normal.dot(&(corner - point)) > 0.0 {
                    continue;
                }
                let key = |end| (a as u32, Partner::Obstacle(i as u32), Feature::Own(end));
                let contact = |end| Contact::new(key(end), obstacle.surface.friction, shape.radius);
                out.extend([0, 1].into_iter().filter(|&end| shape.ends[end as usize]).map(contact));
            }
        }
    }

    /// How a contact answers.
    pub(crate) fn surface(&self, partner: Partner) -> Surface {
        match partner {
            Partner::Segment(_) => self.contacts.between_segments.unwrap_or_default(),
            Partner::Obstacle(i) => self.contacts.obstacles[i as usize].surface,
        }
    }

    /// Whether bodies may overlap at the start.
    pub(crate) fn allows_overlap(&self) -> bool {
        self.contacts.allow_overlap
    }

    /// Whether any surface bounces.
    pub(crate) fn bounces(&self) -> bool {
        let all = self.contacts.obstacles.iter().map(|obstacle| obstacle.surface);
        all.chain(self.contacts.between_segments).any(|surface| surface.restitution > 0.0)
    }
}

/// The box of balls of one radius.
fn around(centres: impl Iterator<Item = Vector3<f64>>, radius: f64) -> Aabb {
    let infinite = Vector3::repeat(f64::INFINITY);
    let (min, max) = centres.fold((infinite, -infinite), |(min, max), centre| (min.inf(&centre), max.sup(&centre)));
    let room = Vector3::repeat(radius);
    Aabb { min: min - room, max: max + room }
}

/// Whether a ball is inside of a box.
fn within(room: &Aabb, centre: Vector3<f64>, radius: f64) -> bool {
    (0..3).all(|k| room.min[k] <= centre[k] - radius && centre[k] + radius <= room.max[k])
}

/// Whether the squared sine of the angle between two axes is below `most`.
fn are_parallel(a: [Vec3<f64>; 2], b: [Vec3<f64>; 2], most: f64) -> bool {
    let (a, b) = (a[1] - a[0], b[1] - b[0]);
    let size = a.norm_squared() * b.norm_squared();
    size > 0.0 && a.cross(b).norm_squared() < most * size
}
