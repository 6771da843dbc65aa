//! Starts for the equilibria of cables between two grips: time, solves, and how often they lead to the lowest equilibrium.

mod continuation;
mod measure;
mod starts;

use equilibria::known::{Known, Previous};
use equilibria::learned::Learned;
use equilibria::sample::Distribution;
use equilibria::start::{Curves, RandomCurves, Starts};
use equilibria::{Grip, Params, ParamsError, Problem, Query, Scaled, solve};
use nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use self::measure::{Seen, solve_later, timed};

pub use continuation::Continued;
pub use measure::{Measured, Way, measure};
pub use starts::{Neighbours, Slerp};

pub(crate) use measure::RANDOM;

/// Seeds of the neighbours and of the random starts; queries have their own.
pub(crate) const NEIGHBOURS_SEED: u64 = 1 << 40;

/// Name of the start of a network that was trained for seconds.
pub const LEARNED_QUICKLY: &str = "learned in seconds, one or two proposals";

/// The start of a network that was trained for seconds: `train equilibrium --queries 15000 --epochs 20 --width 128 --batch 128
/// --learning-rate 0.008 --threads 1`.
pub fn learned_quickly() -> Learned {
    static WEIGHTS: &[u8] = include_bytes!("../../../checkpoints/equilibrium-quick.safetensors");
    match Learned::from_bytes(WEIGHTS) {
        Ok(learned) => learned,
        Err(error) => unreachable!("{error}"),
    }
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
    let shipped = [(1, "learned, one proposal"), (2, "learned, one or two proposals")].map(|(proposals, name)| {
        let mut starts = Learned::default();
        starts.proposals = proposals;
        (name, starts)
    });
    for (name, starts) in shipped.into_iter().chain([(LEARNED_QUICKLY, learned_quickly())]) {
        for levels in [&[][..], &[11]] {
            ways.push(Way::new(name, levels, starts.clone()));
        }
    }
    for (what, name) in [(Continued::Load, "load"), (Continued::Pose, "pose")] {
        for steps in [3, 6] {
            let name = format!("{name} continuation in {steps} steps");
            ways.push(Way::by(name, &[], move |_, queries: &[Query], params: &Params| {
                continuation::solve(queries, params, &sag, (what, steps))
            }));
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
        ways.push(Way::new(name, &[], Neighbours::new(&known, with_tree)));
    }
    Ok(ways)
}

/// The random starts among which the lowest equilibrium is looked for, too.
pub fn random() -> RandomCurves {
    RandomCurves { count: RANDOM, seed: NEIGHBOURS_SEED }
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
    let (mut times, mut all) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    let mut units = Vec::new();
    for k in 0..steps {
        queries = queries.iter().enumerate().map(|(path, query)| gone_on(query, step, path, k)).collect();
        let from = |params: &Params, starts: &dyn Starts| {
            timed::<Scaled>(&queries, |first, part| solve_later(first, part, params, starts))
        };
        let [previous, others] = [from(&direct, &Previous(last.clone()))?, from(&params, &Curves::all())?];
        for ((query, known), answer) in queries.iter().zip(&mut last).zip(&previous.1) {
            if let Some(own) = answer.as_ref().ok().and_then(|own| Known::of(query, own)) {
                *known = own;
            }
        }
        units.extend(queries.iter().map(Scaled::unit));
        for (which, (own, answers)) in [previous, others].into_iter().enumerate() {
            times[which].extend(own);
            all[which].extend(answers);
        }
        if !go_on() {
            return Ok(None);
        }
    }
    let ([own, other], [previous, others]) = (times, all);
    let [previous, others] = [Seen::new::<Scaled>(own, &previous), Seen::new::<Scaled>(other, &others)];
    let lowest: Vec<f64> = previous.energies.iter().zip(&others.energies).map(|(a, b)| a.min(*b)).collect();
    Ok(Some([previous, others].map(|own| own.measured(&lowest, &units))))
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
