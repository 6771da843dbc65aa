//! Who is joined to whom, laid out for the sweeps.

use graph::Batch;

/// Which edges every node has on one side.
#[derive(Debug)]
pub(super) struct Lists {
    starts: Vec<u32>,
    edges: Vec<u32>,
}

impl Lists {
    /// Edges by the node that `ends` gives each, in ascending order.
    fn new(nodes: usize, ends: &[u32]) -> Self {
        let mut starts = vec![0; nodes + 1];
        for &node in ends {
            starts[node as usize + 1] += 1;
        }
        for node in 0..nodes {
            starts[node + 1] += starts[node];
        }
        let (mut next, mut edges) = (starts.clone(), vec![0; ends.len()]);
        for (edge, &node) in ends.iter().enumerate() {
            let place = &mut next[node as usize];
            edges[*place as usize] = edge as u32;
            *place += 1;
        }
        Self { starts, edges }
    }

    /// The edges of a node.
    #[inline(always)]
    pub(super) fn of(&self, node: usize) -> &[u32] {
        &self.edges[self.starts[node] as usize..self.starts[node + 1] as usize]
    }
}

/// Connectivity of a batch.
#[derive(Debug)]
pub(super) struct Connections {
    /// Number of nodes n.
    pub(super) nodes: usize,
    /// Number of edges m.
    pub(super) edges: usize,
    /// Sender of every edge. `[m]`
    pub(super) senders: Vec<u32>,
    /// Receiver of every edge. `[m]`
    pub(super) receivers: Vec<u32>,
    /// The edges that every node sends.
    pub(super) sent: Lists,
    /// The edges that every node receives.
    pub(super) received: Lists,
    /// Node and parent of every visit, parents first.
    pub(super) visits: Vec<[u32; 2]>,
}

impl Connections {
    pub(super) fn new(graphs: &Batch) -> Self {
        let nodes = graphs.nodes();
        Self {
            nodes,
            edges: graphs.edges(),
            senders: graphs.senders.clone(),
            receivers: graphs.receivers.clone(),
            sent: Lists::new(nodes, &graphs.senders),
            received: Lists::new(nodes, &graphs.receivers),
            visits: graphs.visits.clone(),
        }
    }
}
