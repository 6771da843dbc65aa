//! What the learned start of a cable with three arms is taught: random queries and the lowest equilibrium of each of four classes
//! of twist.

use std::f64::consts::TAU;

use burn::tensor::{Tensor, activation};
use equilibria::Params;
use equilibria::branched::canonical::{CABLES, FRAMES, GRAVITY, INPUTS, StarCanonical};
use equilibria::branched::learned::{self, FORCES, JUNCTION, LIKELY, MODES, OUTPUTS};
use equilibria::branched::sample::BranchedDistribution;
use equilibria::branched::start::{CLASSES, Pose, RandomStars, Shape, Site, Stars};
use equilibria::branched::{ARMS, BranchedAnswer, BranchedQuery, Star, default_params, solve_from};
use equilibria::network::Perceptron;

use super::graph::{Graph, Rows};
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

    /// The arms are the nodes. Each reads what is known of it in its own frame, the canonical one turned by its direction's angle;
    /// the junction is the sum of what they say of it, turned back.
    fn graph() -> Option<Graph> {
        Some(Graph { inputs: (0..ARMS).map(read).collect(), outputs: (0..ARMS).map(said).collect() })
    }

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
        let (mut errors, mut right, mut outputs) = (Vec::new(), 0, [0.0; OUTPUTS]);
        for own in samples {
            network.evaluate(&own.inputs, &mut outputs);
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

/// Marks that `to` is the vector `from` of the other side, turned about z by the angle of an arm, or backwards.
fn turned(matrix: &mut Rows, arm: usize, [from, to]: [usize; 2], sign: f64) {
    let (sin, cos) = (sign * TAU * arm as f64 / ARMS as f64).sin_cos();
    for (row, column, value) in [(0, 0, cos), (0, 1, sin), (1, 0, -sin), (1, 1, cos)] {
        matrix[from + row][to + column] = value as f32;
    }
}

/// What an arm reads of the inputs: its grip's place and gravity in its own frame, its grip's frame, its cable.
fn read(arm: usize) -> Rows {
    let [place, frame, gravity, cable] = [2 * arm, FRAMES + 4 * arm, GRAVITY, CABLES + 4 * arm];
    let mut matrix = vec![vec![0.0; 13]; INPUTS];
    turned(&mut matrix, arm, [place, 0], -1.0);
    turned(&mut matrix, arm, [gravity, 2], -1.0);
    matrix[gravity + 2][4] = 1.0;
    for k in 0..4 {
        matrix[frame + k][5 + k] = 1.0;
        matrix[cable + k][9 + k] = 1.0;
    }
    matrix
}

/// What an arm says: its modes, its force, its shares of the junction's place and quaternion and of the class that was asked about,
/// and how likely its own sign is the other one.
fn said(arm: usize) -> Rows {
    let own = 4 * MODES;
    let [force, place, real, class] = [own, own + 3, own + 6, own + 10];
    let mut matrix = vec![vec![0.0; OUTPUTS]; own + 12];
    (0..own).for_each(|k| matrix[k][own * arm + k] = 1.0);
    for (from, to) in [(force, FORCES + 3 * arm), (place, JUNCTION), (real + 1, JUNCTION + 4)] {
        turned(&mut matrix, arm, [from, to], 1.0);
        matrix[from + 2][to + 2] = 1.0;
    }
    matrix[real][JUNCTION + 3] = 1.0;
    matrix[class][LIKELY] = 1.0;
    matrix[class + 1][LIKELY + 1 + arm] = 1.0;
    matrix
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
