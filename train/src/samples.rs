//! All samples of a split in memory, as the network reads them.

use std::sync::Arc;

use copingnet::{Encoder, Encoding, Features, Inputs};
use dataset::{Dataset, Split, Trajectory};
use graph::{Batch, Channel, Graph, Whitening};
use rayon::prelude::*;

use crate::steps::Recorded;

/// The inputs and targets of the training samples.
pub(crate) struct Samples {
    trajectories: Vec<Rows>,
    /// Of every sample, its trajectory and its row there.
    places: Vec<[u32; 2]>,
}

/// A trajectory's samples, one after the other.
struct Rows {
    graph: Graph,
    /// Which of the trajectory's samples.
    numbers: Vec<u32>,
    nodes: Vec<f32>,
    edges: Vec<f32>,
    node_targets: Vec<f32>,
    edge_targets: Vec<f32>,
}

/// Samples joined to one graph.
#[derive(Default)]
pub(crate) struct Chunk {
    /// Which samples.
    pub(crate) samples: Vec<usize>,
    /// Connectivity.
    pub(crate) graphs: Batch,
    /// `[n, node_inputs]`
    pub(crate) nodes: Vec<f32>,
    /// `[m, edge_inputs]`
    pub(crate) edges: Vec<f32>,
    /// `[n, node_outputs]`
    pub(crate) node_targets: Vec<f32>,
    /// `[m, edge_outputs]`
    pub(crate) edge_targets: Vec<f32>,
}

/// Measures the inputs of every `every`-th training sample: how they are brought to unit size.
pub(crate) fn whitening(dataset: &Dataset, encoding: &Arc<Encoding>, every: usize) -> Inputs<Whitening> {
    let mut all = Inputs::<Vec<f32>>::default();
    let mut own = Inputs::default();
    for trajectory in dataset.trajectories(Split::Train) {
        let mut component = trajectory.component();
        let mut encoder = Encoder::new(encoding.clone(), trajectory.graph().clone(), trajectory.planar_normal());
        for sample in trajectory.samples().filter(|sample| sample.iteration() == 0).step_by(every) {
            sample.restore(&mut component);
            encoder.raw(&component, &mut own);
            all.nodes.extend(&own.nodes);
            all.constant_nodes.extend(&own.constant_nodes);
            all.edges.extend(&own.edges);
            all.constant_edges.extend(&own.constant_edges);
        }
    }
    fit(encoding.features, &[&all])
}

/// How these inputs are brought to unit size.
pub(crate) fn fit(features: Features, inputs: &[&Inputs<Vec<f32>>]) -> Inputs<Whitening> {
    let fit = |channels: &[Channel], rows: fn(&Inputs<Vec<f32>>) -> &Vec<f32>| {
        Whitening::fit(channels, inputs.iter().map(|inputs| rows(inputs).as_slice()))
    };
    let channels = features.channels();
    Inputs {
        nodes: fit(channels.nodes, |inputs| &inputs.nodes),
        constant_nodes: fit(channels.constant_nodes, |inputs| &inputs.constant_nodes),
        edges: fit(channels.edges, |inputs| &inputs.edges),
        constant_edges: fit(channels.constant_edges, |inputs| &inputs.constant_edges),
    }
}

impl Samples {
    /// Encodes the first outer iteration of every training step ([`copingnet::GnGuess`] says why no others), on rayon's
    /// current thread pool.
    pub(crate) fn of_solves(dataset: &Dataset, encoding: &Arc<Encoding>) -> Self {
        let split = Split::Train;
        let trajectories: Vec<Rows> = (0..dataset.trajectory_count(split))
            .into_par_iter()
            .filter_map(|index| dataset.trajectory(split, index))
            .map(|trajectory| Rows::of_solves(&trajectory, encoding))
            .collect();
        Self::new(trajectories)
    }

    /// Whitens whole steps, on rayon's current thread pool.
    pub(crate) fn of_steps(recorded: Vec<Recorded>, encoding: &Encoding) -> Self {
        Self::new(recorded.into_par_iter().filter_map(|recorded| Rows::of_steps(recorded, encoding)).collect())
    }

    fn new(trajectories: Vec<Rows>) -> Self {
        let places = |(index, rows): (usize, &Rows)| (0..rows.numbers.len()).map(move |k| [index as u32, k as u32]);
        let places = trajectories.iter().enumerate().flat_map(places).collect();
        Self { trajectories, places }
    }

    /// Number of samples.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Trajectory of a sample, and its number there.
    pub(crate) fn place(&self, sample: usize) -> [usize; 2] {
        let [trajectory, k] = self.places[sample].map(|i| i as usize);
        [trajectory, self.trajectories[trajectory].numbers[k] as usize]
    }

    /// Joins samples.
    pub(crate) fn chunk(&self, samples: &[usize]) -> Chunk {
        let mut chunk = Chunk { samples: samples.to_vec(), ..Chunk::default() };
        for &sample in samples {
            let [trajectory, k] = self.places[sample].map(|i| i as usize);
            let rows = &self.trajectories[trajectory];
            chunk.graphs.push(&rows.graph);
            let own = |values: &[f32], all: &mut Vec<f32>| {
                let count = values.len() / rows.numbers.len();
                all.extend(&values[k * count..(k + 1) * count]);
            };
            own(&rows.nodes, &mut chunk.nodes);
            own(&rows.edges, &mut chunk.edges);
            own(&rows.node_targets, &mut chunk.node_targets);
            own(&rows.edge_targets, &mut chunk.edge_targets);
        }
        chunk
    }
}

impl Rows {
    fn of_solves(trajectory: &Trajectory<'_>, encoding: &Arc<Encoding>) -> Self {
        let graph = trajectory.graph().clone();
        let mut encoder = Encoder::new(encoding.clone(), graph.clone(), trajectory.planar_normal());
        let mut component = trajectory.component();
        let (mut inputs, mut targets) = (Inputs::default(), (Vec::new(), Vec::new()));
        let mut rows = Self {
            graph,
            numbers: Vec::new(),
            nodes: Vec::new(),
            edges: Vec::new(),
            node_targets: Vec::new(),
            edge_targets: Vec::new(),
        };
        for (k, sample) in trajectory.samples().enumerate().filter(|(_, sample)| sample.iteration() == 0) {
            rows.numbers.push(k as u32);
            sample.restore(&mut component);
            encoder.encode(&component, &mut inputs);
            encoder.targets(&component, &mut targets.0, &mut targets.1);
            let (n, m) = (component.poses.len(), component.dlambda.len());
            join(&inputs.nodes, &inputs.constant_nodes, n, &mut rows.nodes);
            join(&inputs.edges, &inputs.constant_edges, m, &mut rows.edges);
            rows.node_targets.extend(&targets.0);
            rows.edge_targets.extend(&targets.1);
        }
        rows
    }

    fn of_steps(recorded: Recorded, encoding: &Encoding) -> Option<Self> {
        let graph = recorded.graph?;
        let mut inputs = recorded.inputs;
        encoding.whiten(&mut inputs);
        let [mut nodes, mut edges] = [Vec::new(), Vec::new()];
        let (n, m) = (graph.nodes().len(), graph.edges().len());
        for step in inputs.nodes.chunks_exact(inputs.nodes.len() / recorded.steps) {
            join(step, &inputs.constant_nodes, n, &mut nodes);
        }
        for step in inputs.edges.chunks_exact((inputs.edges.len() / recorded.steps).max(1)) {
            join(step, &inputs.constant_edges, m, &mut edges);
        }
        let numbers = (0..recorded.steps as u32).collect();
        Some(Self { graph, numbers, nodes, edges, node_targets: recorded.targets, edge_targets: Vec::new() })
    }
}

/// Appends `rows` rows of changing inputs, each with its constant ones after it.
pub(crate) fn join(changing: &[f32], constant: &[f32], rows: usize, out: &mut Vec<f32>) {
    let [a, b] = [changing, constant].map(|values| values.len() / rows.max(1));
    for row in 0..rows {
        out.extend(&changing[row * a..(row + 1) * a]);
        out.extend(&constant[row * b..(row + 1) * b]);
    }
}
