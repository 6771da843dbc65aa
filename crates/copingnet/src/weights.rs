//! A network's parameters as plain numbers: what training, checkpoints and inference exchange.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::config::{NetworkConfig, Output, TensorSpec};

/// A network's parameters, one tensor after the other in the order of [`NetworkConfig::tensors`], each row by row.
///
/// Decays are stored as d with a = 1 / (1 + exp(-d)).
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    config: NetworkConfig,
    specs: Vec<TensorSpec>,
    values: Vec<f32>,
}

impl Weights {
    /// All zero.
    pub fn zeros(config: NetworkConfig) -> Self {
        let specs = config.tensors();
        let values = vec![0.0; specs.iter().map(TensorSpec::len).sum()];
        Self { config, specs, values }
    }

    /// Random ones, the same for a seed on every machine: weights and biases uniform in +/- 1 / sqrt(inputs), decays so
    /// that scans reach from 1 to 64 hops far. Linear outputs begin at zero.
    pub fn random(config: NetworkConfig, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
        let mut weights = Self::zeros(config);
        let last = config.mlp_layers.saturating_sub(1).to_string();
        let is_last = |name: &str| name.split('.').any(|part| part == last);
        let mut bound = 0.0;
        for (spec, values) in weights.tensors_mut() {
            if spec.name.ends_with("decay") {
                for (k, value) in values.iter_mut().enumerate() {
                    let reach = 64_f64.powf((k % config.scans) as f64 / (config.scans.max(2) - 1) as f64);
                    // a = exp(-1 / reach) = 1 / (1 + exp(-d)).
                    *value = -((1.0 / reach).exp() - 1.0).ln() as f32;
                }
                continue;
            }
            if config.output == Output::Linear && spec.name.starts_with("decoder.") && is_last(&spec.name) {
                continue;
            }
            if let [inputs, _] = spec.shape[..] {
                bound = 1.0 / (inputs as f64).sqrt();
            }
            values.iter_mut().for_each(|value| *value = (bound * uniform()) as f32);
        }
        weights
    }

    /// Sizes of the network.
    pub fn config(&self) -> &NetworkConfig {
        &self.config
    }

    /// All parameters.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// All parameters, to be changed.
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }

    /// The tensors with their values, in order.
    pub fn tensors(&self) -> impl Iterator<Item = (&TensorSpec, &[f32])> {
        let mut rest = self.values.as_slice();
        self.specs.iter().map(move |spec| {
            let (own, others) = rest.split_at(spec.len());
            rest = others;
            (spec, own)
        })
    }

    /// The tensors with their values, in order, to be changed.
    pub fn tensors_mut(&mut self) -> impl Iterator<Item = (&TensorSpec, &mut [f32])> {
        let mut rest = self.values.as_mut_slice();
        self.specs.iter().map(move |spec| {
            let (own, others) = std::mem::take(&mut rest).split_at_mut(spec.len());
            rest = others;
            (spec, own)
        })
    }
}
