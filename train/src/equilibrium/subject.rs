//! What a start is learned of: one cable, or one with three arms.

use burn::tensor::Tensor;
use equilibria::network::Perceptron;

/// Makes a tensor `[rows, columns]` of its values and the number of columns.
pub(crate) type Make<'a> = &'a dyn Fn(Vec<f32>, usize) -> Tensor<2>;

/// A kind of cables, with what its network is taught.
pub(crate) trait Subject {
    /// A query in one class of twist.
    type Sample: Send + Sync;
    /// Numbers that the network reads.
    const INPUTS: usize;
    /// Numbers that it says.
    const OUTPUTS: usize;

    /// Samples of queries `first..first + count` of a seed, those without an answer left out.
    ///
    /// # Errors
    /// If a parameter of the solver is not allowed.
    fn samples(seed: u64, first: u64, count: u64) -> anyhow::Result<Vec<Self::Sample>>;

    /// What the network reads of a sample.
    fn inputs(sample: &Self::Sample) -> &[f32];

    /// Loss of each sample [samples, 1], from the network's outputs [samples, outputs].
    fn loss(outputs: Tensor<2>, samples: &[&Self::Sample], tensor: Make<'_>) -> Tensor<2>;

    /// Of the samples with the lowest equilibrium: the median and mean error of the turns [rad], how many are above 0.2 rad [%];
    /// and how often the class is the right one [%].
    fn validate(network: &Perceptron, samples: &[Self::Sample]) -> [f64; 4];
}

/// Median, mean, percentage above 0.2 of errors, and the percentage of right classes.
pub(crate) fn summary(mut errors: Vec<f64>, right: usize, samples: usize) -> [f64; 4] {
    errors.sort_by(f64::total_cmp);
    let count = errors.len().max(1) as f64;
    let far = errors.iter().filter(|&&own| own > 0.2).count() as f64;
    let median = errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN);
    let percent = 100.0 * right as f64 / samples.max(1) as f64;
    [median, errors.iter().sum::<f64>() / count, 100.0 * far / count, percent]
}
