//! Which pairs of bodies can touch at all: segments that belong together never do.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap, HashSet};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use rod::{Body, Model, Segment};

/// Which pairs of a model's bodies can touch: its segments in order, then its obstacles that have an end.
#[derive(Debug)]
pub struct PairFilter {
    /// Whether each segment moves freely.
    free: Vec<bool>,
    /// Segments in stores, which touch nothing.
    stored: HashSet<u32>,
    /// Pairs of rods that touch each other through sheaths alone.
    sheathed: Vec<[Range<usize>; 2]>,
    /// Pairs of segments that never touch; `None` where no segments touch each other.
    excluded: Option<Exclusion>,
    /// Of each segment that is a rigid body, whether it touches rods and obstacles; empty where there is none.
    bodies: Vec<Option<bool>>,
}

impl PairFilter {
    /// The pairs of a model.
    pub fn new(model: &Model) -> Self {
        let free = model.segments.iter().map(|segment| !segment.fixed).collect();
        let body = |segment: &Segment| segment.body.as_ref().map(|_| segment.capsule().is_some());
        let bodies = if model.segments.iter().any(|segment| segment.body.is_some()) {
            model.segments.iter().map(body).collect()
        } else {
            Vec::new()
        };
        let excluded = model.contacts.between_segments.map(|_| Exclusion::new(model));
        Self { free, stored: HashSet::new(), sheathed: model.contacts.sheathed(), excluded, bodies }
    }

    /// Whether two that are rigid bodies, or one of them, can touch: bodies do not touch each other, and some touch nothing.
    fn bodies_touch(&self, a: u32, b: u32) -> bool {
        let body = |i: u32| self.bodies.get(i as usize).copied().flatten();
        match (body(a), body(b)) {
            (Some(_), Some(_)) => false,
            (one, other) => one.or(other).unwrap_or(true),
        }
    }

    /// Notes whether a segment moves freely from now on.
    pub(crate) fn set_free(&mut self, segment: usize, free: bool) {
        self.free[segment] = free;
    }

    /// Notes whether a segment is in a store from now on.
    pub fn set_stored(&mut self, segment: usize, stored: bool) {
        match stored {
            true => self.stored.insert(segment as u32),
            false => self.stored.remove(&(segment as u32)),
        };
    }

    /// Whether a segment is in a store.
    pub(crate) fn is_stored(&self, segment: u32) -> bool {
        self.stored.contains(&segment)
    }

    /// Whether bodies `a` < `b` can touch.
    pub(crate) fn contains(&self, a: u32, b: u32) -> bool {
        (self.bodies.is_empty() || self.bodies_touch(a, b)) && self.are_apart(a, b)
    }

    /// Whether a segment can touch rigid body `body`, which has a mesh: pieces of rods can.
    pub(crate) fn touches_mesh(&self, segment: u32, body: u32) -> bool {
        let is_rod = self.bodies.get(segment as usize).is_some_and(Option::is_none);
        is_rod && self.are_apart(segment.min(body), segment.max(body))
    }

    /// Whether one of two segments is a rigid body with a mesh that the other can touch.
    pub(crate) fn meets_mesh(&self, a: u32, b: u32) -> bool {
        self.touches_mesh(a, b) || self.touches_mesh(b, a)
    }

    /// Whether nothing but what they are keeps bodies `a` < `b` from touching.
    pub(crate) fn are_apart(&self, a: u32, b: u32) -> bool {
        if !self.stored.is_empty() && (self.stored.contains(&a) || self.stored.contains(&b)) {
            return false;
        }
        let is_in = |rods: &[Range<usize>; 2], [i, j]: [u32; 2]| {
            rods[0].contains(&(i as usize)) && rods[1].contains(&(j as usize))
        };
        if self.sheathed.iter().any(|rods| is_in(rods, [a, b]) || is_in(rods, [b, a])) {
            return false;
        }
        let is_free = |i: u32| self.free.get(i as usize).copied();
        match (is_free(a), is_free(b)) {
            (Some(first), None) => first,
            (Some(first), Some(second)) => {
                (first || second) && self.excluded.as_ref().is_some_and(|excluded| !excluded.contains(a, b))
            }
            (None, _) => false,
        }
    }

    /// Whether any pair of bodies with ends can touch, with so many obstacles among them.
    pub(crate) fn has_pairs(&self, obstacles: usize) -> bool {
        self.excluded.is_some() || obstacles > 0
    }
}

/// Pairs of segments that are joined, or nearer along the rods than half the circumference of their mean section: a rod
/// cannot bend back onto itself within that length, and where a branch leaves its parent the two always overlap.
#[derive(Debug)]
struct Exclusion {
    /// Where each segment's partners begin, and the end.
    start: Vec<usize>,
    /// Partners with a higher index, ascending.
    partners: Vec<u32>,
}

impl Exclusion {
    /// All such pairs of a model.
    fn new(model: &Model) -> Self {
        let count = model.segments.len();
        let mut neighbours: Vec<Vec<(usize, [f64; 2])>> = vec![Vec::new(); count];
        for joint in &model.joints {
            if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b) {
                neighbours[a].push((b, [joint.offset_a, joint.offset_b]));
                neighbours[b].push((a, [joint.offset_b, joint.offset_a]));
            }
        }
        let mut partners: Vec<Vec<u32>> = vec![Vec::new(); count];
        let mut reached: HashMap<(usize, u64), f64> = HashMap::new();
        let mut queue = BinaryHeap::new();
        for first in 0..count {
            let reach = FRAC_PI_2 * 2.0 * model.segments[first].radius;
            reached.clear();
            let mut add = |other: usize| {
                if other != first {
                    partners[first.min(other)].push(first.max(other) as u32);
                }
            };
            // States are joints' places on segments; distances from the nearest place of the first segment.
            for &(other, [_, place]) in &neighbours[first] {
                add(other);
                queue.push(Reverse((Ordered(0.0), other, place.to_bits())));
            }
            while let Some(Reverse((Ordered(distance), segment, place))) = queue.pop() {
                if reached.get(&(segment, place)).is_some_and(|&known| known <= distance) {
                    continue;
                }
                reached.insert((segment, place), distance);
                let limit = FRAC_PI_2 * (model.segments[first].radius + model.segments[segment].radius);
                if distance < limit {
                    add(segment);
                }
                for &(other, [here, there]) in &neighbours[segment] {
                    let distance = distance + (here - f64::from_bits(place)).abs();
                    if distance < reach && other != first {
                        queue.push(Reverse((Ordered(distance), other, there.to_bits())));
                    }
                }
            }
        }
        let mut flat = Self { start: vec![0], partners: Vec::new() };
        for mut own in partners {
            own.sort_unstable();
            own.dedup();
            flat.partners.extend(own);
            flat.start.push(flat.partners.len());
        }
        flat
    }

    /// Whether segments `a` < `b` never touch.
    fn contains(&self, a: u32, b: u32) -> bool {
        self.partners[self.start[a as usize]..self.start[a as usize + 1]].binary_search(&b).is_ok()
    }
}

/// A distance that can be sorted.
#[derive(PartialEq)]
struct Ordered(f64);

impl Eq for Ordered {}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

#[cfg(test)]
mod tests;
