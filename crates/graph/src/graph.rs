//! What stays the same of one connected set of segments: nodes, edges, connectivity, and the way from the clamp.

use std::collections::{HashMap, VecDeque};

use component::Members;
use jointed::topology::Topology;
use rod::{Body, Model};

/// What stays the same of a node: a segment, or an anchor in the ground that a joint holds on to.
///
/// An anchor takes radius, density, length and place along the rod from the first segment joined to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Radius r [m].
    pub radius: f64,
    /// Density rho [kg/m^3].
    pub density: f64,
    /// Length l [m].
    pub length: f64,
    /// Mass [kg], whether it moves or not.
    pub mass: f64,
    /// Place alpha along the rod in [0, 1]: arc length from the first segment's centre to this one's, over that to the
    /// last one's ((i - 1) / (N - 1) for N equal segments). Every rod of a tree has its own; 0 for a lone segment.
    pub alpha: f64,
    /// Whether the segment itself moves, and whether what is joined to its left and to its right does.
    ///
    /// Left is where connectors have an offset < 0 along the axis. An end that nothing is joined to is free.
    pub free: [bool; 3],
    /// Number of joints on the way from the nearest fixed body, 0 for that itself.
    pub depth: u32,
    /// Number of nodes on the longest way on from there that does not lead back, this one included.
    pub height: u32,
    /// The fixed body at the beginning of the way; where no body is fixed, the first one.
    pub root: u32,
    /// The last segment of its own rod, seen from the root.
    pub tip: u32,
    /// Mean mass [kg] and length [m] of its rod's segments that move: the rod's scale.
    pub rod_scale: [f64; 2],
}

/// What stays the same of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Rest Darboux vector Omega_0 in the frame of body a, the sender [1/m].
    pub rest_darboux: [f64; 3],
    /// Young's modulus Y [Pa].
    pub youngs_modulus: f64,
    /// Torsion modulus T [Pa].
    pub torsion_modulus: f64,
    /// Length l of the joint [m].
    pub length: f64,
    /// Places of the connectors on the axes of sender and receiver, from their centres [m].
    pub offsets: [f64; 2],
    /// Compliance of bending and of twist [1/(N m^3)].
    pub bend_compliance: [f64; 2],
    /// The end that is farther from the clamp: its rod's scale is the edge's.
    pub outer: u32,
}

/// One step on the way from the fixed bodies outwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visit {
    /// The node.
    pub node: u32,
    /// The node before it.
    pub parent: u32,
    /// The edge between them.
    pub edge: u32,
    /// Whether the node is the edge's sender.
    pub is_sender: bool,
}

impl Visit {
    /// The node's and its parent's, of a pair that the edge has for its sender and its receiver.
    pub fn of_node<T>(&self, [of_sender, of_receiver]: [T; 2]) -> [T; 2] {
        if self.is_sender { [of_sender, of_receiver] } else { [of_receiver, of_sender] }
    }
}

/// What stays the same of one connected set of segments.
#[derive(Clone, Debug, PartialEq)]
pub struct Graph {
    nodes: Vec<Node>,
    edges: Vec<Edge>,
    senders: Vec<u32>,
    receivers: Vec<u32>,
    visits: Vec<Visit>,
    segments: usize,
}

impl Graph {
    /// The graph of one connected set of a model's segments, as [`component::split`] gives it.
    ///
    /// Nodes are in the order of the solver's bodies: segments, then anchors.
    pub fn new(model: &Model, members: &Members, topology: &Topology) -> Self {
        let rods = Rods::new(model, members, topology);
        let (senders, receivers) = topology.joints.iter().map(|&[a, b]| (a, b)).unzip();
        let mut graph = Self {
            nodes: nodes(model, members, topology, &rods),
            edges: edges(model, members),
            senders,
            receivers,
            visits: Vec::new(),
            segments: members.segments.len(),
        };
        graph.set_ends(topology);
        graph.walk(topology);
        graph.set_tips(&rods);
        graph.set_rod_scales(&rods);
        graph
    }

    /// The nodes.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The edges.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Body a of every joint. `[edges]`
    pub fn senders(&self) -> &[u32] {
        &self.senders
    }

    /// Body b of every joint. `[edges]`
    pub fn receivers(&self) -> &[u32] {
        &self.receivers
    }

    /// Number of nodes that are segments; anchors come after them.
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// The way outwards: every node that is no root, after its parent. Starts at all fixed bodies at once, so that each
    /// node is reached from the nearest (from the one of the lower index where two are as near), and at the first body
    /// where none is fixed. An edge that closes a loop is on nobody's way.
    pub fn visits(&self) -> &[Visit] {
        &self.visits
    }

    /// Whether a body is fixed.
    pub fn is_fixed(&self, node: usize) -> bool {
        !self.nodes[node].free[0]
    }

    /// Whether nothing holds the set: no body is fixed.
    pub fn is_free(&self) -> bool {
        self.nodes.iter().all(|node| node.free[0])
    }

    /// Number of nodes that move.
    pub fn moving(&self) -> usize {
        self.nodes.iter().filter(|node| node.free[0]).count()
    }

    fn set_ends(&mut self, topology: &Topology) {
        for (edge, &[a, b]) in self.edges.iter().zip(&topology.joints) {
            for (own, other, offset) in [(a, b, edge.offsets[0]), (b, a, edge.offsets[1])] {
                let side = if offset < 0.0 { 1 } else { 2 };
                self.nodes[own as usize].free[side] &= !topology.fixed[other as usize];
            }
        }
    }

    fn walk(&mut self, topology: &Topology) {
        let mut incident = vec![Vec::new(); self.nodes.len()];
        for (edge, &[a, b]) in topology.joints.iter().enumerate() {
            incident[a as usize].push((edge, b, false));
            incident[b as usize].push((edge, a, true));
        }
        let fixed = (0..self.nodes.len()).filter(|&node| topology.fixed[node]);
        let mut open: VecDeque<usize> = fixed.collect();
        if open.is_empty() && !self.nodes.is_empty() {
            open.push_back(0);
        }
        let mut met = vec![false; self.nodes.len()];
        for &root in &open {
            met[root] = true;
            self.nodes[root].root = root as u32;
        }
        while let Some(parent) = open.pop_front() {
            for &(edge, node, is_sender) in &incident[parent] {
                if std::mem::replace(&mut met[node as usize], true) {
                    continue;
                }
                self.visits.push(Visit { node, parent: parent as u32, edge: edge as u32, is_sender });
                let (depth, root) = (self.nodes[parent].depth + 1, self.nodes[parent].root);
                let node = node as usize;
                (self.nodes[node].depth, self.nodes[node].root) = (depth, root);
                self.edges[edge].outer = node as u32;
                open.push_back(node);
            }
        }
        for visit in self.visits.iter().rev() {
            let height = self.nodes[visit.node as usize].height + 1;
            let parent = &mut self.nodes[visit.parent as usize];
            parent.height = parent.height.max(height);
        }
    }

    /// The ends of every rod, seen from the clamp.
    fn set_tips(&mut self, rods: &Rods) {
        let mut ends = vec![None; rods.count];
        for (i, &rod) in rods.of.iter().enumerate() {
            let (first, _) = ends[rod].unwrap_or((i, i));
            ends[rod] = Some((first, i));
        }
        for (i, &rod) in rods.of.iter().enumerate() {
            let (first, last) = ends[rod].unwrap_or((i, i));
            let is_reversed = self.nodes[first].depth > self.nodes[last].depth;
            self.nodes[i].tip = if is_reversed { first } else { last } as u32;
        }
    }

    fn set_rod_scales(&mut self, rods: &Rods) {
        let mut sums = vec![[0.0; 3]; rods.count];
        for (node, &rod) in self.nodes.iter().zip(&rods.of).take(self.segments).filter(|(node, _)| node.free[0]) {
            let [count, mass, length] = sums[rod];
            sums[rod] = [count + 1.0, mass + node.mass, length + node.length];
        }
        for (node, &rod) in self.nodes.iter_mut().zip(&rods.of) {
            let [count, mass, length] = sums[rod];
            node.rod_scale = if count > 0.0 { [mass / count, length / count] } else { [node.mass, node.length] };
        }
    }
}

/// Which rod every node belongs to, counted within the graph; anchors belong to that of the segment they hold.
struct Rods {
    of: Vec<usize>,
    count: usize,
    /// The segment that each anchor holds.
    held: Vec<usize>,
}

impl Rods {
    fn new(model: &Model, members: &Members, topology: &Topology) -> Self {
        let mut known = HashMap::new();
        let mut of: Vec<usize> = Vec::with_capacity(topology.bodies());
        for &segment in &members.segments {
            let next = known.len();
            of.push(*known.entry(model.segments[segment].rod).or_insert(next));
        }
        let segments = of.len();
        let mut held = vec![0; topology.bodies() - segments];
        for &[a, b] in topology.joints.iter().rev() {
            for (own, other) in [(a as usize, b as usize), (b as usize, a as usize)] {
                if own >= segments {
                    held[own - segments] = other;
                }
            }
        }
        of.extend(held.iter().map(|&segment| of[segment]).collect::<Vec<_>>());
        Self { of, count: known.len(), held }
    }
}

fn nodes(model: &Model, members: &Members, topology: &Topology, rods: &Rods) -> Vec<Node> {
    let node = |(&index, &fixed): (&usize, &bool)| {
        let segment = &model.segments[index];
        Node {
            radius: segment.radius,
            density: segment.density,
            length: segment.length,
            mass: segment.mass(),
            alpha: 0.0,
            free: [!fixed, true, true],
            depth: 0,
            height: 1,
            root: 0,
            tip: 0,
            rod_scale: [segment.mass(), segment.length],
        }
    };
    let mut nodes: Vec<Node> = members.segments.iter().zip(&topology.fixed).map(node).collect();
    // Of every rod: arc length up to the face reached so far, of its first and of its last centre.
    let mut places = vec![[0.0; 3]; rods.count];
    for (node, &rod) in nodes.iter_mut().zip(&rods.of) {
        let [face, first, _] = places[rod];
        let centre = face + 0.5 * node.length;
        node.alpha = centre;
        places[rod] = [face + node.length, if face == 0.0 { centre } else { first }, centre];
    }
    for (node, &rod) in nodes.iter_mut().zip(&rods.of) {
        let [_, first, last] = places[rod];
        node.alpha = if last > first { (node.alpha - first) / (last - first) } else { 0.0 };
    }
    let anchors: Vec<Node> = rods.held.iter().map(|&held| Node { free: [false, true, true], ..nodes[held] }).collect();
    nodes.extend(anchors);
    nodes
}

fn edges(model: &Model, members: &Members) -> Vec<Edge> {
    let edge = |&k: &usize| {
        let joint = &model.joints[k];
        let outer = if matches!(joint.a, Body::Segment(_)) { joint.a } else { joint.b };
        let outer = match outer {
            Body::Segment(i) => members.segments.binary_search(&i).unwrap_or(0) as u32,
            Body::Anchor(_) => 0,
        };
        Edge {
            rest_darboux: joint.rest_darboux.into(),
            youngs_modulus: joint.youngs_modulus,
            torsion_modulus: joint.torsion_modulus,
            length: joint.length,
            offsets: [joint.offset_a, joint.offset_b],
            bend_compliance: [joint.bend_compliance, joint.twist_compliance],
            outer,
        }
    };
    members.joints.iter().map(edge).collect()
}
