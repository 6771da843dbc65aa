//! Possible contacts that cannot touch yet, told from how far their segments have moved: they are not evaluated.
//!
//! A point of a segment's axis at s in [-h, h] moves by `dx + s da` (half length h, axis a), so that any two points of two segments
//! come nearer by no more than `m = |dx - dx'| + h |da| + h' |da'|`, and their gap, g at the start of the step, is at least `g - m`. Where
//! that is far from touching they have not passed through each other either, and nothing else needs to be known of them: however fast they
//! are, if they move alike.

use contact::geometry::Contact;
use contact::motion_bound::{MotionBound, MotionBounds, norm};
use contact::shape::Shape;
use kernels::Spatial;
use kernels::math::Vec3;

use super::sets::Sets;
use crate::connected_set::ConnectedSet;

/// Notes how far `segments` have moved since the start of the step.
pub(super) fn note_moves(segments: &[u32], shapes: &[Shape], components: &mut Sets<'_>) {
    for &i in segments {
        let Shape { component, body, half, .. } = shapes[i as usize];
        let ConnectedSet { component, touch, .. } = &mut components[component as usize];
        if let Some(touch) = touch {
            touch.ways.resize(component.poses.len(), MotionBounds::NONE);
            let [start, now] = [&component.start, &component.poses].map(|poses| &poses[body as usize]);
            touch.ways[body as usize].moved = MotionBound::between(start, now, half);
        }
    }
}

/// Notes how far the rods' own corrections move `segments`.
pub(super) fn note_corrections(segments: &[u32], shapes: &[Shape], components: &mut Sets<'_>) {
    for &i in segments {
        let Shape { component, body, half, .. } = shapes[i as usize];
        if let Some(touch) = &mut components[component as usize].touch {
            let Spatial { linear, angular } = touch.corrections[body as usize];
            touch.ways[body as usize].correction = MotionBound { linear, turned: half * norm(angular) };
        }
    }
}

/// Gap at the start of the step from which on a contact that does not press says nothing of others \[radii\].
const FAR: f64 = 2.0;

/// Segments whose contact need not be evaluated where they stay apart.
fn between_segments(contact: &Contact) -> Option<[u32; 2]> {
    let is_idle = contact.impulse == Vec3::zero() && contact.guess == [0.0; 3];
    let other = contact.key.1.segment().filter(|_| is_idle && !contact.is_of_mesh() && !contact.is_of_solid())?;
    Some([contact.key.0, other])
}

/// Whether it does not press, and was so far off at the start of the step that it says nothing of others.
pub(super) fn is_far_at_start(contact: &Contact) -> bool {
    between_segments(contact).is_some() && contact.gap_at_start - contact.target.max(0.0) > FAR * contact.radius
}

/// Whether it cannot touch where the axis of each segment moves so, with `room` to spare [m].
pub(super) fn is_out_of_reach(
    contact: &Contact,
    shapes: &[Shape],
    components: &Sets<'_>,
    way: impl Fn(&MotionBounds) -> MotionBound,
    room: f64,
) -> bool {
    let Some(segments) = between_segments(contact) else { return false };
    let [a, b] = segments.map(|i| &shapes[i as usize]);
    let of = |shape: &Shape| {
        let touch = components[shape.component as usize].touch.as_ref();
        touch.map(|touch| way(&touch.ways[shape.body as usize]))
    };
    let (Some(a), Some(b)) = (of(a), of(b)) else { return false };
    contact.gap_at_start - a.towards(b) - contact.target.max(0.0) > room
}
