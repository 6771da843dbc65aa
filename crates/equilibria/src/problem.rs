//! What is solved: a cable between two grips, or three cables that meet; where searches for it begin, and several of them side by
//! side.

use std::fmt::{Debug, Display};

use cosserat::internals::kernels::lane::Lanes;
use nalgebra::UnitQuaternion;

use crate::answer::{Answer, Finish};
use crate::params::{Params, ParamsError};
use crate::scaled::{Cut, Scaled};
use crate::sweep::Found;

/// A query without units, and what belongs to it: [`Scaled`] of a cable, [`crate::branched::Star`] of three that meet.
pub trait Problem: Sized + Sync {
    /// What is asked, with units.
    type Query: Copy + Sync;
    /// Where a search begins beside the segments' turns, and where it comes to.
    type Begin: Copy + Debug + Default + Send + Sync;
    /// A stable equilibrium.
    type Equilibrium: Send;
    /// Why there is none.
    type Error: Display + Send;

    /// The answer to each query, see [`crate::solve_from`] and [`crate::branched::solve_from`].
    ///
    /// # Errors
    /// If a parameter is not allowed. A query that cannot be answered has its own error.
    fn solve_from(
        queries: &[Self::Query],
        params: &Params,
        starts: &dyn Starts<Self>,
    ) -> Result<Answers<Self>, ParamsError>;

    /// What is known of an equilibrium, to begin at it: the segments' turns, cable after cable, and the rest.
    fn known(query: &Self::Query, found: &Self::Equilibrium) -> (Vec<UnitQuaternion<f64>>, Self::Begin);

    /// Energy of an equilibrium [J].
    fn energy(found: &Self::Equilibrium) -> f64;

    /// How far from rest an equilibrium is, over the units of its moments, forces and lengths.
    fn residual(found: &Self::Equilibrium) -> f64;

    /// Unit of a query's energies, B / L [J].
    fn unit(query: &Self::Query) -> f64;
}

/// Starts of searches.
pub trait Starts<P: Problem = Scaled>: Sync {
    /// How many there are of a query at most.
    fn count(&self) -> usize;
    /// Fills in the orientations of a query's segments, cable after cable and one start after the other: `count` times those of
    /// `cut`, and where else each begins: `count` places, which are zero. Of a cable that is the force on the first grip, over
    /// B / L^2, where it is known. `index` is the query's place among all. Returns how many starts there are, of which the
    /// first places hold the turns and the rest.
    fn fill(
        &self,
        index: usize,
        query: &P,
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        begins: &mut [P::Begin],
    ) -> usize;
    /// The same of several queries with their places among all, `count` places a query in `turns` and `begins`, and in `counts` how
    /// many starts each has.
    fn fill_all(
        &self,
        queries: &[(usize, &P)],
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        begins: &mut [P::Begin],
        counts: &mut [usize],
    ) {
        let places = places(self.count(), turns, begins, counts);
        for (&(index, query), (turns, begins, own)) in queries.iter().zip(places) {
            *own = self.fill(index, query, cut, turns, begins);
        }
    }
}

/// The places of each query.
pub(crate) fn places<'a, B>(
    count: usize,
    turns: &'a mut [UnitQuaternion<f64>],
    begins: &'a mut [B],
    counts: &'a mut [usize],
) -> impl Iterator<Item = (&'a mut [UnitQuaternion<f64>], &'a mut [B], &'a mut usize)> {
    let size = turns.len() / counts.len().max(1);
    let own = turns.chunks_mut(size.max(1)).zip(begins.chunks_mut(count.max(1))).zip(counts);
    own.map(|((turns, begins), own)| (turns, begins, own))
}

/// An answer or an error for each query.
pub type Answers<P> = Vec<Result<Answer<<P as Problem>::Equilibrium>, <P as Problem>::Error>>;

/// What [`crate::batch`] needs of a problem.
pub(crate) trait Solved: Problem {
    /// Cables of one.
    const CABLES: usize;
    /// Several side by side.
    type System: System<Self>;

    /// Checks a query and takes the units off.
    fn new(query: &Self::Query) -> Result<Self, Self::Error>;

    /// One of its cables, as the turns on a finer level are interpolated.
    fn cable(&self, cable: usize, begin: &Self::Begin) -> Scaled;

    /// Whether two searches with about the same energy have come to the same equilibrium, but for errors of this size.
    fn is_same(a: &Self::Begin, b: &Self::Begin, error: f64) -> bool;

    /// The starts that are tried where others lead nowhere.
    fn all_starts() -> impl Starts<Self>;

    /// The equilibrium that a search has come to.
    fn equilibrium(
        &self,
        finish: &mut Finish,
        query: &Self::Query,
        begin: &Self::Begin,
        turns: &[UnitQuaternion<f64>],
    ) -> Self::Equilibrium;

    /// The error of a query for which no search came to rest.
    fn not_found(solves: u32) -> Self::Error;
}

/// Queries side by side.
pub(crate) const WIDTH: usize = 8;
pub(crate) type Wide = Lanes<WIDTH>;

/// Problems side by side, one a lane.
pub(crate) trait System<P: Problem> {
    /// Memory for cables of this cut.
    fn new(cut: &Cut) -> Self;

    /// Puts a problem into a lane, with its start.
    fn load(&mut self, lane: usize, cut: &Cut, problem: &P, begin: &P::Begin, turns: &[UnitQuaternion<f64>]);

    /// Solves for the step from here with turns made stiffer by `shifts` times the segments' lengths, and keeps it.
    fn solve(&mut self, shifts: Wide) -> Found<Wide>;

    /// Goes on by `shares` of the step, and by `forces` of the forces' changes.
    fn step(&mut self, shares: Wide, forces: Wide);

    /// Turns the segments of a lane a little.
    fn push(&mut self, lane: usize);

    /// Where a lane is.
    fn store(&self, lane: usize, turns: &mut [UnitQuaternion<f64>]) -> P::Begin;
}
