//! What the learned start of equilibria is taught: random queries and the lowest equilibrium of each class of twist.

use equilibria::canonical::{Canonical, INPUTS};
use equilibria::learned::{self, OUTPUTS};
use equilibria::start::RandomCurves;
use equilibria::{Answer, Params, Query, Scaled, solve, solve_from};

/// Equal segments of the cables that are solved.
const SEGMENTS: usize = 40;
/// Random starts of a query, beside the four curves.
const RANDOM: usize = 8;
/// Error of the answers; it is far below that of a network.
const TOLERANCE: f64 = 1e-6;

/// A query in one class of twist.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    pub(crate) inputs: [f32; INPUTS],
    /// What the network should say but for the likelihood; `None` where no equilibrium of this class was found.
    pub(crate) targets: Option<[f32; OUTPUTS - 1]>,
    /// Whether the lowest equilibrium of all is in this class.
    pub(crate) is_lowest: bool,
}

/// Samples of queries `first..first + count` of a seed, two a query, those without an answer left out.
pub(crate) fn samples(seed: u64, first: u64, count: u64) -> anyhow::Result<Vec<Sample>> {
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
