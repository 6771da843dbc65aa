//! Newton's method for cables with three arms, eight queries side by side, as [`crate::descent`] has it for one cable.

use nalgebra::{UnitQuaternion, Vector3};
use solver::kernel::dispatch::vectorized;
use solver::kernel::lane::Real;

use super::query::ARMS;
use super::star::{Junction, Star};
use super::sweep::Tree;
use crate::descent::{Search, Until, WIDTH, Wide, push};
use crate::scaled::{Cut, get, set};
use crate::sweep::Row;

/// A query and where its search begins; afterwards where it came to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Job {
    /// Index of the query.
    pub(crate) query: usize,
    pub(crate) junction: Junction,
    /// Forces on the grips.
    pub(crate) forces: [Vector3<f64>; ARMS],
    /// Energy but for a constant of the query.
    pub(crate) energy: f64,
    /// Linear solves on this level, and on the levels before.
    pub(crate) solves: u32,
    pub(crate) coarse_solves: u32,
    pub(crate) converged: bool,
}

impl Job {
    pub(crate) fn new(query: usize, junction: Junction, forces: [Vector3<f64>; ARMS]) -> Self {
        Self { query, junction, forces, energy: 0.0, solves: 0, coarse_solves: 0, converged: false }
    }

    /// Whether both are the same equilibrium, but for errors of this size.
    pub(crate) fn is_as(&self, other: &Self, error: f64) -> bool {
        (self.energy - other.energy).abs() <= error * self.energy.abs().max(1.0)
            && (self.junction.position - other.junction.position).norm() <= error
            && self.forces.iter().zip(&other.forces).all(|(a, b)| (a - b).norm() <= error * a.norm().max(1.0))
    }
}

/// Memory of a descent of trees of one cut.
#[derive(Clone, Debug)]
pub(crate) struct Descent {
    pub(crate) cut: Cut,
    tree: Tree<Wide>,
    rows: [Vec<Row<Wide>>; ARMS],
}

impl Descent {
    pub(crate) fn new(cut: Cut) -> Self {
        let rows = || vec![Row::zero(); cut.segments];
        Self { cut, tree: Tree::new(&cut), rows: [rows(), rows(), rows()] }
    }

    /// Takes all jobs down to equilibria; `turns` has the orientations of each job's segments, arm after arm, one job after the
    /// other.
    pub(crate) fn run(&mut self, stars: &[Star], jobs: &mut [Job], turns: &mut [UnitQuaternion<f64>], until: Until) {
        let size = ARMS * self.cut.segments;
        let mut next = 0;
        let mut lanes = [Search::default(); WIDTH];
        loop {
            let mut busy = false;
            for (lane, search) in lanes.iter_mut().enumerate() {
                if search.job.is_none() && next < jobs.len() {
                    *search = Search { job: Some(next), movement: f64::INFINITY, ..Search::default() };
                    self.load(lane, &stars[jobs[next].query], &jobs[next], &turns[next * size..(next + 1) * size]);
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
            let Self { tree, rows, .. } = self;
            let (found, change) = vectorized(
                #[inline(always)]
                || {
                    tree.join();
                    tree.solve(rows, shifts)
                },
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
                || tree.step(rows, shares, &change, forces),
            );
            for (lane, search) in lanes.iter_mut().enumerate() {
                if std::mem::take(&mut search.is_at_saddle) {
                    tree.arms.iter_mut().for_each(|arm| push(arm, lane));
                }
                let Some(converged) = done[lane] else { continue };
                let Some(index) = search.job.take() else { continue };
                let job = &mut jobs[index];
                let own = tree.arms.iter().flat_map(|arm| &arm.turns);
                for (q, own) in turns[index * size..].iter_mut().zip(own) {
                    *q = get(own, lane);
                }
                job.junction = tree.junction(lane);
                job.forces = [0, 1, 2].map(|k| tree.arms[k].force.0.map(|x| x.lane(lane)).into());
                job.energy = found.energy.lane(lane);
                (job.solves, job.converged) = (job.solves + search.solves, converged);
            }
        }
    }

    fn load(&mut self, lane: usize, star: &Star, job: &Job, turns: &[UnitQuaternion<f64>]) {
        self.tree.load(lane, &self.cut, star);
        self.tree.set_junction(lane, &job.junction);
        for (arm, (own, force)) in self.tree.arms.iter_mut().zip(turns.chunks(self.cut.segments).zip(&job.forces)) {
            for (to, q) in arm.turns.iter_mut().zip(own) {
                set(to, lane, q);
            }
            for c in 0..3 {
                arm.force.0[c].set_lane(lane, force[c]);
            }
        }
    }
}
