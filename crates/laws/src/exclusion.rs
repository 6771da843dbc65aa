//! Pairs of segments that need not keep apart.

use std::collections::HashSet;
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;

use cosserat::state::{Body, Model};

/// Pairs of segments that never touch: joined ones, and neighbours along the rods nearer than half the circumference of
/// their section. Then pairs of rods that touch each other through sheaths alone.
pub(crate) struct Excluded(HashSet<(usize, usize)>, Vec<[Range<usize>; 2]>);

impl Excluded {
    pub(crate) fn new(model: &Model) -> Self {
        let count = model.segments.len();
        let mut neighbours = vec![Vec::new(); count];
        for joint in &model.joints {
            if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b) {
                neighbours[a].push((b, joint.offset_a, joint.offset_b));
                neighbours[b].push((a, joint.offset_b, joint.offset_a));
            }
        }
        let mut pairs = HashSet::new();
        for first in 0..count {
            // Places on segments, and how far they are along the rods from the first one's nearest end: the nearest place next.
            let mut open: Vec<(f64, usize, f64)> = Vec::new();
            let mut reached: HashSet<(usize, u64)> = HashSet::new();
            for &(other, _, there) in &neighbours[first] {
                pairs.insert((first.min(other), first.max(other)));
                open.push((0.0, other, there));
            }
            while let Some(next) = (0..open.len()).min_by(|&a, &b| open[a].0.total_cmp(&open[b].0)) {
                let (gone, segment, place) = open.swap_remove(next);
                if !reached.insert((segment, place.to_bits())) {
                    continue;
                }
                let [own, there] = [first, segment].map(|i| model.segments[i].radius);
                // At the limit itself rounding decides.
                if segment != first && gone < FRAC_PI_2 * (own + there) * (1.0 + 1e-6) {
                    pairs.insert((first.min(segment), first.max(segment)));
                }
                for &(other, here, there) in &neighbours[segment] {
                    let further = gone + (here - place).abs();
                    if other != first && further < PI * own.max(model.segments[other].radius) * (1.0 + 1e-6) {
                        open.push((further, other, there));
                    }
                }
            }
        }
        Self(pairs, model.contacts.sheathed())
    }

    /// Whether two segments never touch in this model, as it is now.
    pub(crate) fn contains(&self, model: &Model, i: usize, j: usize) -> bool {
        let (a, b) = (&model.segments[i], &model.segments[j]);
        let is_stored = |i: usize| {
            let mut joints = model.sliding_joints.iter();
            model.segments[i].fixed && joints.any(|joint| joint.has_store() && joint.segments.contains(&i))
        };
        a.fixed && b.fixed
            || is_stored(i)
            || is_stored(j)
            || a.body.is_some() && b.body.is_some()
            || self.1.iter().any(|[inner, outer]| {
                inner.contains(&i) && outer.contains(&j) || inner.contains(&j) && outer.contains(&i)
            })
            || self.0.contains(&(i.min(j), i.max(j)))
    }
}
