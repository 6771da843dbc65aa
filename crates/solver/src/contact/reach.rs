//! Possible contacts that cannot touch yet, told from how far their segments have moved: they are not evaluated.
//!
//! Points of a segment's axis move by no more than `m = |dx| + h |da|` (half length h, axis a), so that the gap of two, g at the start of
//! the step, is at least `g - m - m'` now. Where that is far from touching, and both have moved too little to have passed
//! through each other, nothing else needs to be known of them.

use super::geometry::{Contact, Shape};
use super::sets::Sets;
use crate::component::BodyPose;
use crate::connected_set::ConnectedSet;
use crate::kernel::Spatial;
use crate::kernel::math::Vec3;

/// Lengths by which the axis of a segment moves at most [m].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ways {
    /// Since the start of the step.
    pub(crate) moved: f64,
    /// With the rods' own correction.
    pub(crate) corrected: f64,
}

fn norm(v: Vec3<f64>) -> f64 {
    v.norm_squared().sqrt()
}

/// By how much points of an axis of half length `half` [m] move at most from one pose to another [m].
pub(super) fn way(from: &BodyPose<f64>, to: &BodyPose<f64>, half: f64) -> f64 {
    norm(to.x - from.x) + half * norm(to.q.axis() - from.q.axis())
}

/// Notes how far `segments` have moved since the start of the step.
pub(super) fn note_moves(segments: &[u32], shapes: &[Shape], components: &mut Sets<'_>) {
    for &i in segments {
        let Shape { component, body, half, .. } = shapes[i as usize];
        let ConnectedSet { component, touch, .. } = &mut components[component as usize];
        if let Some(touch) = touch {
            touch.ways.resize(component.poses.len(), Ways::default());
            let [start, now] = [&component.start, &component.poses].map(|poses| &poses[body as usize]);
            touch.ways[body as usize].moved = way(start, now, half);
        }
    }
}

/// Notes how far the rods' own corrections move `segments`.
pub(super) fn note_corrections(segments: &[u32], shapes: &[Shape], components: &mut Sets<'_>) {
    for &i in segments {
        let Shape { component, body, half, .. } = shapes[i as usize];
        if let Some(touch) = &mut components[component as usize].touch {
            let Spatial { linear, angular } = touch.corrections[body as usize];
            touch.ways[body as usize].corrected = norm(linear) + half * norm(angular);
        }
    }
}

impl Contact {
    /// Segments whose contact need not be evaluated where they stay apart.
    fn between_segments(&self) -> Option<[u32; 2]> {
        let is_idle = self.impulse == Vec3::zero() && self.guess == [0.0; 3];
        let other = self.key.1.segment().filter(|_| is_idle && !self.is_of_mesh() && !self.is_of_solid())?;
        Some([self.key.0, other])
    }

    /// Whether it cannot touch where the axis of each segment goes no further than `way`, with `room` to spare [m].
    pub(super) fn is_out_of_reach(
        &self,
        shapes: &[Shape],
        components: &Sets<'_>,
        way: impl Fn(&Ways) -> f64,
        room: f64,
    ) -> bool {
        let Some(segments) = self.between_segments() else { return false };
        let [a, b] = segments.map(|i| &shapes[i as usize]);
        let of = |shape: &Shape| {
            let touch = components[shape.component as usize].touch.as_ref();
            touch.map_or(f64::INFINITY, |touch| way(&touch.ways[shape.body as usize]))
        };
        let way = of(a) + of(b);
        // Any further, and they may have passed through each other.
        way <= 0.5 * (a.radius + b.radius) && self.gap_at_start - way - self.target.max(0.0) > room
    }
}
