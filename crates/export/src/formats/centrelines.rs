//! The centrelines of a model's rods as nodes, which other programs draw lines and tubes through.

use std::ops::Range;

use nalgebra::Vector3;
use rod::{Model, State, Successor, end_of, successors};

/// An end of a centreline, or the place between two segments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Node {
    /// The segment that ends here.
    pub(super) before: Option<usize>,
    /// The segment that starts here.
    pub(super) after: Option<usize>,
    /// The joint here.
    pub(super) joint: Option<usize>,
}

/// Segments of one rod, each joined to the next.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chain {
    /// Index of the rod.
    pub(super) rod: usize,
    /// Its nodes in [`Centrelines::nodes`], in order.
    pub(super) nodes: Range<usize>,
    /// Whether the last segment ends at the first node.
    pub(super) closed: bool,
}

/// All nodes of a model.
///
/// A joint stands at the node between its two segments if it joins the end of one to the start of the other in the same
/// rod. Any other joint, to another rod or an anchor, stands at an end of its body b (a branch's first node), or else at
/// an end of its body a, if it holds one of them at its end, and if no joint stands there yet.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Centrelines {
    /// Nodes, chain after chain.
    pub(super) nodes: Vec<Node>,
    /// Chains by rod; a rod whose segments are not all joined has several.
    pub(super) chains: Vec<Chain>,
    /// Nodes at the start and the end of each segment, `[segments]`.
    pub(super) ends: Vec<[usize; 2]>,
}

impl Centrelines {
    /// Those of `model`.
    pub(super) fn new(model: &Model) -> Self {
        let count = model.segments.len();
        let next = successors(model);
        let mut previous = vec![None; count];
        for (from, successor) in next.iter().enumerate() {
            if let Some(Successor { segment, joint }) = *successor {
                previous[segment] = Some((from, joint));
            }
        }
        let mut seen = vec![false; count];
        let mut segments_of = Vec::new();
        // Open chains from their starts; what is left are rings, which start at their lowest segment.
        for start in (0..count).filter(|&i| previous[i].is_none()).chain(0..count) {
            let mut segments = Vec::new();
            let mut at = Some(start);
            while let Some(segment) = at.filter(|&segment| !seen[segment]) {
                seen[segment] = true;
                segments.push(segment);
                at = next[segment].map(|next| next.segment);
            }
            if !segments.is_empty() {
                segments_of.push(segments);
            }
        }
        segments_of.sort_by_key(|segments| (model.segments[segments[0]].rod, segments[0]));

        let mut lines = Self { nodes: Vec::new(), chains: Vec::new(), ends: vec![[0; 2]; count] };
        for segments in segments_of {
            let first = lines.nodes.len();
            for &segment in &segments {
                lines.ends[segment][0] = lines.nodes.len();
                let (before, joint) = previous[segment].unzip();
                lines.nodes.push(Node { before, after: Some(segment), joint });
                lines.ends[segment][1] = lines.nodes.len();
            }
            let closed = previous[segments[0]].is_some();
            let last = segments[segments.len() - 1];
            if closed {
                lines.ends[last][1] = first;
            } else {
                lines.nodes.push(Node { before: Some(last), ..Node::default() });
            }
            lines.chains.push(Chain { rod: model.segments[last].rod, nodes: first..lines.nodes.len(), closed });
        }
        let mut is_link = vec![false; model.joints.len()];
        next.iter().flatten().for_each(|next| is_link[next.joint] = true);
        for (index, joint) in model.joints.iter().enumerate() {
            let place = end_of(model, joint.b, joint.offset_b).or_else(|| end_of(model, joint.a, joint.offset_a));
            if let (false, Some((segment, end))) = (is_link[index], place) {
                lines.nodes[lines.ends[segment][end]].joint.get_or_insert(index);
            }
        }
        lines
    }

    /// The first segment of a chain.
    pub(super) fn first(&self, chain: &Chain) -> usize {
        self.nodes[chain.nodes.start].after.unwrap_or_default()
    }
}

impl Node {
    /// Place [m]: the middle between the end of the one segment and the start of the other, or the only one of them.
    pub(super) fn position(&self, model: &Model, state: &State) -> Vector3<f64> {
        let end = |(segment, side): (usize, f64)| {
            state.positions[segment] + state.axis(segment) * (side * model.segments[segment].length)
        };
        let before = self.before.map(|segment| end((segment, 0.5)));
        mean(before, self.after.map(|segment| end((segment, -0.5))), |a, b| 0.5 * (a + b))
    }

    /// Radius [m], the mean of the segments'.
    pub(super) fn radius(&self, model: &Model) -> f64 {
        let radius = |segment: usize| model.segments[segment].radius;
        mean(self.before.map(radius), self.after.map(radius), |a, b| 0.5 * (a + b))
    }
}

/// What both say, or what the only one says.
fn mean<T: Default>(before: Option<T>, after: Option<T>, both: impl FnOnce(T, T) -> T) -> T {
    match (before, after) {
        (Some(before), Some(after)) => both(before, after),
        (one, other) => one.or(other).unwrap_or_default(),
    }
}
