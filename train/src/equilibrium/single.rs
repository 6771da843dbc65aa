//! What the learned start of a cable between two grips is taught: random queries and the lowest equilibrium of each class of
//! twist.

use burn::tensor::{Tensor, activation};
use equilibria::canonical::{Canonical, INPUTS};
use equilibria::learned::{self, MODES, OUTPUTS};
use equilibria::network::Perceptron;
use equilibria::start::RandomCurves;
use equilibria::{Answer, Params, Query, Scaled, solve, solve_from};

use super::subject::{Make, Subject, summary};

/// Equal segments of the cables that are solved.
const SEGMENTS: usize = 40;
/// Random starts of a query, beside the four curves.
const RANDOM: usize = 8;
/// Error of the answers; it is far below that of a network.
const TOLERANCE: f64 = 1e-6;
/// Weights of the force's error and of the likelihood's cross entropy against the error of the turns.
const OF_FORCE: f32 = 0.1;
const OF_CLASS: f32 = 0.1;
/// Error below which the root is a square [rad].
const SMALL: f32 = 0.02;
/// By how much faster modes weigh more: their share of the slope.
const SLOPE: f32 = 0.02;

/// A cable between two grips.
pub(crate) struct Single;

/// A query in one class of twist.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    inputs: [f32; INPUTS],
    /// What the network should say but for the likelihood; `None` where no equilibrium of this class was found.
    targets: Option<[f32; OUTPUTS - 1]>,
    /// Whether the lowest equilibrium of all is in this class.
    is_lowest: bool,
}

impl Subject for Single {
    type Sample = Sample;
    const INPUTS: usize = INPUTS;
    const OUTPUTS: usize = OUTPUTS;

    /// Two samples a query.
    fn samples(seed: u64, first: u64, count: u64) -> anyhow::Result<Vec<Sample>> {
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

    fn inputs(sample: &Sample) -> &[f32] {
        &sample.inputs
    }

    /// The root of its mean squared error of turns [rad], that of the force, and the cross entropy of the class.
    fn loss(x: Tensor<2>, chunk: &[&Sample], tensor: Make<'_>) -> Tensor<2> {
        let rows = chunk.len();
        let targets = chunk.iter().flat_map(|own| own.targets.unwrap_or([0.0; OUTPUTS - 1])).collect();
        let targets = tensor(targets, OUTPUTS - 1);
        let known = tensor(chunk.iter().map(|own| f32::from(u8::from(own.targets.is_some()))).collect(), 1);
        let sign = tensor(chunk.iter().map(|own| if own.is_lowest { -1.0 } else { 1.0 }).collect(), 1);
        // Quaternions turn by twice the angle; a sine's mean square is a half.
        let weight = |k: usize| 2.0 * (1.0 + SLOPE * ((k / 4 + 1) as f32).powi(2));
        let weights = tensor((0..4 * MODES).map(weight).collect(), 4 * MODES);
        let off = x.clone().slice([0..rows, 0..OUTPUTS - 1]) - targets;
        let turns = off.clone().slice([0..rows, 0..4 * MODES]);
        let turns = ((turns.clone() * turns * weights).sum_dim(1) + SMALL * SMALL).sqrt();
        let force = off.slice([0..rows, 4 * MODES..OUTPUTS - 1]);
        let force = ((force.clone() * force).sum_dim(1) + SMALL * SMALL).sqrt();
        let class = activation::softplus(x.slice([0..rows, OUTPUTS - 1..OUTPUTS]) * sign, 1.0);
        (turns + force * OF_FORCE) * known + class * OF_CLASS
    }

    fn validate(network: &Perceptron, samples: &[Sample]) -> [f64; 4] {
        let (mut errors, mut right, mut outputs) = (Vec::new(), 0, [0.0; OUTPUTS]);
        for own in samples {
            network.evaluate(&own.inputs, &mut outputs);
            right += usize::from((outputs[OUTPUTS - 1] > 0.0) == own.is_lowest);
            if let (Some(targets), true) = (own.targets, own.is_lowest) {
                let off = outputs[..OUTPUTS - 4].iter().zip(targets).map(|(a, b)| f64::from(a - b).powi(2));
                errors.push((2.0 * off.sum::<f64>()).sqrt());
            }
        }
        summary(errors, right, samples.len())
    }
}

fn of_query(query: &Query, found: &[Answer]) -> Option<[Sample; 2]> {
    let scaled = Scaled::new(query);
    let canonical = Canonical::new(&scaled);
    let unit = query.cable.bending[0].max(query.cable.bending[1]) / query.cable.length.powi(2);
    let mut lowest: [Option<(f64, [f32; OUTPUTS - 1])>; 2] = [None; 2];
    for own in found.iter().flat_map(|answer| &answer.equilibria) {
        let force = own.grips[0].force / -unit;
        let (class, targets) = learned::encode(&canonical, &scaled, &own.orientations, force);
        if lowest[class].is_none_or(|(energy, _)| own.energy < energy) {
            lowest[class] = Some((own.energy, targets));
        }
    }
    let energy = lowest.map(|own| own.map_or(f64::INFINITY, |(energy, _)| energy));
    energy.iter().any(|energy| energy.is_finite()).then(|| {
        [0, 1].map(|class| Sample {
            inputs: canonical.inputs(class),
            targets: lowest[class].map(|(_, targets)| targets),
            is_lowest: energy[class] < energy[1 - class],
        })
    })
}
