//! Who is joined to whom in one connected set of segments, and the order in which the direct solver eliminates it.
//!
//! The unknowns are the joints' multipliers, and two of them are coupled where they share a segment that moves. Joints
//! are eliminated from the leaves to a root, in post-order. A joint sees the segment at its outer end (towards the
//! leaves) through what its other joints have left of that segment's inverse mass, so nothing fills in, however many
//! joints a segment has.

/// What a joint that has been eliminated leaves of the body at its inner end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Leaves {
    /// It is the outer body of the next node.
    Carried,
    /// It waits for the next joint of that body to be eliminated.
    Waiting,
    /// Nothing is needed of it: the node is a root.
    Nothing,
}

/// A node of the elimination tree: a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// The joint.
    pub(crate) joint: u32,
    /// The body towards the leaves. All its other joints come earlier.
    pub(crate) outer: u32,
    /// The body towards the root.
    pub(crate) inner: u32,
    /// Whether the outer body has other joints; the node before this one has left it.
    pub(crate) follows: bool,
    /// Whether joints of the inner body were eliminated before: what they left is the last that waits.
    pub(crate) resumes: bool,
    /// What becomes of the inner body.
    pub(crate) leaves: Leaves,
}

/// Connectivity of one connected set of bodies.
#[derive(Clone, Debug, PartialEq)]
pub struct Topology {
    /// The two bodies of each joint.
    pub joints: Vec<[u32; 2]>,
    /// Bodies with an infinite mass: fixed segments and anchors.
    pub fixed: Vec<bool>,
    /// Elimination order in post-order; `None` where the graph has a loop.
    pub elimination: Option<Vec<Node>>,
    /// Nodes of each half of a chain that is eliminated from both its ends, 0 where there is no such chain. Of n nodes,
    /// the last is then the root, the `fold` before it are one half and the `fold` before those the other; one more
    /// comes first where n is even.
    pub fold: usize,
    /// Most bodies that wait at any time.
    pub stack_depth: usize,
    /// Nodes that resume a body that has waited, roots left out.
    pub resumptions: usize,
    /// Segments with three or more joints.
    pub branches: usize,
    /// Bodies that move and have no joint.
    pub lone: Vec<u32>,
}

impl Topology {
    /// Connectivity of bodies with these joints.
    pub fn new(joints: Vec<[u32; 2]>, fixed: Vec<bool>) -> Self {
        let incident = Incidence::new(&joints, fixed.len());
        let elimination = eliminate(&joints, &fixed, &incident);
        let nodes = elimination.as_deref().unwrap_or(&[]);
        let fold = fold(nodes);
        let stack_depth = stack_depth(nodes);
        let resumptions = nodes.iter().filter(|node| node.resumes && node.leaves != Leaves::Nothing).count();
        let branches = (0..fixed.len()).filter(|&body| !fixed[body] && incident.of(body).len() > 2).count();
        let is_lone = |&body: &u32| !fixed[body as usize] && incident.of(body as usize).is_empty();
        let lone = (0..fixed.len() as u32).filter(is_lone).collect();
        Self { joints, fixed, elimination, fold, stack_depth, resumptions, branches, lone }
    }

    /// Number of bodies.
    pub fn bodies(&self) -> usize {
        self.fixed.len()
    }

    /// Pairs of joints that share a body that moves, larger index first, each pair once.
    pub fn coupled_pairs(&self) -> Vec<(u32, u32)> {
        let incident = Incidence::new(&self.joints, self.bodies());
        let mut pairs = Vec::new();
        for body in (0..self.bodies()).filter(|&body| !self.fixed[body]) {
            let joints = incident.of(body);
            for (k, &first) in joints.iter().enumerate() {
                pairs.extend(joints[..k].iter().map(|&second| (first.max(second), first.min(second))));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}

/// The joints of every body, in one flat array.
struct Incidence {
    start: Vec<u32>,
    joints: Vec<u32>,
}

impl Incidence {
    fn new(ends: &[[u32; 2]], bodies: usize) -> Self {
        let mut start = vec![0_u32; bodies + 1];
        for &body in ends.iter().flatten() {
            start[body as usize + 1] += 1;
        }
        for body in 0..bodies {
            start[body + 1] += start[body];
        }
        let mut next = start.clone();
        let mut joints = vec![0_u32; 2 * ends.len()];
        for (joint, pair) in ends.iter().enumerate() {
            for &body in pair {
                joints[next[body as usize] as usize] = joint as u32;
                next[body as usize] += 1;
            }
        }
        Self { start, joints }
    }

    fn of(&self, body: usize) -> &[u32] {
        &self.joints[self.start[body] as usize..self.start[body + 1] as usize]
    }
}

fn eliminate(joints: &[[u32; 2]], fixed: &[bool], incident: &Incidence) -> Option<Vec<Node>> {
    let mut walk = Walk { joints, fixed, incident, met: vec![0; joints.len()], walks: 0, nodes: Vec::new() };
    walk.nodes.reserve(joints.len());
    for (joint, &[body, _]) in joints.iter().enumerate() {
        if walk.met[joint] != 0 {
            continue;
        }
        let first = walk.nodes.len();
        walk.eliminate_from(joint as u32, body)?;
        let is_chain = walk.nodes[first..].iter().all(|node| !node.resumes || node.leaves == Leaves::Nothing);
        if is_chain && walk.nodes.len() - first > 2 {
            // Rooted in its middle, a chain has two halves that do not depend on each other.
            let end = walk.nodes[first];
            walk.nodes.truncate(first);
            walk.eliminate_from(end.joint, end.inner)?;
            let middle = walk.nodes[first + (walk.nodes.len() - first - 1) / 2];
            walk.nodes.truncate(first);
            walk.eliminate_from(middle.joint, middle.outer)?;
        }
    }
    Some(walk.nodes)
}

struct Walk<'a> {
    joints: &'a [[u32; 2]],
    fixed: &'a [bool],
    incident: &'a Incidence,
    /// Number of the walk that met a joint last.
    met: Vec<u32>,
    walks: u32,
    nodes: Vec<Node>,
}

impl Walk<'_> {
    /// Appends the tree around the joint `root`, first what lies beyond its inner end; `None` if there is a loop.
    fn eliminate_from(&mut self, root: u32, outer: u32) -> Option<()> {
        self.walks += 1;
        let first = self.nodes.len();
        let inner = self.opposite(root, outer);
        let resumes = self.others(inner, root).next().is_some();
        let mut open = Vec::new();
        open.push(Node { joint: root, outer, inner, follows: false, resumes, leaves: Leaves::Nothing });
        // Pre-order, depth first. Read backwards it has every child before its parent, and subtrees stay together.
        while let Some(mut node) = open.pop() {
            if std::mem::replace(&mut self.met[node.joint as usize], self.walks) == self.walks {
                return None;
            }
            if node.leaves == Leaves::Nothing {
                self.open_beyond(node.inner, node.joint, Leaves::Waiting, &mut open);
            }
            let before = open.len();
            self.open_beyond(node.outer, node.joint, Leaves::Carried, &mut open);
            node.follows = open.len() > before;
            self.nodes.push(node);
        }
        self.nodes[first..].reverse();
        Some(())
    }

    /// Opens all joints of `body` but one; the one to be eliminated last, directly before that one, has `leaves`.
    fn open_beyond(&self, body: u32, joint: u32, leaves: Leaves, open: &mut Vec<Node>) {
        let before = open.len();
        open.extend(self.others(body, joint).map(|other| Node {
            joint: other,
            outer: self.opposite(other, body),
            inner: body,
            follows: false,
            resumes: true,
            leaves: Leaves::Waiting,
        }));
        if let [opened @ .., last] = &mut open[before..] {
            last.leaves = leaves;
            match opened.first_mut() {
                Some(first) => first.resumes = false,
                None => last.resumes = false,
            }
        }
    }

    /// The joints that a body which moves has besides `joint`.
    fn others(&self, body: u32, joint: u32) -> impl Iterator<Item = u32> {
        let joints = if self.fixed[body as usize] { &[] } else { self.incident.of(body as usize) };
        joints.iter().copied().filter(move |&other| other != joint)
    }

    fn opposite(&self, joint: u32, body: u32) -> u32 {
        let [a, b] = self.joints[joint as usize];
        if a == body { b } else { a }
    }
}

fn fold(nodes: &[Node]) -> usize {
    let Some((root, rest)) = nodes.split_last() else { return 0 };
    let one_chain = rest.iter().all(|node| !node.resumes && node.leaves != Leaves::Nothing);
    if one_chain && root.resumes && root.follows { rest.len() / 2 } else { 0 }
}

fn stack_depth(nodes: &[Node]) -> usize {
    let (mut depth, mut deepest) = (0_usize, 0);
    for node in nodes {
        depth -= usize::from(node.resumes);
        depth += usize::from(node.leaves == Leaves::Waiting);
        deepest = deepest.max(depth);
    }
    deepest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(n: u32) -> Topology {
        Topology::new((0..n - 1).map(|i| [i, i + 1]).collect(), vec![false; n as usize])
    }

    #[test]
    fn a_chain_is_eliminated_from_both_ends() {
        for n in 2..9 {
            let topology = chain(n);
            let nodes = topology.elimination.unwrap();
            let order: Vec<_> = nodes.iter().map(|n| n.joint).collect();
            let (low, high): (Vec<u32>, Vec<u32>) = order.iter().partition(|&&joint| joint < *order.last().unwrap());
            assert!(low.is_sorted() && high[..high.len() - 1].iter().rev().is_sorted(), "{order:?}");
            assert_eq!(topology.fold, (n as usize - 2) / 2);
            assert_eq!(topology.stack_depth, usize::from(n > 2));
        }
    }

    #[test]
    fn a_star_is_eliminated_with_one_body_that_waits() {
        let topology = Topology::new((1..=1000).map(|i| [0, i]).collect(), vec![false; 1001]);
        let nodes = topology.elimination.as_ref().unwrap();
        assert_eq!(nodes.len(), 1000);
        assert_eq!((topology.stack_depth, topology.fold, topology.branches), (1, 0, 1));
        assert_eq!(topology.resumptions, 998);
    }

    #[test]
    fn loops_are_seen_and_fixed_bodies_cut_them() {
        let ring = |fixed| Topology::new((0..6).map(|i| [i, (i + 1) % 6]).collect(), fixed);
        assert!(ring(vec![false; 6]).elimination.is_none());
        let mut fixed = vec![false; 6];
        fixed[2] = true;
        assert!(ring(fixed).elimination.is_some());
        let doubled = Topology::new(vec![[0, 1], [0, 1]], vec![false; 2]);
        assert!(doubled.elimination.is_none());
    }

    #[test]
    fn a_joint_between_fixed_bodies_stands_alone() {
        let nodes = Topology::new(vec![[0, 1]], vec![true; 2]).elimination.unwrap();
        let alone = Node { joint: 0, outer: 0, inner: 1, follows: false, resumes: false, leaves: Leaves::Nothing };
        assert_eq!(nodes, [alone]);
    }
}
