//! Many branched queries at once.

use cosserat::internals::kernels::lane::Real;
use nalgebra::{UnitQuaternion, Vector3};

use super::answer::{BranchedAnswer, BranchedEquilibrium};
use super::query::{ARMS, BranchedError, BranchedQuery};
use super::star::{Junction, Star};
use super::start::{Begin, Stars};
use super::sweep::{Change, Tree};
use crate::answer::Finish;
use crate::batch::{self, Params, ParamsError};
use crate::descent::push;
use crate::problem::{Answers, Problem, Solved, System, Wide};
use crate::scaled::{Cut, Scaled, get, set};
use crate::start::Starts;
use crate::sweep::{Found, Row};

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
    starts: &dyn Starts<Star>,
) -> Result<Vec<Result<BranchedAnswer, BranchedError>>, ParamsError> {
    Star::solve_from(queries, params, starts)
}

impl Problem for Star {
    type Query = BranchedQuery;
    type Begin = Begin;
    type Equilibrium = BranchedEquilibrium;
    type Error = BranchedError;

    fn solve_from(
        queries: &[BranchedQuery],
        params: &Params,
        starts: &dyn Starts<Self>,
    ) -> Result<Answers<Self>, ParamsError> {
        batch::answers(queries, params, starts)
    }

    fn known(query: &BranchedQuery, found: &BranchedEquilibrium) -> (Vec<UnitQuaternion<f64>>, Begin) {
        let [length, bending] = Star::new(query).units;
        let forces: [Vector3<f64>; ARMS] =
            [0, 1, 2].map(|k| found.arms[k].grips[0].force * (-length.powi(2) / bending));
        let position = (found.junction.position - query.grips[0].position) / length;
        let junction = Junction { position, ..found.junction };
        let turns = found.arms.iter().flat_map(|arm| arm.orientations.iter().copied()).collect();
        (turns, Begin { junction, forces })
    }

    fn energy(found: &BranchedEquilibrium) -> f64 {
        found.energy
    }

    fn residual(found: &BranchedEquilibrium) -> f64 {
        found.residual
    }

    fn unit(query: &BranchedQuery) -> f64 {
        let [length, bending] = Star::new(query).units;
        bending / length
    }
}

impl Solved for Star {
    const CABLES: usize = ARMS;
    type System = Trees;

    fn new(query: &BranchedQuery) -> Result<Self, BranchedError> {
        query.validate().map(|()| Self::new(query))
    }

    fn cable(&self, arm: usize, begin: &Begin) -> Scaled {
        self.arm(arm, &begin.junction)
    }

    fn is_same(a: &Begin, b: &Begin, error: f64) -> bool {
        (a.junction.position - b.junction.position).norm() <= error
            && a.forces.iter().zip(&b.forces).all(|(a, b)| (a - b).norm() <= error * a.norm().max(1.0))
    }

    fn all_starts() -> impl Starts<Self> {
        Stars::all()
    }

    fn equilibrium(
        &self,
        finish: &mut Finish,
        query: &BranchedQuery,
        begin: &Begin,
        turns: &[UnitQuaternion<f64>],
    ) -> BranchedEquilibrium {
        BranchedEquilibrium::new(finish, query, self, begin, turns)
    }

    fn not_found(solves: u32) -> BranchedError {
        BranchedError::NotFound { solves }
    }
}

/// Trees side by side.
#[derive(Clone, Debug)]
pub(crate) struct Trees {
    tree: Tree<Wide>,
    rows: [Vec<Row<Wide>>; ARMS],
    /// Of the junction and the forces in the last solve.
    change: Change<Wide>,
}

impl System<Star> for Trees {
    fn new(cut: &Cut) -> Self {
        let rows = || vec![Row::zero(); cut.segments];
        Self { tree: Tree::new(cut), rows: [rows(), rows(), rows()], change: Change::zero() }
    }

    fn load(&mut self, lane: usize, cut: &Cut, star: &Star, begin: &Begin, turns: &[UnitQuaternion<f64>]) {
        self.tree.load(lane, cut, star);
        self.tree.set_junction(lane, &begin.junction);
        for (arm, (own, force)) in self.tree.arms.iter_mut().zip(turns.chunks(cut.segments).zip(&begin.forces)) {
            for (to, q) in arm.turns.iter_mut().zip(own) {
                set(to, lane, q);
            }
            for c in 0..3 {
                arm.force.0[c].set_lane(lane, force[c]);
            }
        }
    }

    #[inline(always)]
    fn solve(&mut self, shifts: Wide) -> Found<Wide> {
        self.tree.join();
        let (found, change) = self.tree.solve(&mut self.rows, shifts);
        self.change = change;
        found
    }

    #[inline(always)]
    fn step(&mut self, shares: Wide, forces: Wide) {
        self.tree.step(&self.rows, shares, &self.change, forces);
    }

    fn push(&mut self, lane: usize) {
        self.tree.arms.iter_mut().for_each(|arm| push(arm, lane));
    }

    fn store(&self, lane: usize, turns: &mut [UnitQuaternion<f64>]) -> Begin {
        let own = self.tree.arms.iter().flat_map(|arm| &arm.turns);
        for (q, own) in turns.iter_mut().zip(own) {
            *q = get(own, lane);
        }
        let forces = [0, 1, 2].map(|k| self.tree.arms[k].force.0.map(|x| x.lane(lane)).into());
        Begin { junction: self.tree.junction(lane), forces }
    }
}
