//! What the learned start of a cable with three arms is taught: random queries and the lowest equilibrium of each of four classes
//! of twist.

use burn::tensor::{Tensor, activation};
use equilibria::Params;
use equilibria::branched::canonical::{INPUTS, StarCanonical};
use equilibria::branched::learned::{self, FORCES, JUNCTION, LIKELY, MODES, OUTPUTS};
use equilibria::branched::sample::BranchedDistribution;
use equilibria::branched::start::{CLASSES, Pose, RandomStars, Shape, Site, Stars};
use equilibria::branched::{ARMS, BranchedAnswer, BranchedQuery, Star, default_params, solve_from};
use equilibria::network::Perceptron;

use super::subject::{Make, Sample, Subject, summary};

/// Equal segments of each arm that is solved.
const SEGMENTS: usize = 16;
/// Random starts of a query, beside the eight in which turns go evenly.
const RANDOM: usize = 8;
/// Error of the answers; it is far below that of a network.
const TOLERANCE: f64 = 1e-6;
/// Weight of the likelihoods' cross entropy against the error of the turns and the junction's place.
const OF_CLASS: f32 = 0.2;
/// Weight of the place's error [1/L].
const OF_PLACE: f32 = 4.0;
/// By how much faster modes weigh more: their share of the slope.
const SLOPE: f32 = 0.02;

/// A cable with three arms.
pub(crate) struct Branched;

impl Subject for Branched {
    type Sample = Sample<INPUTS, LIKELY>;
    const INPUTS: usize = INPUTS;
    const OUTPUTS: usize = OUTPUTS;

    /// Four samples a query.
    fn samples(seed: u64, first: u64, count: u64) -> anyhow::Result<Vec<Self::Sample>> {
        let distribution = BranchedDistribution::default();
        let queries: Vec<BranchedQuery> = (first..first + count).map(|k| distribution.query(seed, k)).collect();
        let params = Params { segments: SEGMENTS, tolerance: TOLERANCE, branches: true, ..default_params() };
        let stars = Stars {
            sites: vec![Site::Middle],
            poses: vec![Pose::Mean, Pose::Triangle],
            shapes: vec![Shape::Even],
            classes: CLASSES,
        };
        let even = solve_from(&queries, &params, &stars)?;
        let random = solve_from(&queries, &params, &RandomStars { count: RANDOM, seed: seed + first })?;
        let mut samples = Vec::with_capacity(CLASSES * queries.len());
        for ((query, even), random) in queries.iter().zip(even).zip(random) {
            let found: Vec<BranchedAnswer> = [even, random].into_iter().flatten().collect();
            samples.extend(of_query(query, &found).into_iter().flatten());
        }
        Ok(samples)
    }

    fn inputs(sample: &Self::Sample) -> &[f32] {
        &sample.inputs
    }

    /// The root of its mean squared error of turns [rad] and of the junction's place, that of the forces, and the cross entropy of
    /// the class.
    fn loss(x: Tensor<2>, chunk: &[&Self::Sample], tensor: Make<'_>) -> Tensor<2> {
        let rows = chunk.len();
        let is_lowest = |own: &&Self::Sample| (0..CLASSES).map(move |class| class == own.lowest).collect::<Vec<_>>();
        let lowest = chunk.iter().flat_map(is_lowest).map(|is| f32::from(u8::from(is))).collect();
        let misses = Sample::misses(&x, chunk, tensor, (0..FORCES).map(weight).collect());
        let logs = activation::log_softmax(x.slice([0..rows, LIKELY..OUTPUTS]), 1);
        misses - (logs * tensor(lowest, CLASSES)).sum_dim(1) * OF_CLASS
    }

    fn validate(network: &Perceptron, samples: &[Self::Sample]) -> [f64; 4] {
        let (mut errors, mut right) = (Vec::new(), 0);
        for own in samples {
            let outputs: [f32; OUTPUTS] = network.evaluate(&[own.inputs])[0];
            let likely = learned::likelihoods(&outputs);
            right += usize::from((0..CLASSES).all(|k| likely[k] <= likely[own.lowest]));
            if let (Some(targets), 0) = (own.targets, own.lowest) {
                let off = outputs[..FORCES].iter().zip(targets).enumerate();
                let square = |(k, (a, b)): (usize, (&f32, f32))| f64::from(weight(k) * (a - b) * (a - b));
                let is_turn = |k: usize| !(JUNCTION..JUNCTION + 3).contains(&k);
                errors.push(off.filter(|(k, _)| is_turn(*k)).map(square).sum::<f64>().sqrt());
            }
        }
        summary(errors, right, samples.len())
    }
}

/// Weights of squared errors, so that their sum is about the mean square of turns [rad^2]: quaternions turn by twice the angle, a
/// sine's mean square is a half, and that of what goes evenly to the junction's turn a third.
fn weight(output: usize) -> f32 {
    if output < JUNCTION {
        let mode = output % (4 * MODES) / 4 + 1;
        2.0 / ARMS as f32 * (1.0 + SLOPE * (mode as f32).powi(2))
    } else if output < JUNCTION + 3 {
        OF_PLACE
    } else {
        4.0 / 3.0
    }
}

fn of_query(query: &BranchedQuery, found: &[BranchedAnswer]) -> Option<[Sample<INPUTS, LIKELY>; CLASSES]> {
    let star = Star::new(query);
    let canonical = StarCanonical::new(&star);
    let all = found.iter().flat_map(|answer| &answer.equilibria).map(|own| {
        let (class, targets) = learned::encode(&canonical, &star, query, own);
        (own.energy, class, targets)
    });
    Sample::of_query(all, |class| canonical.inputs(class))
}
