//! A network's parameters as plain numbers: what training, checkpoints and inference exchange.

use crate::config::{NetworkConfig, TensorSpec};

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
