//! Newton's method, eight queries side by side: a lane that is done takes the next one.

use nalgebra::{UnitQuaternion, Vector3};
use solver::kernel::dispatch::vectorized;
use solver::kernel::lane::{Lanes, Real};

use crate::scaled::{Cut, Scaled, get, set};
use crate::sweep::{Chain, Found, Row};

/// Queries side by side.
pub(crate) const WIDTH: usize = 8;
pub(crate) type Wide = Lanes<WIDTH>;

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
#[derive(Clone, Debug)]
pub(crate) struct Job {
    /// Index of the query.
    pub(crate) query: usize,
    /// Force on the start's grip.
    pub(crate) force: Vector3<f64>,
    /// Energy but for a constant of the query.
    pub(crate) energy: f64,
    /// Linear solves on this level, and on the levels before.
    pub(crate) solves: u32,
    pub(crate) coarse_solves: u32,
    pub(crate) converged: bool,
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
pub(crate) struct Search {
    pub(crate) job: Option<usize>,
    pub(crate) shift: f64,
    pub(crate) last: f64,
    pub(crate) movement: f64,
    pub(crate) solves: u32,
    pub(crate) is_at_saddle: bool,
}

/// Memory of a descent of chains of one cut.
#[derive(Clone, Debug)]
pub(crate) struct Descent {
    pub(crate) cut: Cut,
    chain: Chain<Wide>,
    rows: Vec<Row<Wide>>,
}

impl Descent {
    pub(crate) fn new(cut: Cut) -> Self {
        Self { cut, chain: Chain::new(&cut), rows: vec![Row::zero(); cut.segments] }
    }

    /// Takes all jobs down to equilibria; `turns` has the orientations of each job's segments, one job after the other.
    pub(crate) fn run(
        &mut self,
        queries: &[Scaled],
        jobs: &mut [Job],
        turns: &mut [UnitQuaternion<f64>],
        until: Until,
    ) {
        let count = self.cut.segments;
        let mut next = 0;
        let mut lanes = [Search::default(); WIDTH];
        loop {
            let mut busy = false;
            for (lane, search) in lanes.iter_mut().enumerate() {
                if search.job.is_none() && next < jobs.len() {
                    *search = Search { job: Some(next), movement: f64::INFINITY, ..Search::default() };
                    let job = &jobs[next];
                    self.chain.load(lane, &self.cut, &queries[job.query]);
                    for (own, q) in self.chain.turns.iter_mut().zip(&turns[next * count..]) {
                        set(own, lane, q);
                    }
                    let query = &queries[job.query];
                    // A free end bears nothing, and so the first grip bears all.
                    let force = if query.held { job.force } else { Vector3::z() * -(query.weight + query.carried[0]) };
                    for k in 0..3 {
                        self.chain.force.0[k].set_lane(lane, force[k]);
                    }
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
            let Self { chain, rows, .. } = self;
            let found = vectorized(
                #[inline(always)]
                || chain.solve(rows, shifts),
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
                || chain.step(rows, shares, found.force, forces),
            );
            for (lane, search) in lanes.iter_mut().enumerate() {
                if std::mem::take(&mut search.is_at_saddle) {
                    push(&mut self.chain, lane);
                }
                let Some(converged) = done[lane] else { continue };
                let Some(index) = search.job.take() else { continue };
                let job = &mut jobs[index];
                for (own, q) in self.chain.turns.iter().zip(&mut turns[index * count..]) {
                    *q = get(own, lane);
                }
                job.force = Vector3::from_fn(|k, _| self.chain.force.0[k].lane(lane));
                job.energy = found.energy.lane(lane);
                (job.solves, job.converged) = (job.solves + search.solves, converged);
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
    pub(crate) fn judge(&mut self, found: &Found<Wide>, lane: usize, careful: bool) -> (f64, f64) {
        self.solves += 1;
        let wrong = found.wrong.lane(lane);
        let (turn, bend) = (found.turn.lane(lane), found.bend.lane(lane));
        let size = turn.max(2.0 * bend) / LARGEST_TURN * if careful { CAREFUL } else { 1.0 };
        let is_first = self.solves == 1;
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
    pub(crate) fn converged(&self, until: Until, share: f64) -> bool {
        share == 1.0 && self.movement * self.movement <= until.tolerance
    }
}
