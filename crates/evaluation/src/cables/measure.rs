//! Measures ways to equilibria, of cables of any kind: they take turns on the same queries.

use equilibria::start::Starts;
use equilibria::{Answer, Answers, Cut, Params, ParamsError, Problem, Scaled, Searches};
use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

use crate::clock::thread_time;

/// Queries that are timed together.
const CHUNK: usize = 250;
/// Random starts among which the lowest equilibrium is looked for, too.
pub(crate) const RANDOM: usize = 30;
/// Energies this close, over their size or B / L, are the same.
const SAME: f64 = 1e-6;

/// Answers queries of which the first has this place among all.
type Solve<P> = dyn Fn(usize, &[<P as Problem>::Query], &Params) -> Result<Answers<P>, ParamsError> + Sync;

/// A way to an equilibrium.
pub struct Way<P: Problem = Scaled> {
    /// Its name.
    pub name: String,
    /// Segments of its coarse levels.
    pub levels: Vec<usize>,
    solve: Box<Solve<P>>,
}

impl<P: Problem + 'static> Way<P> {
    /// The way from these starts.
    pub fn new(name: impl Into<String>, levels: &[usize], starts: impl Starts<P> + 'static) -> Self {
        Self::by(name, levels, move |first, queries, params| solve_later(first, queries, params, &starts))
    }

    /// One that is gone by a function of the place of the first query, the queries and the parameters.
    pub(super) fn by(
        name: impl Into<String>,
        levels: &[usize],
        solve: impl Fn(usize, &[P::Query], &Params) -> Result<Answers<P>, ParamsError> + Sync + 'static,
    ) -> Self {
        Self { name: name.into(), levels: levels.to_vec(), solve: Box::new(solve) }
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
    /// Share of the starts at which the tangent is indefinite.
    pub indefinite: f64,
    /// Solves a query, on all levels, with a tangent that is indefinite or made stiffer.
    pub regularised: f64,
    /// Share of the queries without an equilibrium.
    pub failed: f64,
    /// Share of the queries with the lowest equilibrium that is known.
    pub lowest: f64,
}

/// Of a way: times of the parts; of each query the solves, if it was answered, how its searches went, and the energy.
pub(super) struct Seen {
    pub(super) times: Vec<f64>,
    pub(super) solves: Vec<Option<[u32; 2]>>,
    pub(super) searches: Searches,
    pub(super) energies: Vec<f64>,
}

impl Seen {
    /// Of answers.
    pub(super) fn new<P: Problem>(times: Vec<f64>, answers: &Answers<P>) -> Self {
        let solves = answers.iter().map(|own| own.as_ref().ok().map(|own| [own.solves, own.coarse_solves])).collect();
        let mut searches = Searches::default();
        answers.iter().flatten().for_each(|own| searches += own.searches);
        Self { times, solves, searches, energies: answers.iter().map(energy::<P>).collect() }
    }

    /// How often the energies are these, with units of energy.
    pub(super) fn measured(&self, lowest: &[f64], units: &[f64]) -> Measured {
        let count = self.energies.len() as f64;
        let found: Vec<[f64; 2]> = self.solves.iter().flatten().map(|own| own.map(f64::from)).collect();
        let fine: Vec<f64> = found.iter().map(|own| own[0]).collect();
        let is_lowest = |k: &usize| self.energies[*k] <= lowest[*k] + SAME * lowest[*k].abs().max(units[*k]);
        Measured {
            query_us: mean(&self.times).map(|seconds| 1e6 * seconds),
            solves: mean(&fine),
            coarse_solves: found.iter().map(|own| own[1]).sum::<f64>() / found.len().max(1) as f64,
            indefinite: f64::from(self.searches.indefinite) / f64::from(self.searches.starts.max(1)),
            regularised: f64::from(self.searches.regularised) / found.len().max(1) as f64,
            failed: 1.0 - found.len() as f64 / count,
            lowest: (0..self.energies.len()).filter(is_lowest).count() as f64 / count,
        }
    }
}

/// Measures ways on queries, which take turns, `rounds` times each, on one thread. `go_on` is asked after each way's turn. The
/// lowest is the lowest of all ways and of `random` starts, each on the cables' own segments, to 1e-6 of its energy or of B / L.
/// Of `params` each way has its own levels.
///
/// # Errors
/// If a parameter is not allowed.
pub fn measure<P: Problem>(
    queries: &[P::Query],
    ways: &[Way<P>],
    params: &Params,
    random: &dyn Starts<P>,
    rounds: usize,
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Vec<Measured>>, ParamsError> {
    let mut all: Vec<Seen> = Vec::new();
    for round in 0..rounds {
        for (k, way) in ways.iter().enumerate() {
            let params = Params { levels: way.levels.clone(), again: false, ..params.clone() };
            let (times, answers) = timed::<P>(queries, |first, part| (way.solve)(first, part, &params))?;
            if round == 0 {
                all.push(Seen::new::<P>(times, &answers));
            } else {
                all[k].times.iter_mut().zip(times).for_each(|(best, own)| *best = best.min(own));
            }
            if !go_on() {
                return Ok(None);
            }
        }
    }
    let random = P::solve_from(queries, &Params { branches: true, ..params.clone() }, random)?;
    let of_query = |k: usize| all.iter().map(|own| own.energies[k]).fold(energy::<P>(&random[k]), f64::min);
    let lowest: Vec<f64> = (0..queries.len()).map(of_query).collect();
    let units: Vec<f64> = queries.iter().map(P::unit).collect();
    Ok(Some(all.iter().map(|own| own.measured(&lowest, &units)).collect()))
}

/// Energy of the lowest equilibrium of an answer [J]; infinite where there is none.
fn energy<P: Problem>(answer: &Result<Answer<P::Equilibrium>, P::Error>) -> f64 {
    answer.as_ref().ok().and_then(|own| own.equilibria.first()).map_or(f64::INFINITY, P::energy)
}

/// Answers, and the time a query of each part of them [s].
pub(super) fn timed<P: Problem>(
    queries: &[P::Query],
    solve: impl Fn(usize, &[P::Query]) -> Result<Answers<P>, ParamsError> + Sync,
) -> Result<(Vec<f64>, Answers<P>), ParamsError> {
    let (mut times, mut answers) = (Vec::new(), Vec::new());
    for (k, part) in queries.chunks(CHUNK).enumerate() {
        // The thread that answers is the one that is timed.
        let (own, seconds) = rayon::scope(|_| {
            let begin = now();
            let own = solve(k * CHUNK, part);
            (own, now() - begin)
        });
        answers.extend(own?);
        times.push(seconds / part.len() as f64);
    }
    Ok((times, answers))
}

/// Time for which this thread has run [s]; where the system does not tell it, time of day.
fn now() -> f64 {
    let otherwise = || std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default();
    thread_time().unwrap_or_else(otherwise).as_secs_f64()
}

/// Mean, and half of its 95 % interval.
fn mean(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let spread = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    [mean, 1.96 * (spread / count).sqrt()]
}

/// The answers to queries of which the first is not the first of all.
pub(super) fn solve_later<P: Problem>(
    first: usize,
    queries: &[P::Query],
    params: &Params,
    starts: &dyn Starts<P>,
) -> Result<Answers<P>, ParamsError> {
    P::solve_from(queries, params, &Later { first, starts })
}

/// Starts of queries of which the first is not the first of all.
struct Later<'a, P: Problem> {
    first: usize,
    starts: &'a dyn Starts<P>,
}

impl<P: Problem> Starts<P> for Later<'_, P> {
    fn count(&self) -> usize {
        self.starts.count()
    }

    fn fill(
        &self,
        index: usize,
        query: &P,
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        begins: &mut [P::Begin],
    ) -> usize {
        self.starts.fill(self.first + index, query, cut, turns, begins)
    }

    fn fill_all(
        &self,
        queries: &[(usize, &P)],
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        begins: &mut [P::Begin],
        counts: &mut [usize],
    ) {
        let queries: Vec<_> = queries.iter().map(|&(index, query)| (self.first + index, query)).collect();
        self.starts.fill_all(&queries, cut, turns, begins, counts);
    }
}
