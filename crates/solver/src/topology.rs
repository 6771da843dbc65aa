//! Who is joined to whom in one connected set of segments, and the order in which the direct solver eliminates it.
//!
//! The unknowns are the joints' multipliers, and two of them are coupled where they share a segment that moves. A
//! segment with three or more joints would couple all of them with each other; it becomes an unknown of its own instead
//! (its six corrections, as in the undivided system of Baraff 1996). Then the unknowns of any acyclic graph form a tree,
//! and elimination from its leaves to its roots, in post-order, fills nothing in.

/// Marks "no node".
pub const NONE: u32 = u32::MAX;

/// What a node of the elimination tree stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// The multipliers of a joint.
    Joint(u32),
    /// The corrections of a segment with three or more joints.
    Body(u32),
}

/// A node of the elimination tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// What it stands for.
    pub unknown: Unknown,
    /// Index of the parent node, [`NONE`] at a root. Parents come later than their children.
    pub parent: u32,
    /// The body through which node and parent are coupled (the body itself where one of the two is a body).
    pub via: u32,
    /// How many children the node has.
    pub children: u32,
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
    /// Most contributions of eliminated children that wait for their parents at any time.
    pub stack_depth: usize,
    /// Bodies that are unknowns of their own.
    pub branches: usize,
}

impl Topology {
    /// Connectivity of bodies with these joints.
    pub fn new(joints: Vec<[u32; 2]>, fixed: Vec<bool>) -> Self {
        let incident = Incidence::new(&joints, fixed.len());
        let elimination = eliminate(&joints, &fixed, &incident);
        let stack_depth = elimination.as_deref().map_or(0, stack_depth);
        let is_body = |node: &&Node| matches!(node.unknown, Unknown::Body(_));
        let branches = elimination.as_deref().map_or(0, |nodes| nodes.iter().filter(is_body).count());
        Self { joints, fixed, elimination, stack_depth, branches }
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

/// A node on the way down, before its children are known.
struct Visit {
    unknown: Unknown,
    via: u32,
    /// Index of the parent's visit, or [`NONE`].
    parent: u32,
}

fn eliminate(joints: &[[u32; 2]], fixed: &[bool], incident: &Incidence) -> Option<Vec<Node>> {
    let mut seen_joint = vec![false; joints.len()];
    let mut seen_body = vec![false; fixed.len()];
    let mut visits: Vec<Visit> = Vec::with_capacity(joints.len());
    let mut open: Vec<Visit> = Vec::new();
    for root in 0..joints.len() as u32 {
        if seen_joint[root as usize] {
            continue;
        }
        open.push(Visit { unknown: Unknown::Joint(root), via: NONE, parent: NONE });
        // Pre-order, depth first. Read backwards it has every child before its parent, and subtrees stay together.
        while let Some(visit) = open.pop() {
            let index = visits.len() as u32;
            match visit.unknown {
                Unknown::Joint(joint) => {
                    if std::mem::replace(&mut seen_joint[joint as usize], true) {
                        return None;
                    }
                    for &body in joints[joint as usize].iter().filter(|&&body| !fixed[body as usize]) {
                        if body == visit.via {
                            continue;
                        }
                        match incident.of(body as usize) {
                            [_] => {}
                            &[first, second] => {
                                let other = if first == joint { second } else { first };
                                open.push(Visit { unknown: Unknown::Joint(other), via: body, parent: index });
                            }
                            _ => open.push(Visit { unknown: Unknown::Body(body), via: body, parent: index }),
                        }
                    }
                }
                Unknown::Body(body) => {
                    if std::mem::replace(&mut seen_body[body as usize], true) {
                        return None;
                    }
                    let Some(parent) = visits.get(visit.parent as usize) else { return None };
                    let others = incident.of(body as usize).iter().filter(|&&j| Unknown::Joint(j) != parent.unknown);
                    open.extend(others.map(|&j| Visit { unknown: Unknown::Joint(j), via: body, parent: index }));
                }
            }
            visits.push(visit);
        }
    }
    let last = visits.len().wrapping_sub(1) as u32;
    let mut nodes: Vec<Node> = visits
        .iter()
        .rev()
        .map(|visit| Node {
            unknown: visit.unknown,
            parent: if visit.parent == NONE { NONE } else { last - visit.parent },
            via: visit.via,
            children: 0,
        })
        .collect();
    for index in 0..nodes.len() {
        if let Some(parent) = nodes.get(nodes[index].parent as usize).map(|_| nodes[index].parent as usize) {
            nodes[parent].children += 1;
        }
    }
    Some(nodes)
}

fn stack_depth(nodes: &[Node]) -> usize {
    let (mut depth, mut deepest) = (0_usize, 0);
    for node in nodes {
        depth -= node.children as usize;
        depth += usize::from(node.parent != NONE);
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
    fn a_chain_is_eliminated_from_one_end_with_one_waiting_block() {
        let topology = chain(5);
        let nodes = topology.elimination.unwrap();
        let order: Vec<_> = nodes.iter().map(|n| n.unknown).collect();
        assert_eq!(order, [3, 2, 1, 0].map(Unknown::Joint));
        assert_eq!(nodes.iter().map(|n| n.parent).collect::<Vec<_>>(), [1, 2, 3, NONE]);
        assert_eq!(topology.stack_depth, 1);
    }

    #[test]
    fn a_star_gets_a_node_for_its_centre_and_is_a_tree_in_post_order() {
        let topology = Topology::new((1..=1000).map(|i| [0, i]).collect(), vec![false; 1001]);
        let nodes = topology.elimination.as_ref().unwrap();
        assert_eq!(nodes.len(), 1001);
        assert_eq!(nodes.iter().filter(|n| n.unknown == Unknown::Body(0)).count(), 1);
        assert!(nodes.iter().enumerate().all(|(i, n)| n.parent == NONE || n.parent as usize > i));
        assert_eq!(topology.stack_depth, 999);
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
        assert_eq!(nodes, [Node { unknown: Unknown::Joint(0), parent: NONE, via: NONE, children: 0 }]);
    }
}
