//! Splitting a model into its connected sets of segments.

use rod::{Body, Model};

use super::Members;
use crate::topology::Topology;

/// Splits a model into connected sets and gives each its connectivity.
pub fn split(model: &Model) -> Vec<(Members, Topology)> {
    let count = model.segments.len();
    let mut leader: Vec<usize> = (0..count).collect();
    fn find(leader: &mut [usize], mut i: usize) -> usize {
        while leader[i] != i {
            leader[i] = leader[leader[i]];
            i = leader[i];
        }
        i
    }
    for joint in &model.joints {
        if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b) {
            let (a, b) = (find(&mut leader, a), find(&mut leader, b));
            leader[a.max(b)] = a.min(b);
        }
    }
    let mut set_of = vec![usize::MAX; count];
    let mut local = vec![0_u32; count];
    let mut sets: Vec<Members> = Vec::new();
    for i in 0..count {
        let first = find(&mut leader, i);
        if first == i {
            set_of[i] = sets.len();
            sets.push(Members::default());
        }
        set_of[i] = set_of[first];
        local[i] = sets[set_of[i]].segments.len() as u32;
        sets[set_of[i]].segments.push(i);
    }
    for (k, joint) in model.joints.iter().enumerate() {
        let ((Body::Segment(segment), _) | (_, Body::Segment(segment))) = (joint.a, joint.b) else { continue };
        let set = &mut sets[set_of[segment]];
        set.joints.push(k);
        for body in [joint.a, joint.b] {
            if let Body::Anchor(anchor) = body {
                set.anchors.push(anchor);
            }
        }
    }
    sets.into_iter()
        .map(|mut set| {
            set.anchors.sort_unstable();
            set.anchors.dedup();
            let body = |body: Body| match body {
                Body::Segment(i) => local[i],
                Body::Anchor(i) => (set.segments.len() + set.anchors.partition_point(|&a| a < i)) as u32,
            };
            let ends = set.joints.iter().map(|&k| [body(model.joints[k].a), body(model.joints[k].b)]).collect();
            let fixed = set.segments.iter().map(|&i| model.segments[i].fixed);
            let fixed = fixed.chain(set.anchors.iter().map(|_| true)).collect();
            let topology = Topology::new(ends, fixed);
            (set, topology)
        })
        .collect()
}
