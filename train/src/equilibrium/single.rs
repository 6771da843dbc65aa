//! What the learned start of a cable between two grips is taught: random queries and the lowest equilibrium of each class of
//! twist.

use burn::tensor::{Tensor, activation};
use equilibria::canonical::{Canonical, INPUTS};
use equilibria::learned::{self, MODES, OUTPUTS};
use equilibria::network::Perceptron;
use equilibria::start::RandomCurves;
use equilibria::{Answer, Params, Problem, Query, Scaled, solve, solve_from};

use super::subject::{Make, Sample, Subject, summary};

/// Equal segments of the cables that are solved.
const SEGMENTS: usize = 40;
/// Random starts of a query, beside the four curves.
const RANDOM: usize = 8;
/// Error of the answers; it is far below that of a network.
const TOLERANCE: f64 = 1e-6;
/// Weight of the likelihood's cross entropy against the error of the turns.
const OF_CLASS: f32 = 0.1;
/// By how much faster modes weigh more: their share of the slope.
const SLOPE: f32 = 0.02;

/// A cable between two grips.
pub(crate) struct Single;

impl Subject for Single {
    type Sample = Sample<INPUTS, { OUTPUTS - 1 }>;
    const INPUTS: usize = INPUTS;
    const OUTPUTS: usize = OUTPUTS;

    /// Two samples a query.
    fn samples(seed: u64, first: u64, count: u64) -> anyhow::Result<Vec<Self::Sample>> {
        let distribution = learned::distribution();
        let queries: Vec<Query> = (first..first + count).map(|k| distribution.query(seed, k)).collect();
        let params = Params { segments: SEGMENTS, tolerance: TOLERANCE, branches: true, ..Params::default() };
        let curves = solve(&queries, &params)?;
        let random = solve_from(&queries, &params, &RandomCurves { count: RANDOM, seed: seed + first })?;
        let mut samples = Vec::with_capacity(2 * queries.len());
        for ((query, curves), random) in queries.iter().zip(curves).zip(random) {
            let found: Vec<Answer> = [curves, random].into_iter().flatten().collect();
            samples.extend(of_query(query, &found).into_iter().flatten());
        }
        Ok(samples)
    }

    fn inputs(sample: &Self::Sample) -> &[f32] {
        &sample.inputs
    }

    /// The root of its mean squared error of turns [rad], that of the force, and the cross entropy of the class.
    fn loss(x: Tensor<2>, chunk: &[&Self::Sample], tensor: Make<'_>) -> Tensor<2> {
        let rows = chunk.len();
        let sign = tensor(chunk.iter().map(|own| if own.lowest == 0 { -1.0 } else { 1.0 }).collect(), 1);
        // Quaternions turn by twice the angle; a sine's mean square is a half.
        let weight = |k: usize| 2.0 * (1.0 + SLOPE * ((k / 4 + 1) as f32).powi(2));
        let misses = Sample::misses(&x, chunk, tensor, (0..4 * MODES).map(weight).collect());
        let class = activation::softplus(x.slice([0..rows, OUTPUTS - 1..OUTPUTS]) * sign, 1.0);
        misses + class * OF_CLASS
    }

    fn validate(network: &Perceptron, samples: &[Self::Sample]) -> [f64; 4] {
        let (mut errors, mut right) = (Vec::new(), 0);
        for own in samples {
            let outputs: [f32; OUTPUTS] = network.evaluate(&[own.inputs])[0];
            right += usize::from((outputs[OUTPUTS - 1] > 0.0) == (own.lowest == 0));
            if let (Some(targets), 0) = (own.targets, own.lowest) {
                let off = outputs[..OUTPUTS - 4].iter().zip(targets).map(|(a, b)| f64::from(a - b).powi(2));
                errors.push((2.0 * off.sum::<f64>()).sqrt());
            }
        }
        summary(errors, right, samples.len())
    }
}

fn of_query(query: &Query, found: &[Answer]) -> Option<[Sample<INPUTS, { OUTPUTS - 1 }>; 2]> {
    let scaled = Scaled::new(query);
    let canonical = Canonical::new(&scaled);
    let all = found.iter().flat_map(|answer| &answer.equilibria).map(|own| {
        let (turns, force) = Scaled::known(query, own);
        let (class, targets) = learned::encode(&canonical, &scaled, &turns, force);
        (own.energy, class, targets)
    });
    Sample::of_query(all, |class| canonical.inputs(class))
}
