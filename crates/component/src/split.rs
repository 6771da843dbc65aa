//! Splitting a model into its connected sets of segments.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

use jointed::topology::Topology;
use kernels::dispatch::has_lanes;
use rod::{Body, Driven, Freedom, Model};

use super::Members;
use crate::GROUP;

/// Fewer sets than this do not fill a register's lanes well enough.
const FEWEST_IN_LANES: usize = 3;

/// Connected sets with the same connectivity, at most [`GROUP`] of them.
pub struct Alike {
    /// Who is joined to whom, in each of them.
    pub topology: Arc<Topology>,
    /// Their parts of the model.
    pub sets: Vec<Members>,
    /// Whether a rod of them runs through an eyelet or over a pulley.
    pub slides: bool,
    /// Whether a joint of them is not elastic, or can break.
    pub is_inelastic: bool,
}

impl Alike {
    /// Whether they can be solved side by side, one a lane: enough of them, elastic, and none with a loop.
    pub fn fill_lanes(&self) -> bool {
        !self.slides && !self.is_inelastic && Self::fills_lanes(self.sets.len(), &self.topology)
    }

    /// The same of so many sets.
    pub fn fills_lanes(sets: usize, topology: &Topology) -> bool {
        has_lanes() && sets >= FEWEST_IN_LANES && topology.elimination.is_some()
    }
}

/// Rods that run through eyelets and over pulleys, with what these are part of.
fn threaded(model: &Model) -> impl Iterator<Item = (&Range<usize>, Body)> {
    let eyelets = model.sliding_joints.iter().map(|joint| (&joint.segments, joint.holder));
    eyelets.chain(model.pulleys.iter().map(|pulley| (&pulley.segments, pulley.holder)))
}

/// Splits a model into its connected sets, alike ones together, in the order in which the first of each kind comes.
pub fn split_alike(model: &Model) -> Vec<Alike> {
    let mut kinds: HashMap<(Vec<[u32; 2]>, Vec<bool>), usize> = HashMap::new();
    let mut by_kind: Vec<(Arc<Topology>, Vec<Members>, [bool; 2])> = Vec::new();
    for (members, topology) in split(model) {
        let has = |segment: usize| members.segments.binary_search(&segment).is_ok();
        let slides = threaded(model).any(|(rod, _)| has(rod.start));
        let has_joint = |joint: usize| members.joints.binary_search(&joint).is_ok();
        let is_inelastic = model.laws.iter().any(|own| has_joint(own.joint))
            || model.breakable.iter().any(|own| has_joint(own.joint))
            || members.joints.iter().any(|&joint| model.joints[joint].freedom == Freedom::Broken);
        if slides || is_inelastic {
            by_kind.push((Arc::new(topology), vec![members], [slides, is_inelastic]));
            continue;
        }
        let key = (topology.joints.clone(), topology.fixed.clone());
        let index = *kinds.entry(key).or_insert_with(|| {
            by_kind.push((Arc::new(topology), Vec::new(), [false; 2]));
            by_kind.len() - 1
        });
        by_kind[index].1.push(members);
    }
    let chunks = by_kind.into_iter().flat_map(|(topology, sets, [slides, is_inelastic])| {
        let alike = |sets: &[Members]| Alike { topology: topology.clone(), sets: sets.to_vec(), slides, is_inelastic };
        sets.chunks(GROUP).map(alike).collect::<Vec<Alike>>()
    });
    chunks.collect()
}

/// All segments of a model as one set, in the model's order, whether they are connected or not.
pub fn whole(model: &Model) -> (Members, Topology) {
    let holds = |body: &Body| if let Body::Anchor(anchor) = body { Some(*anchor) } else { None };
    let of_segments = |k: &usize| [model.joints[*k].a, model.joints[*k].b].iter().any(|body| holds(body).is_none());
    let joints: Vec<usize> = (0..model.joints.len()).filter(of_segments).collect();
    let ends = joints.iter().map(|&k| [model.joints[k].a, model.joints[k].b]);
    let mut anchors: Vec<usize> = ends.clone().flatten().filter_map(|body| holds(&body)).collect();
    anchors.sort_unstable();
    anchors.dedup();
    let set = Members { segments: (0..model.segments.len()).collect(), joints: joints.clone(), anchors };
    let body = |body: Body| set.body(body).unwrap_or_default() as u32;
    let ends = ends.map(|pair| pair.map(body)).collect();
    let fixed = model.segments.iter().map(|segment| segment.fixed).chain(set.anchors.iter().map(|_| true)).collect();
    let topology = Topology::new(ends, fixed);
    (set, topology)
}

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
    for (rod, holder) in threaded(model) {
        let holder = if let Body::Segment(holder) = holder { Some(holder) } else { None };
        for b in rod.clone().chain(holder) {
            let (a, b) = (find(&mut leader, rod.start), find(&mut leader, b));
            leader[a.max(b)] = a.min(b);
        }
    }
    // What is let go on the way is no fixed body of the topology, which stays as it is then.
    let lets_go = |driven: &&Driven| driven.until < f64::INFINITY;
    let let_go: HashSet<Body> = model.motions.iter().filter(lets_go).map(|driven| driven.body).collect();
    let is_fixed = |i: usize| model.segments[i].fixed && !let_go.contains(&Body::Segment(i));
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
    for (rod, holder) in threaded(model) {
        if let Body::Anchor(anchor) = holder {
            sets[set_of[rod.start]].anchors.push(anchor);
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
            let fixed = set.segments.iter().map(|&i| is_fixed(i));
            let fixed = fixed.chain(set.anchors.iter().map(|_| true)).collect();
            let topology = Topology::new(ends, fixed);
            (set, topology)
        })
        .collect()
}
