//! Where contacts have been looked for in a step: boxes about the ways of segments, what they held before, and where the segments were.

use collision::{Aabb, SpatialHash, closest};
use component::BodyPose;
use kernels::math::Vec3;

use super::convert::to_nalgebra;
use super::motion_bound::MotionBound;
use super::obstacles::Placed;
use super::shape::Shape;

/// Ways from which on a segment is fast \[radii\].
const FAST: f64 = 4.0;
/// How far from where it was a segment that is fast may be before it is looked for again, as a share of its way; a slow one may be anywhere
/// on its way.
const DRIFT: f64 = 0.1;

/// A search for the possible contacts of some segments, and where it has looked.
#[derive(Default)]
pub struct BroadPhase {
    /// The segments, ascending.
    pub segments: Vec<u32>,
    /// Boxes of their ways with room, then of all bounded obstacles.
    pub(super) boxes: Vec<Aabb>,
    /// What holds the boxes that their ways had in parts of the step that were accepted; empty where there were none.
    reach: Vec<Aabb>,
    /// The same of the attempt under way, before these boxes.
    tried: Vec<Aabb>,
    /// How far from the ways that were expected its segments were at the ends of parts of the step [m]; empty where there were none.
    strays: Vec<f64>,
    /// Whether the boxes are those of an attempt that was taken back.
    is_taken_back: bool,
    /// Whether they have been searched again in the step.
    has_grown: bool,
    /// Where the segments were.
    pub sights: Vec<SweptBound>,
    pub(super) hash: SpatialHash,
    pub(super) pairs: Vec<[u32; 2]>,
    /// Where rigid bodies with meshes were at the last search, if anything was near.
    pub(super) seen_bodies: Vec<Option<BodyPose<f64>>>,
    /// Where the ends of segments near a mesh were at the last search; empty without meshes.
    pub(super) seen: Vec<Option<[Vec3<f64>; 2]>>,
    /// Obstacles over a part of the step, and whether one turns too far in it.
    pub(super) part: Option<(Vec<Placed>, bool)>,
}

/// Where a segment was when it was looked for, and how far it may be from there. The boxes of ways hold many that move alike and never
/// meet, and many that lie beside thin ones at an angle to the axes.
#[derive(Clone, Copy)]
pub struct SweptBound {
    /// The ends of its axis at the start of the step [m].
    ends: [Vec3<f64>; 2],
    /// Its way from there.
    way: MotionBound,
    /// Where it was.
    pose: BodyPose<f64>,
    half: f64,
    radius: f64,
    /// How far points of its axis may be from where they were [m].
    room: f64,
}

impl SweptBound {
    /// A segment of this shape on its way from `start` to `now`.
    pub(super) fn new(shape: &Shape, start: &BodyPose<f64>, now: &BodyPose<f64>, room: f64) -> Self {
        let Shape { half, radius, .. } = *shape;
        let way = MotionBound::between(start, now, half);
        let length = way.length();
        let share = if length > FAST * radius { DRIFT } else { 1.0 };
        Self { ends: shape.place(start), way, pose: *now, half, radius, room: room * radius + share * length }
    }

    /// How far from its way, after such a share of the step, the ends of its axis are [m].
    pub fn stray(&self, now: &BodyPose<f64>, share: f64) -> f64 {
        let arms = [&self.pose, now].map(|pose| pose.q.axis() * self.half);
        let off = |k: usize, side: f64| {
            let [then, now] = [self.pose.x + arms[0] * side, now.x + arms[1] * side];
            (now - self.ends[k] - (then - self.ends[k]) * share).norm_squared()
        };
        off(0, -1.0).max(off(1, 1.0)).sqrt()
    }

    /// Whether it need not be looked for again.
    pub(super) fn holds(&self, now: &BodyPose<f64>) -> bool {
        MotionBound::between(&self.pose, now, self.half).length() <= self.room
    }

    /// Whether two segments cannot touch where they are, nor anywhere in their rooms.
    pub(super) fn is_apart_from(&self, other: &Self) -> bool {
        self.nearest(other) > self.room + other.room
    }

    /// The least gap that their ways may leave between two segments where they are [m]: that at the start, less what they may have come nearer.
    pub(super) fn nearest(&self, other: &Self) -> f64 {
        self.gap_at_start(other) - self.way.towards(other.way)
    }

    /// The gap between two segments at the start of the step [m].
    pub(super) fn gap_at_start(&self, other: &Self) -> f64 {
        let distance = closest::segments(&self.ends.map(to_nalgebra), &other.ends.map(to_nalgebra)).distance;
        distance - self.radius - other.radius
    }
}

impl BroadPhase {
    /// A search for contacts of these segments.
    pub fn of(&mut self, segments: impl Iterator<Item = u32>) {
        self.segments.clear();
        self.segments.extend(segments);
        self.segments.sort_unstable();
        self.boxes.clear();
        self.sights.clear();
        self.reach.clear();
        self.tried.clear();
        self.strays.clear();
        self.has_grown = false;
        self.is_taken_back = false;
        self.part = None;
    }

    /// Takes over from a search among more segments, all of the model's, where these have been looked for.
    pub fn take_from(&mut self, all: &BroadPhase) {
        let Self { segments, boxes, sights, seen, seen_bodies, .. } = self;
        boxes.clear();
        boxes.extend(segments.iter().map(|&i| all.boxes[i as usize]));
        sights.clear();
        sights.extend(segments.iter().map(|&i| all.sights[i as usize]));
        seen.clear();
        if !all.seen.is_empty() {
            seen.extend(segments.iter().map(|&i| all.seen[i as usize]));
        }
        seen_bodies.clone_from(&all.seen_bodies);
    }

    /// Whether its segments have been searched again in the step.
    pub fn has_grown(&self) -> bool {
        self.has_grown
    }

    /// Writes where its segments may have been in the step to `all`, one box a segment of the model.
    pub fn show_reach(&self, all: &mut [Aabb]) {
        for (k, (&i, own)) in self.segments.iter().zip(&self.boxes).enumerate() {
            let before = [&self.reach, &self.tried].into_iter().filter_map(|boxes| boxes.get(k));
            all[i as usize] = before.fold(*own, |all, other| all.union(other));
        }
    }

    /// Notes where its segments are `now`, at the end of a part of the step, after such a share of it. `all`: the search among all segments
    /// at its start.
    pub fn note_strays(&mut self, all: &BroadPhase, share: f64, now: impl Fn(u32) -> BodyPose<f64>) {
        self.strays.resize(self.segments.len(), 0.0);
        for (&i, stray) in self.segments.iter().zip(&mut self.strays) {
            *stray = stray.max(all.sights[i as usize].stray(&now(i), share));
        }
    }

    /// How far from its way a segment has been in the parts of the step [m].
    pub fn stray(&self, segment: u32) -> f64 {
        let place = self.segments.binary_search(&segment).ok();
        place.and_then(|place| self.strays.get(place)).copied().unwrap_or(f64::INFINITY)
    }

    /// Whether two segments cannot have met in the step, each no further than its stray from the way it was expected to take. This is the search
    /// among all segments at its start.
    pub fn are_apart(&self, pair: [u32; 2], strays: [f64; 2]) -> bool {
        let [a, b] = pair.map(|i| &self.sights[i as usize]);
        a.nearest(b) > strays[0] + strays[1]
    }

    /// Notes where the boxes have been before they are made anew; what was taken back does not count.
    pub(super) fn grow(&mut self) {
        self.has_grown = true;
        if !std::mem::take(&mut self.is_taken_back) {
            unite(&mut self.tried, self.boxes.iter().take(self.segments.len()));
        }
    }

    /// Takes what was tried since the last part of the step back.
    pub fn take_back(&mut self) {
        self.tried.clear();
        self.is_taken_back = true;
    }

    /// Keeps where its segments may have been in a part of the step.
    pub fn keep(&mut self) {
        if self.has_grown {
            unite(&mut self.reach, self.tried.iter());
            unite(&mut self.reach, self.boxes.iter().take(self.segments.len()));
            self.tried.clear();
        }
    }
}

/// Makes boxes around those that are there, if any, and others.
fn unite<'a>(boxes: &mut Vec<Aabb>, others: impl Iterator<Item = &'a Aabb>) {
    if boxes.is_empty() {
        boxes.extend(others);
    } else {
        boxes.iter_mut().zip(others).for_each(|(own, other)| *own = own.union(other));
    }
}

#[cfg(test)]
mod tests;
