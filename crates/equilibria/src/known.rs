//! Starts at equilibria that are known: where there is a history, the fastest ones.

use nalgebra::UnitQuaternion;

use crate::answer::Answer;
use crate::problem::Problem;
use crate::scaled::{Cut, Scaled};
use crate::start::Starts;

/// Turns of an equilibrium's segments, cable after cable, and where else a search begins; empty where nothing is known.
#[derive(Clone, Debug)]
pub struct Known<P: Problem = Scaled> {
    /// Orientations of the segments.
    pub turns: Vec<UnitQuaternion<f64>>,
    /// The force on the first grip, over B / L^2, with the sign of the pull along the cable; or junction and forces.
    pub begin: P::Begin,
}

impl<P: Problem> Default for Known<P> {
    fn default() -> Self {
        Self { turns: Vec::new(), begin: P::Begin::default() }
    }
}

impl<P: Problem> Known<P> {
    /// Those of the lowest equilibrium; `None` where there is none.
    pub fn of(query: &P::Query, answer: &Answer<P::Equilibrium>) -> Option<Self> {
        answer.equilibria.first().map(|own| Self::at(query, own))
    }

    /// Those of an equilibrium of the query.
    pub fn at(query: &P::Query, found: &P::Equilibrium) -> Self {
        let (turns, begin) = P::known(query, found);
        Self { turns, begin }
    }

    /// Whether there is anything.
    pub fn is_known(&self) -> bool {
        !self.turns.is_empty()
    }
}

/// A start a query: as a rule the answer to the query before on a path. [`crate::Params::levels`] must be empty, as what is known
/// is so on the cable's own segments.
///
/// # Panics
/// In a search, if the number of turns is not that of the segments, or there are fewer starts than queries.
#[derive(Clone, Debug)]
pub struct Previous<P: Problem = Scaled>(pub Vec<Known<P>>);

impl<P: Problem + Sync> Starts<P> for Previous<P> {
    fn count(&self) -> usize {
        1
    }

    fn fill(&self, index: usize, _: &P, _: &Cut, turns: &mut [UnitQuaternion<f64>], begins: &mut [P::Begin]) -> usize {
        turns.copy_from_slice(&self.0[index].turns);
        begins[0] = self.0[index].begin;
        1
    }
}
