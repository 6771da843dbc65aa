//! Starts for the equilibria of cables between two grips: time, solves, and how often they lead to the lowest equilibrium.

mod continuation;
mod starts;

use equilibria::known::{Known, Previous};
use equilibria::learned::Learned;
use equilibria::sample::Distribution;
use equilibria::start::{Curves, RandomCurves, Starts};
use equilibria::{Answer, Grip, Params, ParamsError, Query, QueryError, solve, solve_from};
use nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

use crate::precision::clock::thread_time;

pub use continuation::Continued;
pub use starts::{Neighbours, Slerp};

/// Queries that are timed together.
pub(crate) const CHUNK: usize = 250;
/// Random starts among which the lowest equilibrium is looked for, too.
pub(crate) const RANDOM: usize = 30;
/// Energies this close, over their size or B / L, are the same.
pub(crate) const SAME: f64 = 1e-6;
/// Seeds of the neighbours and of the random starts; queries have their own.
pub(crate) const NEIGHBOURS_SEED: u64 = 1 << 40;

/// A way to an equilibrium.
pub struct Way {
    /// Its name.
    pub name: String,
    /// Segments of its coarse levels.
    pub levels: Vec<usize>,
    /// Where it begins.
    pub starts: Box<dyn Starts>,
    /// What it is brought there by, and in how many steps.
    pub continued: Option<(Continued, usize)>,
}

impl Way {
    fn new(name: &str, levels: &[usize], starts: impl Starts + 'static) -> Self {
        Self { name: name.to_owned(), levels: levels.to_vec(), starts: Box::new(starts), continued: None }
    }
}

/// What a way came to.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measured {
    /// Time a query [us], and half of its 95 % interval over parts of the queries, each the best of its rounds.
    pub query_us: [f64; 2],
    /// Solves a query on the cable's own segments, and half of the mean's 95 % interval.
    pub solves: [f64; 2],
    /// Solves a query on coarse levels.
    pub coarse_solves: f64,
    /// Share of the queries without an equilibrium.
    pub failed: f64,
    /// Share of the queries with the lowest equilibrium that is known.
    pub lowest: f64,
}

/// All ways, with and without learning; neighbours among so many answers.
///
/// # Errors
/// If a parameter is not allowed.
pub fn ways(distribution: &Distribution, segments: usize, neighbours: u64) -> Result<Vec<Way>, ParamsError> {
    let curves = |hermite, sagging, both_twists| Curves { hermite, sagging, both_twists };
    let (plain, sag) = (curves(true, false, false), curves(false, true, false));
    let (twists, four) = (curves(false, true, true), Curves::all());
    let mut ways = vec![Way::new("slerp", &[], Slerp)];
    let mut add = |name: &str, levels: &[usize], own: Curves| ways.push(Way::new(name, levels, own));
    add("Hermite", &[], plain);
    add("Hermite with sag", &[], sag);
    add("Hermite with sag, both twists", &[], twists);
    for levels in [&[7][..], &[11], &[14], &[7, 14], &[7, 20], &[7, 12, 20]] {
        add("Hermite with sag", levels, sag);
        add("Hermite with sag, both twists", levels, twists);
        add("two curves, both twists", levels, four);
    }
    for (proposals, name) in [(1, "learned, one proposal"), (2, "learned, one or two proposals")] {
        for levels in [&[][..], &[11]] {
            let mut starts = Learned::default();
            starts.proposals = proposals;
            ways.push(Way::new(name, levels, starts));
        }
    }
    for (what, name) in [(Continued::Load, "load"), (Continued::Pose, "pose")] {
        for steps in [3, 6] {
            let name = format!("{name} continuation in {steps} steps");
            ways.push(Way { continued: Some((what, steps)), ..Way::new(&name, &[], sag) });
        }
    }
    let queries: Vec<Query> = (0..neighbours).map(|k| distribution.query(NEIGHBOURS_SEED, k)).collect();
    let answers = solve(&queries, &Params { segments, ..Params::default() })?;
    let known: Vec<(Query, Known)> = queries
        .into_iter()
        .zip(answers)
        .filter_map(|(query, answer)| Some((query, Known::of(&query, &answer.ok()?)?)))
        .collect();
    for (with_tree, how) in [(false, "one by one"), (true, "k-d tree")] {
        let name = format!("nearest of {}, {how}", known.len());
        ways.push(Way::new(&name, &[], Neighbours::new(&known, with_tree)));
    }
    Ok(ways)
}

type Answers = Vec<Result<Answer, QueryError>>;

/// Measures ways on queries, which take turns, `rounds` times each, on one thread. `go_on` is asked after each way's turn.
///
/// # Errors
/// If a parameter is not allowed.
pub fn measure(
    queries: &[Query],
    ways: &[Way],
    segments: usize,
    rounds: usize,
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Vec<Measured>>, ParamsError> {
    let mut all: Vec<(Vec<f64>, Answers)> = Vec::new();
    for round in 0..rounds {
        for (k, way) in ways.iter().enumerate() {
            let params = Params { segments, levels: way.levels.clone(), again: false, ..Params::default() };
            let (times, answers) = timed(queries, &params, way.starts.as_ref(), way.continued)?;
            if round == 0 {
                all.push((times, answers));
            } else {
                all[k].0.iter_mut().zip(times).for_each(|(best, own)| *best = best.min(own));
            }
            if !go_on() {
                return Ok(None);
            }
        }
    }
    let random = RandomCurves { count: RANDOM, seed: NEIGHBOURS_SEED };
    let params = Params { segments, branches: true, ..Params::default() };
    let random = solve_from(queries, &params, &random)?;
    let energy = |answer: &Result<Answer, QueryError>| {
        answer.as_ref().ok().and_then(|own| own.equilibria.first()).map_or(f64::INFINITY, |own| own.energy)
    };
    let lowest: Vec<f64> = (0..queries.len())
        .map(|k| all.iter().map(|(_, answers)| energy(&answers[k])).fold(energy(&random[k]), f64::min))
        .collect();
    let summed = all.iter().map(|(times, answers)| {
        summary(times, answers, |k, own| {
            energy(own) <= lowest[k] + SAME * lowest[k].abs().max(queries[k].cable.bending[0] / queries[k].cable.length)
        })
    });
    Ok(Some(summed.collect()))
}

/// Answers, and the time a query of each part of them.
fn timed(
    queries: &[Query],
    params: &Params,
    starts: &dyn Starts,
    continued: Option<(Continued, usize)>,
) -> Result<(Vec<f64>, Answers), ParamsError> {
    let (mut times, mut answers) = (Vec::new(), Vec::new());
    for (k, part) in queries.chunks(CHUNK).enumerate() {
        let starts = Later { first: k * CHUNK, starts };
        // The thread that answers is the one that is timed.
        let (own, seconds) = rayon::scope(|_| {
            let begin = now();
            let own = match continued {
                None => solve_from(part, params, &starts),
                Some(way) => continuation::solve(part, params, &starts, way),
            };
            (own, now() - begin)
        });
        answers.extend(own?);
        times.push(seconds / part.len() as f64);
    }
    Ok((times, answers))
}

/// Time for which this thread has run [s]; where the system does not tell it, time of day.
pub(crate) fn now() -> f64 {
    let otherwise = || std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default();
    thread_time().unwrap_or_else(otherwise).as_secs_f64()
}

/// Starts of queries of which the first is not the first of all.
struct Later<'a> {
    first: usize,
    starts: &'a dyn Starts,
}

impl Starts for Later<'_> {
    fn count(&self) -> usize {
        self.starts.count()
    }

    fn fill(
        &self,
        index: usize,
        query: &equilibria::Scaled,
        cut: &equilibria::Cut,
        turns: &mut [UnitQuaternion<f64>],
        forces: &mut [Vector3<f64>],
    ) -> usize {
        self.starts.fill(self.first + index, query, cut, turns, forces)
    }
}

/// Mean, and half of its 95 % interval.
pub(crate) fn mean(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let spread = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    [mean, 1.96 * (spread / count).sqrt()]
}

fn summary(
    times: &[f64],
    answers: &[Result<Answer, QueryError>],
    is_lowest: impl Fn(usize, &Result<Answer, QueryError>) -> bool,
) -> Measured {
    let count = answers.len() as f64;
    let found: Vec<&Answer> = answers.iter().flatten().collect();
    let solves: Vec<f64> = found.iter().map(|own| f64::from(own.solves)).collect();
    let lowest = answers.iter().enumerate().filter(|(k, own)| is_lowest(*k, own)).count();
    Measured {
        query_us: mean(times).map(|seconds| 1e6 * seconds),
        solves: mean(&solves),
        coarse_solves: found.iter().map(|own| f64::from(own.coarse_solves)).sum::<f64>() / found.len().max(1) as f64,
        failed: 1.0 - found.len() as f64 / count,
        lowest: lowest as f64 / count,
    }
}

/// Steps of a path of queries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathStep {
    /// By how much the second grip goes, over the length.
    pub distance: f64,
    /// By how much it turns [rad].
    pub angle: f64,
}

/// Measures the previous answer as a start on random paths of the second grip, beside the default starts on the coarse
/// level: `[previous, default]`, whose lowest is the lower of both.
///
/// # Errors
/// If a parameter is not allowed.
pub fn measure_paths(
    first: &[Query],
    step: PathStep,
    steps: usize,
    segments: usize,
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<[Measured; 2]>, ParamsError> {
    let params = Params { segments, ..Params::default() };
    let direct = Params { levels: Vec::new(), again: false, ..params.clone() };
    let mut queries = first.to_vec();
    let mut last: Vec<Known> = Vec::new();
    for (query, answer) in first.iter().zip(solve(first, &params)?) {
        last.push(answer.ok().and_then(|own| Known::of(query, &own)).unwrap_or_default());
    }
    // A path without a first answer is left out.
    let is_known: Vec<bool> = last.iter().map(|own| own.is_known()).collect();
    queries = kept(queries, &is_known);
    last = kept(last, &is_known);
    let mut times = [Vec::new(), Vec::new()];
    let mut all: [Answers; 2] = [Vec::new(), Vec::new()];
    let mut lengths = Vec::new();
    for k in 0..steps {
        queries = queries.iter().enumerate().map(|(path, query)| gone_on(query, step, path, k)).collect();
        let previous = timed(&queries, &direct, &Previous(last.clone()), None)?;
        let others = timed(&queries, &params, &Curves::all(), None)?;
        for ((query, known), answer) in queries.iter().zip(&mut last).zip(&previous.1) {
            if let Some(own) = answer.as_ref().ok().and_then(|own| Known::of(query, own)) {
                *known = own;
            }
        }
        lengths.extend(queries.iter().map(|query| query.cable.bending[0] / query.cable.length));
        for (which, (own, answers)) in [previous, others].into_iter().enumerate() {
            times[which].extend(own);
            all[which].extend(answers);
        }
        if !go_on() {
            return Ok(None);
        }
    }
    let energy = |which: usize, k: usize| {
        let own: Option<&Answer> = all[which][k].as_ref().ok();
        own.and_then(|own| own.equilibria.first()).map_or(f64::INFINITY, |own| own.energy)
    };
    let measured = [0, 1].map(|which| {
        summary(&times[which], &all[which], |k, _| {
            let lowest = energy(0, k).min(energy(1, k));
            energy(which, k) <= lowest + SAME * lowest.abs().max(lengths[k])
        })
    });
    Ok(Some(measured))
}

fn kept<T>(all: Vec<T>, keep: &[bool]) -> Vec<T> {
    all.into_iter().zip(keep).filter(|(_, keep)| **keep).map(|(own, _)| own).collect()
}

/// The next query of a path: the second grip goes and turns in random directions, and stays within .3 to .95 of the length.
fn gone_on(query: &Query, step: PathStep, path: usize, k: usize) -> Query {
    let mut rng = ChaCha8Rng::seed_from_u64(path as u64);
    rng.set_stream(k as u64);
    let mut direction = || {
        let mut unit = || rng.next_u32() as f64 / f64::from(u32::MAX);
        let (z, angle) = (2.0 * unit() - 1.0, std::f64::consts::TAU * unit());
        Vector3::new(angle.cos(), angle.sin(), 0.0) * (1.0 - z * z).max(0.0).sqrt() + Vector3::z() * z
    };
    let Some(end) = query.end else { return *query };
    let length = query.cable.length;
    let turn = UnitQuaternion::from_scaled_axis(direction() * step.angle);
    let mut position = end.position;
    for _ in 0..100 {
        position = end.position + direction() * (step.distance * length);
        if (0.3..=0.95).contains(&((position - query.start.position).norm() / length)) {
            break;
        }
    }
    Query { end: Some(Grip { position, orientation: turn * end.orientation }), ..*query }
}
