//! Where contacts have been looked for in a step: boxes about the ways of segments, and what they held before.

use collision::{Aabb, SpatialHash};

use super::obstacles::Placed;
use crate::component::BodyPose;
use crate::kernel::math::Vec3;

/// A search for the possible contacts of some segments, and where it has looked.
#[derive(Default)]
pub(crate) struct Search {
    /// The segments, ascending.
    pub(super) segments: Vec<u32>,
    /// Boxes of their ways with room, then of all bounded obstacles.
    pub(super) boxes: Vec<Aabb>,
    /// What holds the boxes that their ways had in parts of the step that were accepted; empty where there were none.
    reach: Vec<Aabb>,
    /// The same of the attempt under way, before these boxes.
    tried: Vec<Aabb>,
    /// Whether the boxes are those of an attempt that was taken back.
    is_taken_back: bool,
    /// Whether they have been searched again in the step.
    has_grown: bool,
    pub(super) hash: SpatialHash,
    pub(super) pairs: Vec<[u32; 2]>,
    /// Where rigid bodies with meshes were at the last search, if anything was near.
    pub(super) seen_bodies: Vec<Option<BodyPose<f64>>>,
    /// Where the ends of segments near a mesh were at the last search; empty without meshes.
    pub(super) seen: Vec<Option<[Vec3<f64>; 2]>>,
    /// Obstacles over a part of the step, and whether one turns too far in it.
    pub(super) part: Option<(Vec<Placed>, bool)>,
}

impl Search {
    /// A search for contacts of these segments.
    pub(crate) fn of(&mut self, segments: impl Iterator<Item = u32>) {
        self.segments.clear();
        self.segments.extend(segments);
        self.segments.sort_unstable();
        self.boxes.clear();
        self.reach.clear();
        self.tried.clear();
        self.has_grown = false;
        self.is_taken_back = false;
        self.part = None;
    }

    /// Takes over from a search among more segments, all of the model's, where these have been looked for.
    pub(crate) fn take_from(&mut self, all: &Search) {
        let Self { segments, boxes, seen, seen_bodies, .. } = self;
        boxes.clear();
        boxes.extend(segments.iter().map(|&i| all.boxes[i as usize]));
        seen.clear();
        if !all.seen.is_empty() {
            seen.extend(segments.iter().map(|&i| all.seen[i as usize]));
        }
        seen_bodies.clone_from(&all.seen_bodies);
    }

    /// Whether its segments have been searched again in the step.
    pub(crate) fn has_grown(&self) -> bool {
        self.has_grown
    }

    /// Writes where its segments may have been in the step to `all`, one box a segment of the model.
    pub(crate) fn show_reach(&self, all: &mut [Aabb]) {
        for (k, (&i, own)) in self.segments.iter().zip(&self.boxes).enumerate() {
            let before = [&self.reach, &self.tried].into_iter().filter_map(|boxes| boxes.get(k));
            all[i as usize] = before.fold(*own, |all, other| all.union(other));
        }
    }

    /// Notes where the boxes have been before they are made anew; what was taken back does not count.
    pub(super) fn grow(&mut self) {
        self.has_grown = true;
        if !std::mem::take(&mut self.is_taken_back) {
            unite(&mut self.tried, self.boxes.iter().take(self.segments.len()));
        }
    }

    /// Takes what was tried since the last part of the step back.
    pub(crate) fn take_back(&mut self) {
        self.tried.clear();
        self.is_taken_back = true;
    }

    /// Keeps where its segments may have been in a part of the step.
    pub(crate) fn keep(&mut self) {
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
