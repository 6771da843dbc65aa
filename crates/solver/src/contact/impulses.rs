//! The impulses of all contacts: sweeps and Newton's method in turns, on one problem.
//!
//! A round is a sweep forwards, moves of force between twins (`twins.rs`), and a sweep backwards; rounds are accelerated
//! (`anderson.rs`). What an extrapolation takes out of a friction cone is brought back into it, and solves end with a sweep. Now and
//! then Newton iterations on those that press take out what sweeps are slow at.

use super::anderson::Anderson;
use super::newton::Newton;
use super::operator::Row;
use super::problem::Problem;
use super::twins::{self, Twins};
use crate::contact_params::ContactParams;

/// Rounds that do not halve the residual after which [`ENOUGH`] will do.
const STALLED: usize = 6;
/// What is good enough then, in tolerances: the next linearisation sees it, and goes on from there.
const ENOUGH: f64 = 2.5;

/// Memory of the solves.
#[derive(Default)]
pub(crate) struct Impulses {
    newton: Newton,
    twins: Vec<Twins>,
    /// Impulses at the start of a round.
    before: Vec<Row>,
    anderson: Anderson,
}

impl Impulses {
    /// Begins a step: what one solve leaves to the next ends with it.
    pub(crate) fn begin(&mut self) {
        self.newton.begin();
    }

    /// Solves `problem` until no sweep changes an impulse by more than `tolerance` (as the length it moves its contact by,
    /// relative to the contact's scale), the natural residual is no larger, or as many sweeps as `params` allow are done;
    /// returns their number.
    pub(crate) fn solve(&mut self, problem: &mut Problem, tolerance: f64, params: &ContactParams) -> usize {
        let (mut sweeps, mut best) = (0, f64::INFINITY);
        let most = params.most_sweeps;
        // Sweeps between two tries of Newton's method; more where it does not help.
        let few = params.sweeps_before_newton.max(3 * problem.unknowns().len() / params.unknowns_a_sweep);
        let mut round = few;
        twins::find(problem, &mut self.twins);
        let mut next = round;
        self.anderson.begin();
        let (mut mark, mut rounds_since) = (f64::INFINITY, 0);
        loop {
            self.before.clear();
            self.before.extend(problem.unknowns().iter().map(|unknown| unknown.force));
            let mut change = problem.sweep(false);
            sweeps += 1;
            if change <= tolerance || sweeps >= most {
                break;
            }
            twins::transfer(&self.twins, problem);
            change = problem.sweep(true);
            sweeps += 1;
            if change <= tolerance || sweeps >= most {
                break;
            }
            let residual = problem.residual();
            if residual < 0.5 * mark {
                (mark, rounds_since) = (residual, 0);
            } else {
                rounds_since += 1;
            }
            let enough = if rounds_since < STALLED { 1.0 } else { ENOUGH };
            if residual <= enough * tolerance {
                break;
            }
            if sweeps < next {
                self.anderson.extrapolate(problem, &self.before);
                continue;
            }
            if self.newton.solve(problem, tolerance, params) {
                // Newton's impulses are in their cones but for the tolerance; a sweep takes them there.
                problem.sweep(false);
                sweeps += 1;
                break;
            }
            round = if change < 0.5 * best { few } else { 2 * round };
            best = best.min(change);
            next = sweeps + round;
            self.anderson.begin();
        }
        sweeps
    }
}

#[cfg(test)]
mod tests;
