//! The training loop.

use burn::tensor::{Device, Tensor, TensorData};
use copingnet::{Adam, AdamParams, GraphTensors, Network, Weights};
use dataset::shuffled;
use rayon::prelude::*;

use crate::objective::{Evaluated, Objective};
use crate::plan::{Loss, Plan, Schedule};
use crate::samples::{Chunk, Samples};

/// Samples whose gradient is computed in one piece. Sums run over chunks in their order, whichever thread made them, so
/// that the number of threads changes no bit.
const CHUNK: usize = 32;
/// Steps over which the step size rises to its full size.
const WARM_UP: u64 = 200;

/// A network in training.
pub(crate) struct Trainer<'a> {
    plan: &'a Plan,
    samples: &'a Samples,
    objective: Objective<'a>,
    device: Device,
    has_scans: bool,
    pub(crate) weights: Weights,
    pub(crate) adam: Adam,
    /// Samples left out because their loss or their batch's gradient was not finite.
    pub(crate) left_out: u64,
}

impl<'a> Trainer<'a> {
    pub(crate) fn new(plan: &'a Plan, samples: &'a Samples, objective: Objective<'a>) -> Self {
        let weights = Weights::random(plan.network, plan.seed);
        let adam = Adam::new(weights.values().len());
        let device = plan.backend.device().autodiff();
        Self { plan, samples, objective, device, has_scans: plan.network.scans > 0, weights, adam, left_out: 0 }
    }

    /// Samples of an epoch.
    pub(crate) fn samples(&self) -> usize {
        self.samples.len()
    }

    /// Batches of an epoch.
    pub(crate) fn batches(&self) -> u64 {
        self.samples.len().div_ceil(self.plan.batch) as u64
    }

    /// The samples' order in an epoch.
    pub(crate) fn order(&self, epoch: u64) -> Vec<usize> {
        shuffled(self.samples.len(), self.plan.seed, epoch)
    }

    /// One step on a batch of samples. Returns the loss and the number of nodes.
    pub(crate) fn step(&mut self, batch: &[usize]) -> (f64, usize) {
        let chunks: Vec<Chunk> = batch.chunks(CHUNK).map(|samples| self.samples.chunk(samples)).collect();
        let sum = |count: fn(&Chunk) -> usize| chunks.iter().map(count).sum();
        let rows: [usize; 2] = [sum(|chunk| chunk.graphs.nodes()), sum(|chunk| chunk.graphs.edges())];
        let parts: Vec<(Evaluated, Vec<f32>)> =
            chunks.par_iter().map(|chunk| self.gradient(chunk, batch.len(), rows)).collect();
        let mut gradient = vec![0.0; self.weights.values().len()];
        let mut loss = 0.0;
        for (own, part) in &parts {
            loss += own.loss;
            self.left_out += own.left_out as u64;
            gradient.iter_mut().zip(part).for_each(|(sum, g)| *sum += g);
        }
        let params = AdamParams {
            beta_1: 0.9,
            beta_2: if self.plan.loss == Loss::Mse { 0.999 } else { 0.99 },
            clip: if self.plan.loss == Loss::Mse { f64::INFINITY } else { 1.0 },
        };
        let rate = self.rate();
        if !self.adam.step(&params, rate, &gradient, self.weights.values_mut()).is_finite() {
            self.left_out += batch.len() as u64;
        }
        (loss, rows[0])
    }

    /// Adam's step size.
    fn rate(&self) -> f64 {
        let (done, all) = (self.adam.steps as f64, (self.plan.epochs * self.batches()) as f64);
        let fraction = match self.plan.schedule {
            Schedule::Constant => 1.0,
            Schedule::Cosine => {
                let rise = ((done + 1.0) / WARM_UP as f64).min(1.0);
                rise * 0.5 * (1.0 + (std::f64::consts::PI * (done / all).min(1.0)).cos())
            }
        };
        self.plan.learning_rate * fraction
    }

    /// A chunk's share of the loss and of its gradient with respect to the parameters.
    fn gradient(&self, chunk: &Chunk, batch: usize, rows: [usize; 2]) -> (Evaluated, Vec<f32>) {
        let device = &self.device;
        let network = Network::new(&self.weights, device);
        let graph = GraphTensors::new(&chunk.graphs, &chunk.nodes, &chunk.edges, self.has_scans, device);
        let (nodes, edges) = network.forward(&graph);
        let values = |x: &Tensor<2>| x.clone().into_data().iter::<f32>().collect::<Vec<_>>();
        let outputs = [values(&nodes), edges.as_ref().map_or_else(Vec::new, values)];
        let evaluated = self.objective.evaluate(self.samples, chunk, [&outputs[0], &outputs[1]], batch, rows);
        let against = |x: Tensor<2>, gradient: &[f32]| {
            let constant = Tensor::<2>::from_data(TensorData::new(gradient.to_vec(), x.dims()), device);
            (x * constant).sum()
        };
        let mut sum = against(nodes, &evaluated.nodes);
        if let Some(edges) = edges {
            sum = sum + against(edges, &evaluated.edges);
        }
        let gradients = network.gradients(&sum.backward());
        (evaluated, gradients)
    }
}

#[cfg(test)]
mod tests;
