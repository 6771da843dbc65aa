//! What is solved: a cable between two grips, or three cables that meet.

use std::fmt::{Debug, Display};

use nalgebra::UnitQuaternion;

use crate::answer::{Answer, Finish};
use crate::batch::{Params, ParamsError};
use crate::descent::System;
use crate::scaled::Scaled;
use crate::start::Starts;

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
