//! Several graphs as one, without edges between them.

use std::ops::Range;

use crate::Graph;

/// Connectivity of graphs joined by concatenation: features of all nodes, and of all edges, lie one after the other.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Batch {
    /// Number of nodes of each graph. `[graphs]`
    pub n_node: Vec<u32>,
    /// Number of edges of each graph. `[graphs]`
    pub n_edge: Vec<u32>,
    /// Sender of every edge, counted through all graphs. `[sum of n_edge]`
    pub senders: Vec<u32>,
    /// Receiver of every edge, counted through all graphs. `[sum of n_edge]`
    pub receivers: Vec<u32>,
    /// Node and parent of every visit on the way outwards ([`Graph::visits`]), parents first, counted through all graphs.
    pub visits: Vec<[u32; 2]>,
    nodes: usize,
}

impl Batch {
    /// Removes all graphs and keeps the memory.
    pub fn clear(&mut self) {
        let Self { n_node, n_edge, senders, receivers, visits, nodes } = self;
        visits.clear();
        [n_node, n_edge, senders, receivers].into_iter().for_each(Vec::clear);
        *nodes = 0;
    }

    /// Appends a graph and returns the rows of its nodes and of its edges.
    pub fn push(&mut self, graph: &Graph) -> (Range<usize>, Range<usize>) {
        let (first_node, first_edge) = (self.nodes, self.senders.len());
        let offset = first_node as u32;
        self.senders.extend(graph.senders().iter().map(|&i| i + offset));
        self.receivers.extend(graph.receivers().iter().map(|&i| i + offset));
        self.visits.extend(graph.visits().iter().map(|visit| [visit.node, visit.parent].map(|i| i + offset)));
        self.n_node.push(graph.nodes().len() as u32);
        self.n_edge.push(graph.edges().len() as u32);
        self.nodes += graph.nodes().len();
        (first_node..self.nodes, first_edge..self.senders.len())
    }

    /// So many chains of so many nodes each, with an edge from each node to the next.
    pub fn chains(count: usize, nodes: usize) -> Self {
        let edges = nodes.saturating_sub(1);
        let first = |k: usize| (k / edges.max(1) * nodes + k % edges.max(1)) as u32;
        let senders: Vec<u32> = (0..count * edges).map(first).collect();
        Self {
            n_node: vec![nodes as u32; count],
            n_edge: vec![edges as u32; count],
            receivers: senders.iter().map(|sender| sender + 1).collect(),
            visits: senders.iter().map(|&sender| [sender + 1, sender]).collect(),
            senders,
            nodes: count * nodes,
        }
    }

    /// Number of nodes of all graphs.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Number of edges of all graphs.
    pub fn edges(&self) -> usize {
        self.senders.len()
    }
}
