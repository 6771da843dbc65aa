//! Which segments of a rod go on in which, and where their joints are.

use std::ops::Range;

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

impl Model {
    /// Indices into [`Model::joints`] of the joints of one rod, in order along it. `segments` is what
    /// [`crate::Assembly::rod`] returned, or a `RodInfo::segments` of a scene. A clamp of the rod's start face comes first,
    /// one of its end face last; joints to other rods and springs along the rod are left out. An open rod of N segments, not clamped at its faces,
    /// has N - 1 joints: joint k of them is between its segments k and k + 1.
    pub fn joints_of(&self, segments: &Range<usize>) -> Vec<usize> {
        let is_own = |body| match body {
            Body::Segment(i) => segments.contains(&i),
            Body::Anchor(_) => true,
        };
        let place = |joint: &Joint| match (joint.a, joint.b) {
            _ if !is_own(joint.a) || !is_own(joint.b) || joint.is_foundation() => None,
            (Body::Segment(i), _) => Some((i, joint.offset_a)),
            (_, Body::Segment(i)) => Some((i, joint.offset_b)),
            _ => None,
        };
        let own = self.joints.iter().enumerate();
        let mut own: Vec<_> = own.filter_map(|(index, joint)| Some((place(joint)?, index))).collect();
        own.sort_by(|((i, x), _), ((j, y), _)| i.cmp(j).then(x.total_cmp(y)));
        own.into_iter().map(|(_, index)| index).collect()
    }
}

/// The segment of `body` and which of its ends, 0 the start or 1 the end, is `offset` [m] from its centre. A rigid body has
/// no ends.
pub fn end_of(model: &Model, body: Body, offset: f64) -> Option<(usize, usize)> {
    let Body::Segment(segment) = body else { return None };
    if model.segments[segment].body.is_some() {
        return None;
    }
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

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::{Assembly, Body, Material, RodSpec, shape};

    #[test]
    fn a_rods_joints_come_in_order_along_it_without_those_of_others() {
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let straight = |y: f64| shape::straight(Vector3::y() * y, Vector3::x(), 1.0, 4);
        let mut assembly = Assembly::new(Vector3::zeros());
        let first = assembly.rod(&RodSpec::new(straight(0.0), 0.01, material));
        let second = assembly.rod(&RodSpec::new(straight(1.0), 0.01, material));
        let ring = RodSpec { closed: true, ..RodSpec::new(shape::ring(Vector3::zeros(), 1.0, 5), 0.01, material) };
        let ring = assembly.rod(&ring);
        assembly.join(first.start, 0.5, second.start, 0.5).clamp_end(&second).clamp_start(&second);
        let (model, _) = assembly.finish();
        assert_eq!(model.joints_of(&first), [0, 1, 2]);
        // Joint 11 joins the two rods, 12 clamps the end face, 13 the start face.
        assert_eq!(model.joints_of(&second), [13, 3, 4, 5, 12]);
        assert_eq!(model.joints[13].a, Body::Anchor(1));
        assert_eq!(model.joints_of(&ring), [6, 7, 8, 9, 10]);
    }
}
