//! Many queries at once.

use std::ops::Range;

use nalgebra::UnitQuaternion;
use rayon::prelude::*;

use crate::answer::{Answer, Finish, Searches};
use crate::descent::{Descent, Job, Until};
use crate::level::Finer;
pub use crate::params::{FEWEST_SEGMENTS, MOST_SEGMENTS, Params, ParamsError};
use crate::problem::{Answers, Problem, Solved};
use crate::query::{Query, QueryError};
use crate::scaled::{Cut, Scaled};
use crate::start::{Curves, Starts};

/// Queries that a thread takes at a time, at most and at least: lanes are idle at the end of a block.
const BLOCK: [usize; 2] = [16, 256];
/// Error of the turns at which a coarse level is left [rad].
const COARSE: f64 = 1e-2;
/// What is too far from rest at its end goes on to this part of the tolerance.
const NEARER: f64 = 1e-4;
/// Energies this close, over one of the size of B / L, forces this close, over B / L^2 or their size, and places this close are the
/// same equilibrium's.
const SAME: f64 = 1e-5;
const SAME_COARSE: f64 = 1e-2;
/// Energies this close to the lowest on a coarse level may be lower on a finer one.
const CLOSE: f64 = 0.03;

/// The answer to each query, in their order: the same bits on any number of threads, whatever the other queries.
///
/// Each start of [`Curves`] is brought to rest on the coarse levels; the lowest goes on to the cable's own segments. Where that
/// finds no equilibrium, the others do, then searches without coarse levels.
///
/// # Errors
/// If a parameter is not allowed. A query that cannot be answered has its own error.
pub fn solve(queries: &[Query], params: &Params) -> Result<Vec<Result<Answer, QueryError>>, ParamsError> {
    solve_from(queries, params, &Curves::default())
}

/// The same from other starts.
///
/// # Errors
/// If a parameter is not allowed.
pub fn solve_from(
    queries: &[Query],
    params: &Params,
    starts: &dyn Starts,
) -> Result<Vec<Result<Answer, QueryError>>, ParamsError> {
    Scaled::solve_from(queries, params, starts)
}

/// The answer to each query of any problem.
pub(crate) fn answers<P: Solved>(
    queries: &[P::Query],
    params: &Params,
    starts: &dyn Starts<P>,
) -> Result<Answers<P>, ParamsError> {
    params.validate()?;
    let size = match rayon::current_num_threads() {
        1 => BLOCK[1],
        threads => (queries.len() / (4 * threads)).clamp(BLOCK[0], BLOCK[1]),
    };
    let blocks: Vec<Vec<_>> = queries
        .par_chunks(size)
        .enumerate()
        .map_init(|| Worker::new(params), |worker, (k, block)| worker.answers(block, k * size, params, starts))
        .collect();
    Ok(blocks.into_iter().flatten().collect())
}

/// A level of segments and its way up to the next one.
struct Level<P: Solved> {
    descent: Descent<P>,
    finer: Option<Finer>,
    jobs: Vec<Job<P::Begin>>,
    /// Orientations of each job's segments.
    turns: Vec<UnitQuaternion<f64>>,
}

impl<P: Solved> Level<P> {
    /// Segments of a job.
    fn size(&self) -> usize {
        P::CABLES * self.descent.cut.segments
    }
}

/// Memory of a thread.
struct Worker<P: Solved> {
    levels: Vec<Level<P>>,
    problems: Vec<P>,
    /// Indices of the valid queries in their block.
    places: Vec<usize>,
    begins: Vec<P::Begin>,
    /// Starts of each query.
    counts: Vec<usize>,
    order: Vec<usize>,
    finish: Finish,
}

impl<P: Solved> Worker<P> {
    fn new(params: &Params) -> Self {
        let fine = Cut::even(params.segments);
        let coarse = params.levels.iter().map(|&segments| Cut::between(segments, fine.lengths[0]));
        let cuts: Vec<Cut> = coarse.chain([fine]).collect();
        let level = |k: usize| Level {
            descent: Descent::new(cuts[k]),
            finer: cuts.get(k + 1).map(|next| Finer::new(&cuts[k], next)),
            jobs: Vec::new(),
            turns: Vec::new(),
        };
        let levels = (0..cuts.len()).map(level).collect();
        let none = Vec::new;
        Self {
            levels,
            problems: Vec::new(),
            places: none(),
            begins: Vec::new(),
            counts: none(),
            order: none(),
            finish: Finish::new(&fine),
        }
    }

    fn answers(&mut self, block: &[P::Query], first: usize, params: &Params, starts: &dyn Starts<P>) -> Answers<P> {
        self.places.clear();
        self.problems.clear();
        let mut answers: Answers<P> = Vec::with_capacity(block.len());
        for (k, query) in block.iter().enumerate() {
            let problem = P::new(query);
            answers.push(problem.map(|problem| {
                self.places.push(k);
                self.problems.push(problem);
                Answer::default()
            }));
        }
        let all: Vec<usize> = (0..self.problems.len()).collect();
        self.begin(0, &all, first, starts);
        for level in 0..self.levels.len() {
            self.descend(level, params, false);
            if level + 1 < self.levels.len() {
                self.go_up(level, params.branches);
            }
        }
        self.finish(block, &mut answers, params);
        // What was not found on the way of the lowest: all starts at once, on the cable's own segments.
        let left: Vec<usize> = all
            .into_iter()
            .filter(|&k| matches!(&answers[self.places[k]], Ok(own) if own.equilibria.is_empty()))
            .collect();
        if params.again && !left.is_empty() {
            let last = self.levels.len() - 1;
            self.begin(last, &left, first, &P::all_starts());
            self.descend(last, params, true);
            self.finish(block, &mut answers, params);
        }
        for answer in &mut answers {
            if let Ok(Answer { equilibria, solves, coarse_solves, .. }) = answer
                && equilibria.is_empty()
            {
                *answer = Err(P::not_found(*solves + *coarse_solves));
            }
        }
        answers
    }

    /// Fills a level with all starts of these queries.
    fn begin(&mut self, level: usize, queries: &[usize], first: usize, starts: &dyn Starts<P>) {
        let Self { levels, problems, places, begins, counts, .. } = self;
        let (size, count) = (levels[level].size(), starts.count());
        let Level { descent, jobs, turns, .. } = &mut levels[level];
        jobs.clear();
        turns.clear();
        turns.resize(queries.len() * count * size, UnitQuaternion::identity());
        begins.clear();
        begins.resize(queries.len() * count, P::Begin::default());
        counts.clear();
        counts.resize(queries.len(), 0);
        let all: Vec<(usize, &P)> = queries.iter().map(|&query| (first + places[query], &problems[query])).collect();
        starts.fill_all(&all, &descent.cut, turns, begins, counts);
        let mut end = 0;
        for (k, (&query, &own)) in queries.iter().zip(&*counts).enumerate() {
            let at = k * count * size;
            turns.copy_within(at..at + own * size, end);
            end += own * size;
            jobs.extend(begins[k * count..][..own].iter().map(|&begin| Job::new(query, begin)));
        }
        turns.truncate(end);
    }

    fn descend(&mut self, level: usize, params: &Params, careful: bool) {
        let is_last = level + 1 == self.levels.len();
        let tolerance = if is_last { params.tolerance } else { COARSE };
        let most = params.most_solves * if careful { 4 } else { 1 };
        let Level { descent, jobs, turns, .. } = &mut self.levels[level];
        descent.run(&self.problems, jobs, turns, Until { tolerance, most, careful });
    }

    /// Takes of each query the lowest equilibrium with those that are about as low, or all, to the next level.
    fn go_up(&mut self, level: usize, all: bool) {
        let Self { levels, problems, order, .. } = self;
        let (below, above) = levels.split_at_mut(level + 1);
        let (Level { descent, finer, jobs, turns }, next) = (&mut below[level], &mut above[0]);
        let Some(finer) = finer else { return };
        let (count, fine) = (descent.cut.segments, next.descent.cut.segments);
        next.jobs.clear();
        next.turns.clear();
        let mut begin = 0;
        while begin < jobs.len() {
            let query = jobs[begin].query;
            let end = end_of_query(jobs, begin);
            order_by_energy(jobs, begin..end, order);
            if order.is_empty() {
                // As good a start as any other.
                order.push(begin);
            }
            if let (false, Some(&lowest)) = (all, order.first()) {
                let lowest = jobs[lowest].energy;
                order.retain(|&k| jobs[k].energy <= lowest + CLOSE * lowest.abs().max(1.0));
            }
            order.dedup_by(|b, a| are_same::<P>(&jobs[*b], &jobs[*a], SAME_COARSE));
            let solves = jobs[begin..end].iter().map(|job| job.solves + job.coarse_solves).sum::<u32>();
            let of_all = searches(&jobs[begin..end]);
            for (rank, &k) in order.iter().enumerate() {
                let (coarse_solves, searches) = if rank == 0 { (solves, of_all) } else { (0, Searches::default()) };
                next.jobs.push(Job { coarse_solves, searches, solves: 0, converged: false, ..jobs[k] });
                for cable in 0..P::CABLES {
                    let at = next.turns.len();
                    next.turns.resize(at + fine, UnitQuaternion::identity());
                    let from = (k * P::CABLES + cable) * count;
                    let own = problems[query].cable(cable, &jobs[k].begin);
                    finer.fill(&own, &turns[from..from + count], &mut next.turns[at..]);
                }
            }
            begin = end;
        }
    }

    /// Makes answers of the last level's jobs; those that are not as near to rest as they were said to be go on before.
    fn finish(&mut self, block: &[P::Query], answers: &mut Answers<P>, params: &Params) {
        let early = self.collect(block, answers, params);
        if early.is_empty() {
            return;
        }
        let Some(level) = self.levels.last_mut() else { return };
        let size = level.size();
        let Level { descent, jobs, turns, .. } = level;
        *turns = early.iter().flat_map(|&k| turns[k * size..(k + 1) * size].to_vec()).collect();
        let again =
            |k: usize| Job { coarse_solves: 0, solves: 0, searches: Searches::default(), converged: false, ..jobs[k] };
        *jobs = early.iter().map(|&k| again(k)).collect();
        let until = Until { tolerance: NEARER * params.tolerance, most: params.most_solves, careful: false };
        descent.run(&self.problems, jobs, turns, until);
        self.collect(block, answers, params);
        for answer in answers.iter_mut().flatten() {
            answer.equilibria.sort_by(|a, b| P::energy(a).total_cmp(&P::energy(b)));
        }
    }

    /// Adds the last level's jobs to the answers. Returns those that are not near enough to rest.
    fn collect(&mut self, block: &[P::Query], answers: &mut Answers<P>, params: &Params) -> Vec<usize> {
        let mut early = Vec::new();
        let Self { levels, problems, places, finish, order, .. } = self;
        let Some(level) = levels.last() else { return early };
        let (size, Level { jobs, turns, .. }) = (level.size(), level);
        let mut begin = 0;
        while begin < jobs.len() {
            let query = jobs[begin].query;
            let end = end_of_query(jobs, begin);
            let place = places[query];
            if let Ok(answer) = &mut answers[place] {
                let sum = |solves: fn(&Job<P::Begin>) -> u32| jobs[begin..end].iter().map(solves).sum::<u32>();
                answer.solves += sum(|job| job.solves);
                answer.coarse_solves += sum(|job| job.coarse_solves);
                answer.searches += searches(&jobs[begin..end]);
                order_by_energy(jobs, begin..end, order);
                order.dedup_by(|b, a| are_same::<P>(&jobs[*b], &jobs[*a], SAME));
                if !params.branches {
                    order.truncate(1);
                }
                for &k in order.iter() {
                    let own = &turns[k * size..(k + 1) * size];
                    let found = problems[query].equilibrium(finish, &block[place], &jobs[k].begin, own);
                    if P::residual(&found) <= params.tolerance {
                        answer.equilibria.push(found);
                    } else {
                        early.push(k);
                    }
                }
            }
            begin = end;
        }
        early
    }
}

/// How the searches of these jobs began and went.
fn searches<B>(jobs: &[Job<B>]) -> Searches {
    let mut all = Searches::default();
    jobs.iter().for_each(|job| all += job.searches);
    all
}

/// Where the jobs of the query end whose first job is `begin`.
fn end_of_query<B>(jobs: &[Job<B>], begin: usize) -> usize {
    begin + jobs[begin..].iter().take_while(|job| job.query == jobs[begin].query).count()
}

/// Those of these jobs that came to rest, the lowest first.
fn order_by_energy<B>(jobs: &[Job<B>], range: Range<usize>, order: &mut Vec<usize>) {
    order.clear();
    order.extend(range.filter(|&k| jobs[k].converged));
    order.sort_by(|&a, &b| jobs[a].energy.total_cmp(&jobs[b].energy));
}

/// Whether both came to the same equilibrium, but for errors of this size.
fn are_same<P: Solved>(a: &Job<P::Begin>, b: &Job<P::Begin>, error: f64) -> bool {
    (a.energy - b.energy).abs() <= error * a.energy.abs().max(1.0) && P::is_same(&a.begin, &b.begin, error)
}
