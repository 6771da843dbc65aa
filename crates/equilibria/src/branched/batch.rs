//! Many branched queries at once.

use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::answer::{BranchedAnswer, Finisher};
use super::descent::{Descent, Job};
use super::query::{ARMS, BranchedError, BranchedQuery};
use super::star::{Junction, Star};
use super::start::{Begin, StarStarts, Stars};
use crate::batch::{Params, ParamsError};
use crate::descent::Until;
use crate::level::Finer;
use crate::scaled::Cut;

/// Queries that a thread takes at a time, at most and at least: lanes are idle at the end of a block.
const BLOCK: [usize; 2] = [16, 256];
/// Error of the turns at which a coarse level is left [rad].
const COARSE: f64 = 1e-2;
/// What is too far from rest at its end goes on to this part of the tolerance.
const NEARER: f64 = 1e-4;
/// Energies this close, over one of the size of B / L, and forces and places this close are the same equilibrium's.
const SAME: f64 = 1e-5;
const SAME_COARSE: f64 = 1e-2;
/// Energies this close to the lowest on a coarse level may be lower on a finer one.
const CLOSE: f64 = 0.03;

/// How branched queries are answered by default: 20 segments an arm and a coarse level of 7, else as [`Params::default`].
pub fn default_params() -> Params {
    Params { segments: 20, levels: vec![7], ..Params::default() }
}

/// The answer to each branched query, in their order: the same bits on any number of threads, whatever the other queries.
/// [`Params::segments`] and levels are those of each arm.
///
/// # Errors
/// If a parameter is not allowed. A query that cannot be answered has its own error.
pub fn solve(
    queries: &[BranchedQuery],
    params: &Params,
) -> Result<Vec<Result<BranchedAnswer, BranchedError>>, ParamsError> {
    solve_from(queries, params, &Stars::default())
}

/// The same from other starts.
///
/// # Errors
/// If a parameter is not allowed.
pub fn solve_from(
    queries: &[BranchedQuery],
    params: &Params,
    starts: &dyn StarStarts,
) -> Result<Vec<Result<BranchedAnswer, BranchedError>>, ParamsError> {
    params.validate()?;
    let size = match rayon::current_num_threads() {
        1 => BLOCK[1],
        threads => (queries.len() / (4 * threads)).clamp(BLOCK[0], BLOCK[1]),
    };
    let blocks: Vec<Vec<_>> = queries
        .par_chunks(size)
        .enumerate()
        .map_init(|| Worker::new(params, starts), |worker, (k, block)| worker.answers(block, k * size, params, starts))
        .collect();
    Ok(blocks.into_iter().flatten().collect())
}

/// A level of segments and its way up to the next one.
struct Level {
    descent: Descent,
    finer: Option<Finer>,
    jobs: Vec<Job>,
    turns: Vec<UnitQuaternion<f64>>,
}

/// Memory of a thread.
struct Worker {
    levels: Vec<Level>,
    stars: Vec<Star>,
    /// Indices of the valid queries in their block.
    places: Vec<usize>,
    begins: Vec<Begin>,
    order: Vec<usize>,
    finish: Finisher,
}

impl Worker {
    fn new(params: &Params, starts: &dyn StarStarts) -> Self {
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
        let begins = vec![Begin::default(); starts.count()];
        Self { levels, stars: Vec::new(), places: Vec::new(), begins, order: Vec::new(), finish: Finisher::new(&fine) }
    }

    fn answers(
        &mut self,
        block: &[BranchedQuery],
        first: usize,
        params: &Params,
        starts: &dyn StarStarts,
    ) -> Vec<Result<BranchedAnswer, BranchedError>> {
        let mut answers: Vec<Result<BranchedAnswer, BranchedError>> =
            block.iter().map(|query| query.validate().map(|()| BranchedAnswer::default())).collect();
        self.places.clear();
        self.stars.clear();
        for (k, answer) in answers.iter().enumerate() {
            if answer.is_ok() {
                self.places.push(k);
                self.stars.push(Star::new(&block[k]));
            }
        }
        let all: Vec<usize> = (0..self.stars.len()).collect();
        self.begin(0, &all, first, starts);
        for level in 0..self.levels.len() {
            self.descend(level, params, false);
            if level + 1 < self.levels.len() {
                self.go_up(level, params.branches);
            }
        }
        self.finish(block, &mut answers, params);
        // What was not found on the way of the lowest: all starts at once, on the arms' own segments.
        let left: Vec<usize> = all
            .into_iter()
            .filter(|&k| matches!(&answers[self.places[k]], Ok(own) if own.equilibria.is_empty()))
            .collect();
        if params.again && !left.is_empty() {
            let last = self.levels.len() - 1;
            self.begin(last, &left, first, &Stars::all());
            self.descend(last, params, true);
            self.finish(block, &mut answers, params);
        }
        for answer in &mut answers {
            if let Ok(BranchedAnswer { equilibria, solves, coarse_solves }) = answer
                && equilibria.is_empty()
            {
                *answer = Err(BranchedError::NotFound { solves: *solves + *coarse_solves });
            }
        }
        answers
    }

    /// Fills a level with all starts of these queries.
    fn begin(&mut self, level: usize, queries: &[usize], first: usize, starts: &dyn StarStarts) {
        let Level { descent, jobs, turns, .. } = &mut self.levels[level];
        let (cut, count) = (descent.cut, starts.count());
        let size = ARMS * cut.segments;
        self.begins.resize(count, Begin::default());
        jobs.clear();
        turns.clear();
        for &query in queries {
            self.begins.fill(Begin::default());
            let at = turns.len();
            turns.resize(at + count * size, UnitQuaternion::identity());
            let index = first + self.places[query];
            let own = starts.fill(index, &self.stars[query], &cut, &mut self.begins, &mut turns[at..]);
            turns.truncate(at + own * size);
            jobs.extend(self.begins[..own].iter().map(|begin| Job::new(query, begin.junction, begin.forces)));
        }
    }

    fn descend(&mut self, level: usize, params: &Params, careful: bool) {
        let is_last = level + 1 == self.levels.len();
        let tolerance = if is_last { params.tolerance } else { COARSE };
        let most = params.most_solves * if careful { 4 } else { 1 };
        let Level { descent, jobs, turns, .. } = &mut self.levels[level];
        descent.run(&self.stars, jobs, turns, Until { tolerance, most, careful });
    }

    /// Takes of each query the lowest equilibrium with those that are about as low, or all, to the next level.
    fn go_up(&mut self, level: usize, all: bool) {
        let (below, above) = self.levels.split_at_mut(level + 1);
        let (Level { descent, finer, jobs, turns }, next) = (&mut below[level], &mut above[0]);
        let Some(finer) = finer else { return };
        let (count, fine) = (descent.cut.segments, next.descent.cut.segments);
        next.jobs.clear();
        next.turns.clear();
        let order = &mut self.order;
        let mut begin = 0;
        while begin < jobs.len() {
            let query = jobs[begin].query;
            let end = begin + jobs[begin..].iter().take_while(|job| job.query == query).count();
            order.clear();
            order.extend((begin..end).filter(|&k| jobs[k].converged));
            order.sort_by(|&a, &b| jobs[a].energy.total_cmp(&jobs[b].energy));
            if order.is_empty() {
                // As good a start as any other.
                order.push(begin);
            }
            if let (false, Some(&lowest)) = (all, order.first()) {
                let lowest = jobs[lowest].energy;
                order.retain(|&k| jobs[k].energy <= lowest + CLOSE * lowest.abs().max(1.0));
            }
            order.dedup_by(|b, a| jobs[*b].is_as(&jobs[*a], SAME_COARSE));
            let solves = jobs[begin..end].iter().map(|job| job.solves + job.coarse_solves).sum::<u32>();
            for (rank, &k) in order.iter().enumerate() {
                let coarse_solves = if rank == 0 { solves } else { 0 };
                next.jobs.push(Job { coarse_solves, solves: 0, converged: false, ..jobs[k] });
                for arm in 0..ARMS {
                    let at = next.turns.len();
                    next.turns.resize(at + fine, UnitQuaternion::identity());
                    let own = self.stars[query].arm(arm, &jobs[k].junction);
                    let from = (k * ARMS + arm) * count;
                    finer.fill(&own, &turns[from..from + count], &mut next.turns[at..]);
                }
            }
            begin = end;
        }
    }

    /// Makes answers of the last level's jobs; those that are not as near to rest as they were said to be go on before.
    fn finish(
        &mut self,
        block: &[BranchedQuery],
        answers: &mut [Result<BranchedAnswer, BranchedError>],
        params: &Params,
    ) {
        let early = self.collect(block, answers, params);
        if early.is_empty() {
            return;
        }
        let Some(Level { descent, jobs, turns, .. }) = self.levels.last_mut() else { return };
        let size = ARMS * descent.cut.segments;
        *turns = early.iter().flat_map(|&k| turns[k * size..(k + 1) * size].to_vec()).collect();
        *jobs = early.iter().map(|&k| Job { coarse_solves: 0, solves: 0, converged: false, ..jobs[k] }).collect();
        let until = Until { tolerance: NEARER * params.tolerance, most: params.most_solves, careful: false };
        descent.run(&self.stars, jobs, turns, until);
        self.collect(block, answers, params);
        for answer in answers.iter_mut().flatten() {
            answer.equilibria.sort_by(|a, b| a.energy.total_cmp(&b.energy));
        }
    }

    /// Adds the last level's jobs to the answers. Returns those that are not near enough to rest.
    fn collect(
        &mut self,
        block: &[BranchedQuery],
        answers: &mut [Result<BranchedAnswer, BranchedError>],
        params: &Params,
    ) -> Vec<usize> {
        let mut early = Vec::new();
        let Self { levels, stars, places, finish, order, .. } = self;
        let Some(Level { descent, jobs, turns, .. }) = levels.last_mut() else { return early };
        let size = ARMS * descent.cut.segments;
        let mut begin = 0;
        while begin < jobs.len() {
            let query = jobs[begin].query;
            let end = begin + jobs[begin..].iter().take_while(|job| job.query == query).count();
            let place = places[query];
            if let Ok(answer) = &mut answers[place] {
                let sum = |solves: fn(&Job) -> u32| jobs[begin..end].iter().map(solves).sum::<u32>();
                answer.solves += sum(|job| job.solves);
                answer.coarse_solves += sum(|job| job.coarse_solves);
                order.clear();
                order.extend((begin..end).filter(|&k| jobs[k].converged));
                order.sort_by(|&a, &b| jobs[a].energy.total_cmp(&jobs[b].energy));
                order.dedup_by(|b, a| jobs[*b].is_as(&jobs[*a], SAME));
                if !params.branches {
                    order.truncate(1);
                }
                for &k in order.iter() {
                    let own = &turns[k * size..(k + 1) * size];
                    let found = finish.equilibrium(&block[place], &stars[query], &jobs[k], own);
                    if found.residual <= params.tolerance {
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

/// What is known of an equilibrium, as a start.
#[derive(Clone, Debug, Default)]
pub struct KnownStar {
    /// The junction, over L from the first grip, and the forces on the grips, over B / L^2.
    pub begin: Begin,
    /// Orientations of the segments, arm after arm.
    pub turns: Vec<UnitQuaternion<f64>>,
}

impl KnownStar {
    /// That of the lowest equilibrium; `None` where there is none.
    pub fn of(query: &BranchedQuery, answer: &BranchedAnswer) -> Option<Self> {
        answer.equilibria.first().map(|own| Self::at(query, own))
    }

    /// That of an equilibrium of the query.
    pub fn at(query: &BranchedQuery, own: &super::BranchedEquilibrium) -> Self {
        let [length, bending] = Star::new(query).units;
        let forces: [Vector3<f64>; ARMS] = [0, 1, 2].map(|k| own.arms[k].grips[0].force * (-length.powi(2) / bending));
        let position = (own.junction.position - query.grips[0].position) / length;
        let junction = Junction { position, ..own.junction };
        let turns = own.arms.iter().flat_map(|arm| arm.orientations.iter().copied()).collect();
        Self { begin: Begin { junction, forces }, turns }
    }
}
