//! What a start is learned of: one cable, or one with three arms; and what both have in common.

use burn::tensor::Tensor;
use equilibria::network::Perceptron;

/// Makes a tensor `[rows, columns]` of its values and the number of columns.
pub(crate) type Make<'a> = &'a dyn Fn(Vec<f32>, usize) -> Tensor<2>;

/// Weight of the forces' error against that of the turns.
const OF_FORCE: f32 = 0.1;
/// Error below which the root is a square [rad].
const SMALL: f32 = 0.02;

/// A query in one class of twist.
#[derive(Clone, Debug)]
pub(crate) struct Sample<const INPUTS: usize, const TARGETS: usize> {
    pub(crate) inputs: [f32; INPUTS],
    /// What the network should say but for the likelihoods, the forces last; `None` where no equilibrium of this class was found.
    pub(crate) targets: Option<[f32; TARGETS]>,
    /// The class of the lowest equilibrium of all, counted from this one.
    pub(crate) lowest: usize,
}

impl<const INPUTS: usize, const TARGETS: usize> Sample<INPUTS, TARGETS> {
    /// Those of a query, a class each, from the energies, classes and targets of the equilibria that were found.
    pub(crate) fn of_query<const CLASSES: usize>(
        found: impl Iterator<Item = (f64, usize, [f32; TARGETS])>,
        inputs: impl Fn(usize) -> [f32; INPUTS],
    ) -> Option<[Self; CLASSES]> {
        let mut lowest = [None; CLASSES];
        for (energy, class, targets) in found {
            if lowest[class].is_none_or(|(own, _)| energy < own) {
                lowest[class] = Some((energy, targets));
            }
        }
        let energy = lowest.map(|own| own.map_or(f64::INFINITY, |(energy, _)| energy));
        let best = (0..CLASSES).min_by(|&a, &b| energy[a].total_cmp(&energy[b]))?;
        // Two signs changed are the third one changed: classes add up as bits do.
        energy[best].is_finite().then(|| {
            std::array::from_fn(|class| Self {
                inputs: inputs(class),
                targets: lowest[class].map(|(_, targets)| targets),
                lowest: class ^ best,
            })
        })
    }

    /// The roots of the weighted squared errors of what the weights stand for, and of the forces after it, where an equilibrium is
    /// known [samples, 1].
    pub(crate) fn misses(x: &Tensor<2>, chunk: &[&Self], tensor: Make<'_>, weights: Vec<f32>) -> Tensor<2> {
        let (rows, count) = (chunk.len(), weights.len());
        let targets = tensor(chunk.iter().flat_map(|own| own.targets.unwrap_or([0.0; TARGETS])).collect(), TARGETS);
        let known = tensor(chunk.iter().map(|own| f32::from(u8::from(own.targets.is_some()))).collect(), 1);
        let off = x.clone().slice([0..rows, 0..TARGETS]) - targets;
        let shape = off.clone().slice([0..rows, 0..count]);
        let shape = ((shape.clone() * shape * tensor(weights, count)).sum_dim(1) + SMALL * SMALL).sqrt();
        let force = off.slice([0..rows, count..TARGETS]);
        let force = ((force.clone() * force).sum_dim(1) + SMALL * SMALL).sqrt();
        (shape + force * OF_FORCE) * known
    }
}

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
    // NaN where nothing was measured.
    let count = errors.len() as f64;
    let far = errors.iter().filter(|&&own| own > 0.2).count() as f64;
    let median = errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN);
    let percent = 100.0 * right as f64 / samples as f64;
    [median, errors.iter().sum::<f64>() / count, 100.0 * far / count, percent]
}
