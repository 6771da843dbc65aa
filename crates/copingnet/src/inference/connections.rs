//! Who is joined to whom, laid out for the sweeps.

use graph::Batch;

/// Which edges every node has on one side.
#[derive(Debug)]
pub(super) struct Lists {
    /// Every node's first edge; where it has none, the number of edges.
    pub(super) first: Vec<u32>,
    starts: Vec<u32>,
    others: Vec<u32>,
}

impl Lists {
    /// Edges by the node that `ends` gives each, in ascending order.
    fn new(nodes: usize, ends: &[u32]) -> Self {
        let mut of = vec![Vec::new(); nodes];
        for (edge, &node) in ends.iter().enumerate() {
            of[node as usize].push(edge as u32);
        }
        let (mut first, mut starts, mut others) = (Vec::with_capacity(nodes), vec![0], Vec::new());
        for edges in of {
            first.push(edges.first().copied().unwrap_or(ends.len() as u32));
            others.extend(edges.iter().skip(1));
            starts.push(others.len() as u32);
        }
        Self { first, starts, others }
    }

    /// The edges of a node after its first one.
    #[inline(always)]
    pub(super) fn others(&self, node: usize) -> &[u32] {
        &self.others[self.starts[node] as usize..self.starts[node + 1] as usize]
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
