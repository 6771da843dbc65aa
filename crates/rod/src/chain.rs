//! Which segments of a rod go on in which, and where their joints are.

use crate::{Body, Joint, Model};

/// Part of a segment's length that a connector may be off its end.
const TOLERANCE: f64 = 1e-6;

/// The segment that goes on where another one of its rod ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Successor {
    /// Index of the segment that starts there.
    pub segment: usize,
    /// Index of the joint between the two.
    pub joint: usize,
}

/// Of each segment, the one of the same rod whose start is joined to its end, `[segments]`. No segment follows two others;
/// where joints compete, the first one counts.
pub fn successors(model: &Model) -> Vec<Option<Successor>> {
    let mut successors = vec![None; model.segments.len()];
    let mut follows = vec![false; model.segments.len()];
    for (index, joint) in model.joints.iter().enumerate() {
        let Some((from, to)) = link(model, joint) else { continue };
        if successors[from].is_none() && !follows[to] {
            successors[from] = Some(Successor { segment: to, joint: index });
            follows[to] = true;
        }
    }
    successors
}

/// The segment of `body` and which of its ends, 0 the start or 1 the end, is `offset` [m] from its centre.
pub fn end_of(model: &Model, body: Body, offset: f64) -> Option<(usize, usize)> {
    let Body::Segment(segment) = body else { return None };
    let length = model.segments[segment].length;
    let is_at = |side: f64| (offset - side * length).abs() <= TOLERANCE * length;
    [-0.5, 0.5].into_iter().position(is_at).map(|end| (segment, end))
}

/// The segments of a joint from the end of one to the start of the next in the same rod.
fn link(model: &Model, joint: &Joint) -> Option<(usize, usize)> {
    let [(a, end_a), (b, end_b)] = [end_of(model, joint.a, joint.offset_a)?, end_of(model, joint.b, joint.offset_b)?];
    if model.segments[a].rod != model.segments[b].rod {
        return None;
    }
    match (end_a, end_b) {
        (1, 0) => Some((a, b)),
        (0, 1) => Some((b, a)),
        _ => None,
    }
}
