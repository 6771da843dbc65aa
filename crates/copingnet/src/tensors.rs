//! A batch of graphs as tensors.

use burn::tensor::{Device, Int, Tensor, TensorData};
use graph::Batch;

/// A batch of graphs on a device.
#[derive(Clone, Debug)]
pub struct GraphTensors {
    /// Inputs of the nodes. `[n, node_inputs]`
    pub nodes: Tensor<2>,
    /// Inputs of the edges. `[m, edge_inputs]`
    pub edges: Tensor<2>,
    /// Sender of each edge. `[m]`
    pub(crate) senders: Tensor<1, Int>,
    /// Receiver of each edge. `[m]`
    pub(crate) receivers: Tensor<1, Int>,
    /// Ancestors 1, 2, 4, ... hops away, as far as there are any; none where they are not asked for.
    pub(crate) hops: Vec<Hop>,
    /// Number of nodes.
    pub(crate) n: usize,
}

/// The ancestors some hops away.
#[derive(Clone, Debug)]
pub(crate) struct Hop {
    /// The ancestor of each node; 0 where there is none. `[n]`
    pub(crate) ancestors: Tensor<1, Int>,
    /// 1 where there is one, else 0. `[n, 1]`
    pub(crate) exists: Tensor<2>,
}

impl GraphTensors {
    /// A batch with inputs of nodes `[n, node_inputs]` and edges `[m, edge_inputs]`. `has_scans` says whether the
    /// network needs to know ancestors.
    pub fn new(graphs: &Batch, nodes: &[f32], edges: &[f32], has_scans: bool, device: &Device) -> Self {
        let (n, m) = (graphs.nodes(), graphs.edges());
        let rows = |values: &[f32], rows: usize| {
            let columns = values.len() / rows.max(1);
            Tensor::from_data(TensorData::new(values.to_vec(), [rows, columns]), device)
        };
        Self {
            nodes: rows(nodes, n),
            edges: rows(edges, m),
            senders: indices(&graphs.senders, device),
            receivers: indices(&graphs.receivers, device),
            hops: if has_scans { hops(graphs, device) } else { Vec::new() },
            n,
        }
    }
}

fn indices(values: &[u32], device: &Device) -> Tensor<1, Int> {
    let values: Vec<i64> = values.iter().map(|&i| i64::from(i)).collect();
    let count = values.len();
    Tensor::from_data(TensorData::new(values, [count]), device)
}

fn hops(graphs: &Batch, device: &Device) -> Vec<Hop> {
    let mut ancestors = vec![None; graphs.nodes()];
    for &[node, parent] in &graphs.visits {
        ancestors[node as usize] = Some(parent);
    }
    let mut hops = Vec::new();
    while ancestors.iter().any(Option::is_some) {
        let found: Vec<u32> = ancestors.iter().map(|ancestor| ancestor.unwrap_or(0)).collect();
        let exists: Vec<f32> = ancestors.iter().map(|ancestor| f32::from(u8::from(ancestor.is_some()))).collect();
        let exists = Tensor::from_data(TensorData::new(exists, [found.len(), 1]), device);
        hops.push(Hop { ancestors: indices(&found, device), exists });
        ancestors = ancestors.iter().map(|ancestor| ancestor.and_then(|i| ancestors[i as usize])).collect();
    }
    hops
}
