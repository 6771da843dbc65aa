//! Which contacts are possible in a step: broad phase over the ways of all segments, and what to hold apart of each pair.

use std::ops::Range;

use collision::{Aabb, SpatialHash, TriangleMesh};
use component::Interval;
use component::snapshot::StateVisitor;
use component::{BodyPose, Component};
use kernels::math::Vec3;
use nalgebra::Vector3;
use rod::{BodyShape, CYLINDER_SIDES, Carried, Model, Segment, Surface};

use super::broad_phase::{BroadPhase, SweptBound};
use super::convert::{to_kernel, to_nalgebra};
use super::exclusion::PairFilter;
use super::geometry::{Contact, World};
use super::key::{Feature, Partner};
use super::obstacles::Placed;
use super::shape::{Carrier, Components, Poses, Shape, are_parallel};
use super::sheath::Tube;
use super::{mesh_contacts, solid_contacts};
use crate::params::NarrowPhaseParams;

/// What can touch in a model, and how: the same for all that search it.
pub struct NarrowPhase {
    shapes: Vec<Shape>,
    between_segments: Option<Surface>,
    allow_overlap: bool,
    /// Where they are over the whole step.
    obstacles: Vec<Placed>,
    /// Whether an obstacle turns too far in the step under way.
    turns_too_far: bool,
    filter: PairFilter,
    params: NarrowPhaseParams,
    /// Bounded obstacles, in the order of their boxes.
    bounded: Vec<u32>,
    /// Obstacles with meshes.
    meshes: Vec<u32>,
    /// Segments that are rigid bodies with meshes, ascending.
    bodies: Vec<(u32, TriangleMesh)>,
    /// Sheaths.
    tubes: Vec<Tube>,
    /// Least radius of what touches [m].
    least_radius: f64,
}

impl NarrowPhase {
    /// A detector for a model whose segments are found at `shapes`, of those pairs that pass the `filter`.
    pub fn new(model: &Model, shapes: Vec<Shape>, filter: PairFilter, params: NarrowPhaseParams) -> Self {
        let obstacles: Vec<Placed> = model.contacts.obstacles.iter().map(Placed::new).collect();
        let all = 0..obstacles.len() as u32;
        let bounded = all.clone().filter(|&i| obstacles[i as usize].is_bounded()).collect();
        let meshes: Vec<u32> = all.filter(|&i| obstacles[i as usize].mesh().is_some()).collect();
        let body = |(i, segment): (usize, &Segment)| {
            let mesh = segment.surface()?;
            let mut parts = TriangleMesh::new(&mesh.positions, &mesh.triangles);
            if let Some(&BodyShape::Cylinder { radius, length }) = segment.body.as_ref().map(|body| &body.shape) {
                parts = parts.with_round_side(radius, length);
            }
            Some((i as u32, parts))
        };
        let bodies: Vec<(u32, TriangleMesh)> = model.segments.iter().enumerate().filter_map(body).collect();
        let radii = shapes.iter().filter(|shape| shape.touches()).map(|shape| shape.radius);
        Self {
            least_radius: radii.fold(f64::INFINITY, f64::min),
            meshes,
            bodies,
            shapes,
            between_segments: model.contacts.between_segments,
            allow_overlap: model.contacts.allow_overlap,
            obstacles,
            tubes: model.contacts.sheaths.iter().map(|sheath| Tube::new(model, sheath)).collect(),
            turns_too_far: false,
            filter,
            params,
            bounded,
        }
    }

    /// Whether any obstacle or body has a mesh.
    pub fn has_meshes(&self) -> bool {
        !(self.meshes.is_empty() && self.bodies.is_empty())
    }

    /// Where segments are found.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// The obstacles, as a search sees them.
    fn obstacles<'a>(&'a self, search: &'a BroadPhase) -> &'a [Placed] {
        search.part.as_ref().map_or(&self.obstacles, |part| &part.0)
    }

    /// Everything that can touch, as a search sees it.
    pub fn world<'a>(&'a self, search: &'a BroadPhase) -> World<'a> {
        World { shapes: &self.shapes, obstacles: self.obstacles(search), bodies: &self.bodies, tubes: &self.tubes }
    }

    /// Lets a motion drive an obstacle from the next step on; returns whether there is such an obstacle.
    pub fn drive(&mut self, index: usize, motion: &Carried) -> bool {
        let Some(obstacle) = self.obstacles.get_mut(index) else { return false };
        obstacle.drive(motion);
        true
    }

    /// Shows a visitor what moves the obstacles, and where segments are in sheaths.
    pub fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        visitor.list(&mut self.obstacles, |visitor, obstacle| obstacle.visit_state(visitor));
        self.tubes.iter_mut().for_each(|tube| tube.visit_state(visitor));
    }

    /// Puts the obstacles where their motions have them over a step.
    pub fn place_obstacles(&mut self, interval: Interval) {
        self.turns_too_far = false;
        for obstacle in &mut self.obstacles {
            self.turns_too_far |= obstacle.place(interval);
        }
    }

    /// Follows segments in sheaths to where they are at the start of a step.
    pub fn follow_sheaths(&mut self, components: &impl Components) {
        let Self { tubes, shapes, .. } = self;
        tubes.iter_mut().for_each(|tube| tube.follow(shapes, components));
    }

    /// The outer segments of the sheath that a contact is in.
    pub fn sheath_of(&self, contact: &Contact) -> Option<Range<u32>> {
        if let Partner::Sheath(index) = contact.key.1 { Some(self.tubes[index as usize].outer()) } else { None }
    }

    /// Puts the obstacles where their motions have them over a part of a step, for one search.
    pub fn place_part(&self, search: &mut BroadPhase, interval: Interval) {
        if self.obstacles.iter().all(Placed::stands) {
            return;
        }
        let (own, turns_too_far) = search.part.get_or_insert_with(|| (self.obstacles.clone(), false));
        *turns_too_far = false;
        for obstacle in own {
            *turns_too_far |= obstacle.place(interval);
        }
    }

    /// Whether an obstacle turns too far in the step under way for it to be solved.
    pub fn turns_too_far(&self, search: &BroadPhase) -> bool {
        search.part.as_ref().map_or(self.turns_too_far, |part| part.1)
    }

    /// Ends of a segment that touch obstacles for themselves: what stands for an end and does not move touches no obstacle.
    fn ends_at_obstacles(&self, shape: &Shape) -> [bool; 2] {
        [0, 1].map(|end| shape.ends[end] || self.is_joined_to_fixed(shape, end))
    }

    /// Whether an end is joined to a segment that is fixed.
    fn is_joined_to_fixed(&self, shape: &Shape, end: usize) -> bool {
        shape.joined[end].is_some_and(|other| !self.shapes[other as usize].free)
    }

    /// Whether a rigid joint to an anchor or to a fixed segment holds the place of a contact with an obstacle, so that no force moves it.
    pub fn is_held(&self, contact: &Contact) -> bool {
        let (segment, partner, feature) = contact.key;
        let shape = &self.shapes[segment as usize];
        let end = match feature {
            Feature::Own(end) => Some(end),
            _ => contact.ends[0],
        };
        let is_held = |end: u8| shape.anchored[usize::from(end)] || self.is_joined_to_fixed(shape, usize::from(end));
        partner.obstacle().is_some() && end.is_some_and(is_held)
    }

    /// Notes whether a segment moves freely from now on.
    pub fn set_free(&mut self, segment: usize, free: bool) {
        self.shapes[segment].free = free;
        self.filter.set_free(segment, free);
    }

    /// Notes whether a segment is in a store from now on, where it touches nothing.
    pub fn set_stored(&mut self, segment: usize, stored: bool) {
        self.filter.set_stored(segment, stored);
    }

    /// Whether every segment is still within the box of the last search.
    pub fn covers(&self, search: &BroadPhase, components: &impl Components) -> bool {
        let ends = |shape: &Shape| {
            let component = &components.component(shape.component);
            shape.place(&component.poses[shape.body as usize])
        };
        let slack = self.params.search_room;
        let own = || search.segments.iter().map(|&i| &self.shapes[i as usize]);
        let in_rooms = own().zip(&search.boxes).all(|(shape, room)| {
            !shape.free || ends(shape).iter().all(|&end| within(room, to_nalgebra(end), shape.radius))
        });
        let stays = |(shape, seen): (&Shape, &Option<[Vec3<f64>; 2]>)| {
            seen.as_ref().is_none_or(|seen| mesh_contacts::stay(ends(shape), seen, slack * shape.radius))
        };
        let with_solids = !(self.bounded.is_empty() && self.meshes.is_empty());
        let body_stays = |((index, _), seen): (&(u32, TriangleMesh), &Option<BodyPose<f64>>)| {
            let shape = &self.shapes[*index as usize];
            let Some(seen) = seen else { return true };
            search.segments.binary_search(index).is_err() || {
                let pose = components.component(shape.component).poses[shape.body as usize];
                let (moved, turned) = (pose.x - seen.x, pose.q.turn_since(seen.q));
                let [moved, turned] = [moved, turned].map(|v| v.norm_squared().sqrt());
                let of_solids = if with_solids { solid_contacts::ROOM * shape.radius } else { f64::INFINITY };
                moved + turned * shape.radius <= of_solids.min(slack * self.least_radius)
            }
        };
        let in_sight = |(shape, sight): (&Shape, &SweptBound)| {
            !shape.free || sight.holds(&components.component(shape.component).poses[shape.body as usize])
        };
        in_rooms
            && own().zip(&search.sights).all(in_sight)
            && own().zip(&search.seen).all(stays)
            && self.bodies.iter().zip(&search.seen_bodies).all(body_stays)
    }

    /// Replaces `out` by the possible contacts of a search's segments on their ways from their start over the prediction to where
    /// they are, in the order of their keys. Contacts with meshes stay while they press. `again`: whether it has searched in
    /// this step before.
    pub fn detect(&self, search: &mut BroadPhase, again: bool, components: &impl Components, out: &mut Vec<Contact>) {
        if again {
            search.grow();
        }
        let BroadPhase { segments, boxes, sights, .. } = search;
        boxes.clear();
        sights.clear();
        for &i in &*segments {
            let shape = &self.shapes[i as usize];
            let component = &components.component(shape.component);
            let body = shape.body as usize;
            sights.push(self.sight(shape, component));
            let ends = [
                shape.place(&component.start[body]),
                shape.place(&component.predicted[body]),
                shape.place(&component.poses[body]),
            ];
            boxes.push(around(ends.as_flattened(), shape.radius * (1.0 + self.params.search_room)));
        }
        out.retain(|contact| {
            let (a, partner, _) = contact.key;
            let may_touch = !self.filter.is_stored(a)
                && partner
                    .segment()
                    .map_or(self.shapes[a as usize].free, |b| self.filter.are_apart(a.min(b), a.max(b)));
            contact.impulse != Vec3::zero() && contact.is_of_mesh() && may_touch
        });
        out.iter_mut().for_each(|contact| *contact = Contact::new(contact.key, contact.friction, contact.radius));
        self.with_half_spaces(search, out);
        self.with_sheaths(search, out);
        if self.has_meshes() {
            self.with_meshes(search, components, out);
        }
        let obstacles = search.part.as_ref().map_or(&self.obstacles, |part| &part.0);
        let bounded = self.bounded.iter().filter_map(|&i| obstacles[i as usize].way());
        search.boxes.extend(bounded.map(|(ends, radius)| {
            let ends = ends.map(|axis| axis.map(|end| to_kernel(&end)));
            around(ends.as_flattened(), radius)
        }));
        if self.filter.has_pairs(self.bounded.len()) {
            let BroadPhase { segments, boxes, sights, hash, pairs, .. } = &mut *search;
            hash.rebuild(boxes);
            let mut found = std::mem::take(pairs);
            found.clear();
            let number = |k: u32| self.number(segments, k);
            let may_meet = |a: u32, b: u32| match (sights.get(a as usize), sights.get(b as usize)) {
                (Some(a), Some(b)) => !a.is_apart_from(b),
                _ => true,
            };
            hash.pairs(|a, b| self.filter.contains(number(a), number(b)) && may_meet(a, b), &mut found);
            for &pair in &found {
                self.add_pair(pair, search, components, out);
            }
            search.pairs = found;
        }
        out.sort_unstable_by_key(|contact| contact.key);
        if self.has_meshes() {
            out.dedup_by_key(|contact| contact.key);
        }
    }

    /// Pairs of segments whose boxes meet, one box a segment of the model: `out` gets those that can touch.
    pub fn meetings(&self, hash: &mut SpatialHash, boxes: &[Aabb], out: &mut Vec<[u32; 2]>) {
        out.clear();
        if self.between_segments.is_some() {
            hash.rebuild(boxes);
            hash.pairs(|a, b| self.filter.contains(a, b) || self.filter.meets_mesh(a, b), out);
        }
    }

    /// Whether two segments cannot have met on their ways from the start of the step to where they are now.
    pub fn are_apart<'a>(&self, pair: [u32; 2], component: impl Fn(u32) -> &'a Component<f64>) -> bool {
        let [a, b] = pair.map(|i| {
            let shape = &self.shapes[i as usize];
            self.sight(shape, component(shape.component))
        });
        a.nearest(&b) > 0.0
    }

    /// A segment as a search sees it now.
    fn sight(&self, shape: &Shape, component: &Component<f64>) -> SweptBound {
        let body = shape.body as usize;
        SweptBound::new(shape, &component.start[body], &component.poses[body], self.params.search_room)
    }

    /// Rigid bodies with meshes, and the segments that were near them in a search among all: pairs of segments.
    pub fn near_bodies(&self, search: &BroadPhase, mut pair: impl FnMut(u32, u32)) {
        for &(body, _) in &self.bodies {
            for a in (0..self.shapes.len() as u32).filter(|&a| self.filter.touches_mesh(a, body)) {
                if search.boxes[a as usize].overlaps(&search.boxes[body as usize]) {
                    pair(a, body);
                }
            }
        }
    }

    fn with_meshes(&self, search: &mut BroadPhase, components: &impl Components, out: &mut Vec<Contact>) {
        let BroadPhase { segments, boxes, seen, seen_bodies, part, .. } = search;
        let obstacles = part.as_ref().map_or(&self.obstacles, |part| &part.0);
        seen.clear();
        seen.resize(segments.len(), None);
        seen_bodies.clear();
        seen_bodies.resize(self.bodies.len(), None);
        let ways = |shape: &Shape| {
            let component = &components.component(shape.component);
            [&component.start, &component.poses].map(|poses| shape.place(&poses[shape.body as usize]))
        };
        for &which in &self.meshes {
            let obstacle = &obstacles[which as usize];
            let Some(carrier) = obstacle.carrier(Poses::Now) else { continue };
            for (k, (&a, room)) in segments.iter().zip(&*boxes).enumerate() {
                let shape = &self.shapes[a as usize];
                if !shape.free || !shape.touches() || mesh_contacts::is_out_of_reach(&carrier, room) {
                    continue;
                }
                let way = ways(shape);
                seen[k] = Some(way[1]);
                let contact = (obstacle.surface().friction, &self.params);
                let shape = Shape { ends: self.ends_at_obstacles(shape), ..*shape };
                mesh_contacts::detect((a, &shape), way, (Partner::Obstacle(which), &carrier), contact, out);
            }
        }
        let world = World { shapes: &self.shapes, obstacles, bodies: &self.bodies, tubes: &self.tubes };
        let friction = self.between_segments.unwrap_or_default().friction;
        for (&(index, _), seen_body) in self.bodies.iter().zip(&mut *seen_bodies) {
            if segments.binary_search(&index).is_err() {
                continue;
            }
            let Some(carrier) = world.body(index, components, Poses::Now) else { continue };
            for (k, (&a, room)) in segments.iter().zip(&*boxes).enumerate() {
                let shape = &self.shapes[a as usize];
                if !self.filter.touches_mesh(a, index) || mesh_contacts::is_out_of_reach(&carrier, room) {
                    continue;
                }
                let way = ways(shape);
                seen[k] = Some(way[1]);
                *seen_body = Some(carrier.frames[1]);
                let contact = (friction, &self.params);
                mesh_contacts::detect((a, shape), way, (Partner::Segment(index), &carrier), contact, out);
            }
            let shape = &self.shapes[index as usize];
            for (which, obstacle) in obstacles.iter().enumerate().filter(|_| shape.free) {
                let (body, other) = ((index, shape.radius, &carrier), (which as u32, obstacle));
                if solid_contacts::detect(body, other, obstacle.surface().friction, out) {
                    *seen_body = Some(carrier.frames[1]);
                }
            }
        }
    }

    /// On which part of its segment a contact with a mesh is: for [`mesh_contacts::let_wait`]. `None` of what waits for no other: all
    /// contacts without meshes, and those of a box or a cylinder with a plane.
    pub fn sector(&self, contact: &Contact, components: &impl Components) -> Option<u8> {
        let (index, partner, feature) = contact.key;
        let shape = &self.shapes[index as usize];
        let pose = || components.component(shape.component).poses[shape.body as usize];
        let is_of_own_mesh = match feature {
            Feature::Corner(_) if partner.whole() == partner => {
                let body = self.bodies.binary_search_by_key(&index, |body| body.0).ok()?;
                if self.bodies[body].1.corners().len() <= 2 * CYLINDER_SIDES {
                    return None;
                }
                true
            }
            Feature::Corner(_) | Feature::Face(_) | Feature::Edge(_) => true,
            Feature::Nearest | Feature::Own(_) | Feature::Partners(_) => false,
        };
        if is_of_own_mesh {
            let Vec3(arm) = pose().q.rotate_back(contact.arms[0]);
            return Some((0..3).filter(|&k| arm[k] > 0.0).map(|k| 1 << k).sum());
        }
        (partner.whole() != partner).then(|| u8::from(pose().q.axis().dot(contact.arms[0]) > 0.0))
    }

    /// The number of the k-th of these segments, then of bounded obstacles: those come after all segments.
    fn number(&self, segments: &[u32], k: u32) -> u32 {
        match segments.get(k as usize) {
            Some(&i) => i,
            None => (self.shapes.len() + k as usize - segments.len()) as u32,
        }
    }

    /// Adds the contacts of a pair, by places among the search's boxes.
    fn add_pair(&self, pair: [u32; 2], search: &BroadPhase, components: &impl Components, out: &mut Vec<Contact>) {
        let obstacles = self.obstacles(search);
        let gap_at_start = match pair.map(|k| search.sights.get(k as usize)) {
            [Some(a), Some(b)] => a.gap_at_start(b),
            _ => f64::NEG_INFINITY,
        };
        let [a, b] = pair.map(|k| self.number(&search.segments, k));
        let ends = |i: u32| {
            let shape = &self.shapes[i as usize];
            shape.place(&components.component(shape.component).start[shape.body as usize])
        };
        let own = &self.shapes[a as usize];
        let segments = self.shapes.len() as u32;
        let (partner, other, radius) = if b < segments {
            (Partner::Segment(b), ends(b), self.shapes[b as usize].radius.min(own.radius))
        } else {
            let index = self.bounded[(b - segments) as usize];
            let Some(([axis, _], _)) = obstacles[index as usize].way() else { return };
            (Partner::Obstacle(index), axis.map(|end| to_kernel(&end)), own.radius)
        };
        let friction = self.surface(partner).friction;
        let features: &[Feature] =
            if are_parallel(ends(a), other, self.params.parallel) { &Feature::PARALLEL } else { &[Feature::Nearest] };
        let stands = |feature: &&Feature| match **feature {
            Feature::Nearest | Feature::Corner(_) | Feature::Face(_) | Feature::Edge(_) => true,
            Feature::Own(end) => own.ends[end as usize],
            Feature::Partners(end) => match partner {
                Partner::Segment(b) => self.shapes[b as usize].ends[end as usize],
                _ => true,
            },
        };
        let contact = |&feature: &Feature| {
            let mut contact = Contact::new((a, partner, feature), friction, radius);
            contact.gap_at_start = gap_at_start;
            contact
        };
        out.extend(features.iter().filter(stands).map(contact));
    }

    /// Adds the contacts of segments in sheaths.
    fn with_sheaths(&self, search: &BroadPhase, out: &mut Vec<Contact>) {
        for (index, tube) in (0..).zip(&self.tubes) {
            let is_here = |i: u32| search.segments.binary_search(&i).is_ok() && !self.filter.is_stored(i);
            let free = |i: u32| self.shapes[i as usize].free;
            let has_free = tube.outer().any(free);
            for (i, place) in tube.inside().filter(|&(i, _)| is_here(i) && (has_free || free(i))) {
                let key = (i, Partner::Sheath(index), Feature::Nearest);
                let mut contact = Contact::new(key, tube.friction, self.shapes[i as usize].radius);
                contact.place = place;
                out.push(contact);
            }
        }
    }

    fn with_half_spaces(&self, search: &BroadPhase, out: &mut Vec<Contact>) {
        let BroadPhase { segments, boxes, .. } = search;
        let is_half_space = |obstacle: &Placed| !obstacle.is_bounded() && obstacle.mesh().is_none();
        let all = self.obstacles(search).iter().enumerate();
        for (i, obstacle) in all.filter(|(_, obstacle)| is_half_space(obstacle)) {
            for (&a, room) in segments.iter().zip(boxes) {
                let shape = &self.shapes[a as usize];
                if !shape.free || obstacle.is_out_of_reach(room) {
                    continue;
                }
                let (ends, friction) = (self.ends_at_obstacles(shape), obstacle.surface().friction);
                for end in [0, 1].into_iter().filter(|&end| ends[end as usize]) {
                    out.push(Contact::new((a, Partner::Obstacle(i as u32), Feature::Own(end)), friction, shape.radius));
                }
            }
            for (index, mesh) in &self.bodies {
                let shape = &self.shapes[*index as usize];
                let Ok(place) = segments.binary_search(index) else { continue };
                if shape.free && !obstacle.is_out_of_reach(&boxes[place]) {
                    let rims = mesh.round_side().map(|_| [0, 1].map(Carrier::rim)).into_iter().flatten();
                    for corner in (0..mesh.corners().len() as u32).chain(rims) {
                        let key = (*index, Partner::Obstacle(i as u32), Feature::Corner(corner));
                        out.push(Contact::new(key, obstacle.surface().friction, shape.radius));
                    }
                }
            }
        }
    }

    /// How a contact answers.
    pub fn surface(&self, partner: Partner) -> Surface {
        match partner.whole() {
            Partner::Obstacle(i) => self.obstacles[i as usize].surface(),
            Partner::Sheath(i) => Surface { friction: self.tubes[i as usize].friction, restitution: 0.0 },
            _ => self.between_segments.unwrap_or_default(),
        }
    }

    /// Whether bodies may overlap at the start.
    pub fn allows_overlap(&self) -> bool {
        self.allow_overlap
    }

    /// Whether any surface bounces.
    pub fn bounces(&self) -> bool {
        let all = self.obstacles.iter().map(Placed::surface);
        all.chain(self.between_segments).any(|surface| surface.restitution > 0.0)
    }
}

/// The box of balls of one radius.
fn around(centres: &[Vec3<f64>], radius: f64) -> Aabb {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for Vec3(centre) in centres {
        for k in 0..3 {
            (min[k], max[k]) = (min[k].min(centre[k]), max[k].max(centre[k]));
        }
    }
    let room = Vector3::repeat(radius);
    Aabb { min: Vector3::from(min) - room, max: Vector3::from(max) + room }
}

/// Whether a ball is inside of a box.
fn within(room: &Aabb, centre: Vector3<f64>, radius: f64) -> bool {
    (0..3).all(|k| room.min[k] <= centre[k] - radius && centre[k] + radius <= room.max[k])
}

#[cfg(test)]
mod tests;
