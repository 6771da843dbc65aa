//! Newton's method, eight queries side by side: a lane that is done takes the next one.

use cosserat::internals::kernels::dispatch::vectorized;
use cosserat::internals::kernels::lane::Real;
use nalgebra::{UnitQuaternion, Vector3};

use crate::answer::Searches;
use crate::problem::{Solved, System, WIDTH, Wide};
use crate::scaled::{Cut, get, set};
use crate::sweep::{Chain, Found};

/// Largest turn of a segment in one step [rad]; of one segment against its neighbour half as much.
const LARGEST_TURN: f64 = 2.0;
/// By how much shorter careful steps are.
const CAREFUL: f64 = 4.0;
/// A step that asks for this many times as much is not taken; a shorter one is scaled down.
const FAR: f64 = 8.0;
/// The first shift that is tried where the signs are wrong; less than the least is none.
const FIRST: f64 = 100.0;
const LEAST: f64 = 1.0;
/// By what a shift grows from trial to trial, and the next step begins with less.
const GROWTH: f64 = 4.0;
const DOWN: f64 = 4.0;

/// A query and where its search begins; afterwards where it came to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Job<B> {
    /// Index of the query.
    pub(crate) query: usize,
    /// What is searched for beside the turns.
    pub(crate) begin: B,
    /// Energy but for a constant of the query.
    pub(crate) energy: f64,
    /// Linear solves on this level, and on the levels before.
    pub(crate) solves: u32,
    pub(crate) coarse_solves: u32,
    /// How the searches began and went that led here; of one that goes on from a coarser level the first has those of all.
    pub(crate) searches: Searches,
    pub(crate) converged: bool,
}

impl<B> Job<B> {
    pub(crate) fn new(query: usize, begin: B) -> Self {
        let searches = Searches { starts: 1, ..Searches::default() };
        Self { query, begin, energy: 0.0, solves: 0, coarse_solves: 0, searches, converged: false }
    }
}

/// Where turns are smaller than this although they are made stiffer, the search has come to an unstable equilibrium [rad].
const SETTLED: f64 = 1e-4;
/// Turn by which it is left [rad].
const PUSH: f64 = 1e-2;

/// When a search ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Until {
    /// Error of the turns that is left, as predicted [rad].
    pub(crate) tolerance: f64,
    /// Cap on the solves.
    pub(crate) most: u32,
    /// Whether steps are short.
    pub(crate) careful: bool,
}

/// What a lane remembers of its search.
#[derive(Clone, Copy, Debug, Default)]
struct Search {
    job: Option<usize>,
    shift: f64,
    last: f64,
    movement: f64,
    solves: u32,
    /// Solves with a tangent that is indefinite or made stiffer.
    regularised: u32,
    began_indefinite: bool,
    is_at_saddle: bool,
}

/// Memory of a descent of cables of one cut.
pub(crate) struct Descent<P: Solved> {
    pub(crate) cut: Cut,
    system: P::System,
}

impl<P: Solved> Descent<P> {
    pub(crate) fn new(cut: Cut) -> Self {
        Self { cut, system: P::System::new(&cut) }
    }

    /// Takes all jobs down to equilibria; `turns` has the orientations of each job's segments, cable after cable, one job after
    /// the other.
    pub(crate) fn run(
        &mut self,
        problems: &[P],
        jobs: &mut [Job<P::Begin>],
        turns: &mut [UnitQuaternion<f64>],
        until: Until,
    ) {
        let size = P::CABLES * self.cut.segments;
        let mut next = 0;
        let mut lanes = [Search::default(); WIDTH];
        loop {
            let mut busy = false;
            for (lane, search) in lanes.iter_mut().enumerate() {
                if search.job.is_none() && next < jobs.len() {
                    *search = Search { job: Some(next), movement: f64::INFINITY, ..Search::default() };
                    let (job, own) = (&jobs[next], &turns[next * size..(next + 1) * size]);
                    self.system.load(lane, &self.cut, &problems[job.query], &job.begin, own);
                    next += 1;
                }
                busy |= search.job.is_some();
            }
            if !busy {
                break;
            }
            let mut shifts = Wide::zero();
            for (lane, search) in lanes.iter().enumerate() {
                shifts.set_lane(lane, search.shift);
            }
            let system = &mut self.system;
            let found = vectorized(
                #[inline(always)]
                || system.solve(shifts),
            );
            let (mut shares, mut forces) = (Wide::zero(), Wide::zero());
            let mut done = [None; WIDTH];
            for (lane, search) in lanes.iter_mut().enumerate() {
                if search.job.is_none() {
                    continue;
                }
                let (share, force) = search.judge(&found, lane, until.careful);
                shares.set_lane(lane, share);
                forces.set_lane(lane, force);
                let converged = search.converged(until, share);
                if converged || search.solves >= until.most {
                    done[lane] = Some(converged);
                }
            }
            vectorized(
                #[inline(always)]
                || system.step(shares, forces),
            );
            for (lane, search) in lanes.iter_mut().enumerate() {
                if std::mem::take(&mut search.is_at_saddle) {
                    system.push(lane);
                }
                let Some(converged) = done[lane] else { continue };
                let Some(index) = search.job.take() else { continue };
                let job = &mut jobs[index];
                job.begin = system.store(lane, &mut turns[index * size..(index + 1) * size]);
                job.energy = found.energy.lane(lane);
                (job.solves, job.converged) = (job.solves + search.solves, converged);
                let is_start = job.searches.starts == 1 && job.coarse_solves == 0;
                job.searches.indefinite += u32::from(is_start && search.began_indefinite);
                job.searches.regularised += search.regularised;
            }
        }
    }
}

/// Turns the segments of a lane a little, in long waves.
pub(crate) fn push(chain: &mut Chain<Wide>, lane: usize) {
    let count = chain.turns.len() as f64;
    for (k, own) in chain.turns.iter_mut().enumerate() {
        let place = (k as f64 + 1.0) / count;
        let turn = Vector3::new((1.3 * place).sin(), (2.3 * place).sin(), (4.1 * place).sin()) * PUSH;
        let q = get(own, lane) * UnitQuaternion::from_scaled_axis(turn);
        set(own, lane, &q);
    }
}

impl Search {
    /// By how much of the step and of the force's change to go on.
    fn judge(&mut self, found: &Found<Wide>, lane: usize, careful: bool) -> (f64, f64) {
        self.solves += 1;
        let wrong = found.wrong.lane(lane);
        let (turn, bend) = (found.turn.lane(lane), found.bend.lane(lane));
        let size = turn.max(2.0 * bend) / LARGEST_TURN * if careful { CAREFUL } else { 1.0 };
        let is_first = self.solves == 1;
        self.began_indefinite |= is_first && wrong != 0.0;
        self.regularised += u32::from(wrong != 0.0 || self.shift > 0.0);
        let finite = found.energy.lane(lane).is_finite() && size.is_finite();
        if !finite || wrong != 0.0 || (size > FAR && !is_first) {
            self.shift = if self.shift < self.last { self.last } else { (GROWTH * self.shift).max(FIRST) };
            self.movement = f64::INFINITY;
            return (0.0, 0.0);
        }
        let share = 1.0 / size.max(1.0);
        self.movement = if self.shift == 0.0 && share == 1.0 { turn } else { f64::INFINITY };
        self.is_at_saddle = self.shift > 0.0 && turn < SETTLED;
        self.last = self.shift;
        self.shift = if self.shift / DOWN >= LEAST { self.shift / DOWN } else { 0.0 };
        (share, 1.0)
    }

    /// Whether the last step was so small that the next one would be below the tolerance.
    fn converged(&self, until: Until, share: f64) -> bool {
        share == 1.0 && self.movement * self.movement <= until.tolerance
    }
}
